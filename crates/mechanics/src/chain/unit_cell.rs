//! The bodies and gaps that a chain repeats, and the bands of the waves that small motions make of them.

use std::f64::consts::PI;

use nalgebra::{Complex, DMatrix};

use crate::contact::contacts::Contacts;
use crate::equations::parameters::Chain;

/// Turns from cell to cell at which the bands of masses on springs to their neighbours end, whatever the cell.
const EDGES_RAD: [f64; 2] = [0.0, PI];

/// The bodies and gaps that an infinite chain repeats, each gap behind its body.
///
/// Small motions x_n = A_n exp(i (kappa n - omega t)) of masses m_n on springs k_n, the chain's tangents at zero overlap, and held to ground
/// by g_n, obey m_n omega^2 A_n = (k_n + k_{n-1} + g_n) A_n - k_n exp(i kappa) A_{n+1} - k_{n-1} exp(-i kappa) A_{n-1}, with A repeating
/// from cell to cell (L. Brillouin, Wave Propagation in Periodic Structures, 1946): a Hermitian problem with as many bands as the cell has bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitCell {
    /// Masses in kilograms; one at least.
    mass_kg: Vec<f64>,
    /// Tangent stiffness of the gap behind each, in newtons per metre.
    stiffness_n_per_m: Vec<f64>,
    /// What holds each to ground, in newtons per metre.
    ground_n_per_m: Vec<f64>,
}

impl UnitCell {
    /// The shortest cell that a chain of these masses and contacts repeats, held to ground by so many newtons per metre each, or by nothing
    /// where the list is empty; none where it shows none twice, as a graded one does not.
    pub fn of(mass_kg: &[f64], contacts: &Contacts, ground_n_per_m: &[f64]) -> Option<Self> {
        let n_bodies = mass_kg.len();
        let held = |body: usize| ground_n_per_m.get(body).copied().unwrap_or(0.0);
        let ground: Vec<f64> = (0..n_bodies).map(held).collect();
        let stiffness: Vec<f64> =
            (0..n_bodies.saturating_sub(1)).map(|gap| contacts.of_gap(gap).stiffness_n_per_m(0.0)).collect();
        let is_repeated = |values: &[f64], period: usize| {
            values.iter().zip(values.iter().skip(period)).all(|(one, next)| one.total_cmp(next).is_eq())
        };
        let repeats =
            |period: &usize| [mass_kg, &stiffness, &ground].iter().all(|values| is_repeated(values, *period));
        let period = (1..=stiffness.len() / 2).chain((stiffness.len() == 1).then_some(1)).find(repeats)?;
        let cell = |values: &[f64]| values[..period].to_vec();
        Some(Self {
            mass_kg: cell(mass_kg),
            stiffness_n_per_m: cell(&stiffness),
            ground_n_per_m: cell(&ground),
        })
    }

    /// Bodies in the cell, and so bands.
    pub fn n_bodies(&self) -> usize {
        self.mass_kg.len()
    }

    /// Frequencies in hertz, in rising order, of the waves that turn by `kappa_rad` from body to body; a wave of a cell of p bodies turns by
    /// that up to 2 pi / p.
    pub fn frequencies_hz(&self, kappa_rad: f64) -> Vec<f64> {
        let n = self.n_bodies();
        let mut dynamics = DMatrix::<Complex<f64>>::zeros(n, n);
        for (body, &k) in self.stiffness_n_per_m.iter().enumerate() {
            let next = (body + 1) % n;
            let coupling =
                Complex::from_polar(k, kappa_rad) / (self.mass_kg[body] * self.mass_kg[next]).sqrt();
            dynamics[(body, body)] += (k + self.ground_n_per_m[body]) / self.mass_kg[body];
            dynamics[(next, next)] += k / self.mass_kg[next];
            dynamics[(body, next)] -= coupling;
            dynamics[(next, body)] -= coupling.conj();
        }
        let mut squares: Vec<f64> = dynamics.symmetric_eigenvalues().iter().copied().collect();
        squares.sort_by(f64::total_cmp);
        // Rounding leaves the square of a uniform shift a little off zero.
        squares.into_iter().map(|square| square.max(0.0).sqrt() / (2.0 * PI)).collect()
    }

    /// The bands: lowest and highest frequency of each, in hertz, from the acoustic one on.
    pub fn bands_hz(&self) -> Vec<[f64; 2]> {
        let [centre, edge] = EDGES_RAD.map(|of_cell| self.frequencies_hz(of_cell / self.n_bodies() as f64));
        centre.iter().zip(&edge).map(|(one, other)| [one.min(*other), one.max(*other)]).collect()
    }

    /// Upper edge of the highest band in hertz: no wave of a higher frequency runs down the chain.
    pub fn highest_hz(&self) -> f64 {
        self.bands_hz().last().map_or(0.0, |band| band[1])
    }
}

impl Chain {
    /// The cell that the chain repeats; none where it repeats none.
    pub fn unit_cell(&self) -> Option<UnitCell> {
        UnitCell::of(&self.mass_kg, &self.contact, &self.ground_at_rest_n_per_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{contacts::Contact, contacts::Law, linear::LinearLaw};

    fn springs(stiffness: &[f64]) -> Contacts {
        let contact = |k: &f64| Contact::from(Law::Linear(LinearLaw::new(*k).unwrap()));
        Contacts::Each(stiffness.iter().map(contact).collect())
    }

    /// Rounding of a root of a sum of numbers of this size.
    fn close(found: f64, expected: f64) -> bool {
        (found - expected).abs() <= 1e-9 * expected.abs().max(1.0)
    }

    #[test]
    fn one_body_has_the_band_of_the_linear_chain() {
        let (k, m) = (1474.0_f64, 0.455e-3_f64);
        let cell = UnitCell::of(&[m; 6], &springs(&[k; 5]), &[]).unwrap();
        assert_eq!(cell.n_bodies(), 1);
        for kappa in [0.0, 0.3, 1.7, PI] {
            let expected = (k / m).sqrt() * (0.5 * kappa).sin().abs() / PI;
            assert!(close(cell.frequencies_hz(kappa)[0], expected), "{kappa}");
            assert!(close(cell.frequencies_hz(-kappa)[0], expected));
        }
    }

    #[test]
    fn two_masses_have_the_gap_of_the_textbooks() {
        let (k, light, heavy) = (1474.0_f64, 0.455e-3_f64, 1.365e-3_f64);
        let masses = [light, heavy, light, heavy, light];
        let cell = UnitCell::of(&masses, &springs(&[k; 4]), &[]).unwrap();
        let hz = |omega_squared: f64| omega_squared.sqrt() / (2.0 * PI);
        // C. Kittel, Introduction to Solid State Physics, chapter 4: sqrt(2 k / M), sqrt(2 k / m), sqrt(2 k (1/m + 1/M)).
        let [acoustic, optical] = cell.bands_hz()[..] else { panic!("expected two bands") };
        assert!(close(acoustic[0], 0.0) || acoustic[0] < 1e-4, "{acoustic:?}");
        assert!(close(acoustic[1], hz(2.0 * k / heavy)), "{acoustic:?}");
        assert!(close(optical[0], hz(2.0 * k / light)), "{optical:?}");
        assert!(close(optical[1], hz(2.0 * k * (light.recip() + heavy.recip()))), "{optical:?}");
        assert!(close(cell.highest_hz(), optical[1]));
        for kappa in [0.2_f64, 0.9, 1.5] {
            let sum = light.recip() + heavy.recip();
            let root = (sum * sum - 4.0 * kappa.sin().powi(2) / (light * heavy)).sqrt();
            let expected = [hz(k * (sum - root)), hz(k * (sum + root))];
            let found = cell.frequencies_hz(kappa);
            assert!(
                found.iter().zip(expected).all(|(one, other)| close(*one, other)),
                "{found:?} {expected:?}"
            );
        }
    }

    #[test]
    fn two_springs_in_turn_open_a_gap_between_them() {
        let (stiff, soft, m) = (2000.0_f64, 1200.0_f64, 0.5e-3_f64);
        let cell = UnitCell::of(&[m; 6], &springs(&[stiff, soft, stiff, soft, stiff]), &[]).unwrap();
        let hz = |omega_squared: f64| omega_squared.sqrt() / (2.0 * PI);
        let [acoustic, optical] = cell.bands_hz()[..] else { panic!("expected two bands") };
        assert!(close(acoustic[1], hz(2.0 * soft / m)) && close(optical[0], hz(2.0 * stiff / m)));
        assert!(close(optical[1], hz(2.0 * (stiff + soft) / m)));
    }

    #[test]
    fn a_cell_of_alike_bodies_folds_the_band_of_one() {
        let (k, m, g) = (1474.0, 0.455e-3, 300.0);
        let one = UnitCell { mass_kg: vec![m], stiffness_n_per_m: vec![k], ground_n_per_m: vec![g] };
        let three =
            UnitCell { mass_kg: vec![m; 3], stiffness_n_per_m: vec![k; 3], ground_n_per_m: vec![g; 3] };
        let kappa = 0.7;
        let mut folded: Vec<f64> =
            (-1..=1).map(|turn| one.frequencies_hz(kappa + f64::from(turn) * 2.0 * PI / 3.0)[0]).collect();
        folded.sort_by(f64::total_cmp);
        assert!(
            three.frequencies_hz(kappa).iter().zip(&folded).all(|(found, expected)| close(*found, *expected))
        );
    }

    #[test]
    fn what_holds_bodies_to_ground_lifts_the_bands() {
        let (k, m, g) = (1474.0_f64, 0.455e-3_f64, 900.0_f64);
        let held = UnitCell::of(&[m; 6], &springs(&[k; 5]), &[g; 6]).unwrap();
        for kappa in [0.0_f64, 0.3, 1.7, PI] {
            // M. Remoissenet, Waves Called Solitons, chapter 2: m omega^2 = g + 4 k sin^2(kappa / 2).
            let expected = ((g + 4.0 * k * (0.5 * kappa).sin().powi(2)) / m).sqrt() / (2.0 * PI);
            assert!(close(held.frequencies_hz(kappa)[0], expected), "{kappa}");
        }

        // Every second body held, all of one mass: with w = m omega^2 - 2 k, w (w - g) = 4 k^2 cos^2(kappa). At the edge of the zone,
        // kappa = pi / 2, one body of the two rests: the gap lies between 2 k and 2 k + g.
        let every_second = [0.0, g, 0.0, g, 0.0, g];
        let cell = UnitCell::of(&[m; 6], &springs(&[k; 5]), &every_second).unwrap();
        assert_eq!(cell.n_bodies(), 2);
        let hz = |n_per_m: f64| (n_per_m / m).sqrt() / (2.0 * PI);
        for kappa in [0.0_f64, 0.4, 1.1, 0.5 * PI] {
            let root = (0.25 * g * g + (2.0 * k * kappa.cos()).powi(2)).sqrt();
            let expected = [-1.0, 1.0].map(|sign| hz(2.0 * k + 0.5 * g + sign * root));
            let found = cell.frequencies_hz(kappa);
            assert!(
                found.iter().zip(expected).all(|(one, other)| close(*one, other)),
                "{found:?} {expected:?}"
            );
        }
        let [lower, upper] = cell.bands_hz()[..] else { panic!("expected two bands") };
        assert!(close(lower[1], hz(2.0 * k)) && close(upper[0], hz(2.0 * k + g)), "{lower:?} {upper:?}");
        assert!(lower[0] > 0.0, "nothing moves freely");

        // Held unevenly, it repeats nothing.
        let grade: Vec<f64> = (0..6).map(|body| 100.0 * f64::from(body)).collect();
        assert_eq!(UnitCell::of(&[m; 6], &springs(&[k; 5]), &grade), None);
    }

    #[test]
    fn a_graded_chain_repeats_nothing() {
        assert_eq!(UnitCell::of(&[1.0, 2.0, 3.0, 4.0], &springs(&[1.0; 3]), &[]), None);
        assert_eq!(UnitCell::of(&[1.0, 2.0, 3.0], &springs(&[1.0; 2]), &[]), None);
        assert_eq!(UnitCell::of(&[1.0, 1.0], &springs(&[1.0]), &[]).map(|cell| cell.n_bodies()), Some(1));
    }
}
