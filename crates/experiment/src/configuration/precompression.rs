//! A chain that is pressed together: where its bodies are while every contact holds the same force.

use chainwave_mechanics::{Chain, Contact, FarEnd};

use crate::error::Error;

/// Halvings after which an overlap is known to the last bit.
const HALVINGS: usize = 200;
/// No chain is pressed together by more than this in a gap.
const MOST_M: f64 = 1e3;

/// Displacements of bodies whose contacts all hold a force: against a wall at the far end, or, where there is none, from the last body on,
/// which is held where it rests.
///
/// # Errors
/// Contacts that do not hold it, and bodies that springs to ground hold as well.
pub(super) fn precompressed_m(chain: &Chain, force_n: f64) -> Result<Vec<f64>, Error> {
    if !chain.ground_stiffness_n_per_m.is_empty() || chain.ground_law.is_some() {
        return Err(Error::Value(
            "drive.precompression_n: expected a chain that nothing holds to ground, which would share the force (hint: state the places by initial)"
                .into(),
        ));
    }
    let n = chain.n_bodies();
    let mut displacement_m = vec![0.0; n];
    let mut behind_m = match chain.far_end {
        FarEnd::Fixed => overlap_m(chain.contact.of_gap(n - 1), force_n, n)?,
        FarEnd::Free | FarEnd::Struck(_) => 0.0,
    };
    for body in (0..n).rev() {
        displacement_m[body] = behind_m;
        if body > 0 {
            behind_m += overlap_m(chain.contact.of_gap(body - 1), force_n, body)?;
        }
    }
    Ok(displacement_m)
}

/// The overlap at which a contact holds a force; `gap` names it in a refusal.
fn overlap_m(contact: &Contact, force_n: f64, gap: usize) -> Result<f64, Error> {
    let holds_n = |overlap_m: f64| contact.force_and_energy(overlap_m).0;
    let refused = |why: &str| {
        Error::Value(format!(
            "drive.precompression_n: expected a force that every contact holds, found {force_n} N, which that of gap {gap} {why}"
        ))
    };
    let mut most_m = force_n / contact.stiffness_n_per_m(0.0).max(f64::MIN_POSITIVE);
    while holds_n(most_m) < force_n {
        most_m *= 2.0;
        if most_m >= MOST_M || most_m.is_nan() {
            return Err(refused("never reaches"));
        }
    }
    let mut least_m = 0.0;
    for _ in 0..HALVINGS {
        let middle_m = 0.5 * (least_m + most_m);
        if holds_n(middle_m) < force_n { least_m = middle_m } else { most_m = middle_m }
    }
    if contact.stiffness_n_per_m(most_m) <= 0.0 {
        return Err(refused("holds only where it gives way"));
    }
    Ok(most_m)
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::{Drive, LinearLaw, PowerLaw};

    use super::*;

    fn chain(contact: chainwave_mechanics::Contacts, far_end: FarEnd) -> Chain {
        Chain {
            mass_kg: vec![1e-3; 3],
            damping_kg_per_s: vec![0.0; 3],
            ground_stiffness_n_per_m: Vec::new(),
            ground_law: None,
            contact,
            drive: Drive::Free { displacement_m: vec![0.0; 3], velocity_m_per_s: vec![0.0; 3] },
            far_end,
        }
    }

    #[test]
    fn springs_shorten_by_force_over_stiffness() {
        let springs = || LinearLaw::new(500.0).unwrap().into();
        let found = precompressed_m(&chain(springs(), FarEnd::Fixed), 2.0).unwrap();
        // 4 mm a gap, the wall's among them.
        for (found, expected) in found.iter().zip([12e-3, 8e-3, 4e-3]) {
            assert!((found - expected).abs() < 1e-15, "{found}");
        }
        let free = precompressed_m(&chain(springs(), FarEnd::Free), 2.0).unwrap();
        assert!(free[2].abs() < 1e-18 && (free[0] - 8e-3).abs() < 1e-15, "{free:?}");
    }

    #[test]
    fn a_softening_law_holds_what_it_is_asked_or_is_refused() {
        let law = PowerLaw::ELLIPTICAL_RING;
        let found = precompressed_m(&chain(law.into(), FarEnd::Fixed), 3.0).unwrap();
        let overlap_m = found[2];
        let exact_m = ((3.0 + law.f_0_n()) / law.a).powf(law.p.recip()) - law.delta_0_m;
        // The force bends by 1e-16 of itself, of which the exponent makes nine times as much.
        assert!((overlap_m / exact_m - 1.0).abs() < 1e-12, "{overlap_m} {exact_m}");
        let said = precompressed_m(&chain(law.into(), FarEnd::Fixed), 1e4).unwrap_err().to_string();
        assert!(said.contains("precompression_n") && said.contains("never reaches"), "{said}");
    }
}
