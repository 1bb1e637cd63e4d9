//! What peak energies miss where the tracks ask for other contacts than are stated.

use chainwave_analysis::{GapFront, Measurement, PeakEnergies};
use chainwave_inference::{FitError, TrackFit, fitted_chain};
use chainwave_measurement::Estimate;
use chainwave_mechanics::Chain;

/// Adds to the peak energies, which are read by the stated contact law, by how much they are off if the contacts are those of a fit that is believed:
/// an error that all gaps have together.
///
/// # Errors
/// The chain model refuses the fitted values.
pub(crate) fn add_contacts_asked(
    measurement: &mut Measurement,
    chain: &Chain,
    fit: &TrackFit,
) -> Result<(), FitError> {
    let asked = fitted_chain(fit)?;
    let spacing = &measurement.strain.spacing;
    let Some(energies) = &mut measurement.energies else { return Ok(()) };
    let of_gap = |gap: &usize| {
        let front = measurement.fronts.get(gap - 1).and_then(|front| front.as_ref().ok());
        let overlap_m = |front: &GapFront| -front.peak_strain.value * spacing.of_gap_m(*gap);
        let energy_j = |chain: &Chain, overlap_m: f64| chain.contact.of_gap(gap - 1).energy()(overlap_m);
        let ratio = front.map(overlap_m).map(|x_m| energy_j(&asked, x_m) / energy_j(chain, x_m));
        ratio.filter(|ratio| ratio.is_finite()).map_or(0.0, |ratio| ratio - 1.0)
    };
    let off: Vec<f64> = energies.gaps.iter().map(of_gap).collect();
    add(energies, &off);
    Ok(())
}

/// Adds an error of so much of each gap's energy, in all gaps together.
fn add(energies: &mut PeakEnergies, relative: &[f64]) {
    let wider = |x: &mut Estimate, relative: f64| x.sigma = x.sigma.hypot(relative * x.value);
    let off_j: Vec<f64> = energies.energy_j.iter().zip(relative).map(|(x, off)| x.value * off).collect();
    energies.energy_j.iter_mut().zip(relative).for_each(|(x, off)| wider(x, *off));
    for ((i, j), covariance_j2) in energies.covariance_j2.indexed_iter_mut() {
        *covariance_j2 += off_j[i] * off_j[j];
    }
    let of_first = relative.first().copied().unwrap_or(0.0);
    let of_ratios = energies.relative.iter_mut().flatten().zip(relative);
    of_ratios.for_each(|(x, off)| wider(x, (off - of_first) / (1.0 + of_first)));
}

#[cfg(test)]
mod tests {
    use chainwave_analysis::FrontSettings;
    use ndarray::Array2;

    use super::*;

    #[test]
    fn what_all_gaps_are_off_by_makes_energies_wider_and_not_their_ratios() {
        let energies = || PeakEnergies {
            gaps: vec![1, 2],
            energy_j: vec![Estimate::new(4.0, 0.03), Estimate::new(2.0, 0.01)],
            relative: Some(vec![Estimate::new(1.0, 0.0), Estimate::new(0.5, 0.002)]),
            covariance_j2: Array2::from_diag(&ndarray::arr1(&[9e-4, 1e-4])),
            n_replicas: 100,
            front: FrontSettings::default(),
            missing: Vec::new(),
        };
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found}");
        let mut alike = energies();
        add(&mut alike, &[0.01, 0.01]);
        close(alike.energy_j[0].sigma, 0.05);
        close(alike.covariance_j2[(0, 1)], 0.04 * 0.02);
        close(alike.covariance_j2[(0, 0)], 0.05 * 0.05);
        close(alike.relative.unwrap()[1].sigma, 0.002);
        let mut second = energies();
        add(&mut second, &[0.0, 0.01]);
        close(second.energy_j[0].sigma, 0.03);
        close(second.relative.unwrap()[1].sigma, 0.002_f64.hypot(0.005));
    }
}
