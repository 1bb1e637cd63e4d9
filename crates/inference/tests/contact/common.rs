//! Curves of known laws, and the fit as most tests call it.

use chainwave_inference::contact_fit::{ContactFit, Zero, fit_contact};
use chainwave_mechanics::PowerLaw;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// A measured curve: overlaps in metres, forces in newtons.
pub(crate) type Curve = (Vec<f64>, Vec<f64>);

/// `n` overlaps from `from_m` to `to_m`.
pub(crate) fn ramp(from_m: f64, to_m: f64, n: usize) -> Vec<f64> {
    (0..n).map(|i| from_m + (to_m - from_m) * i as f64 / (n - 1) as f64).collect()
}

/// `n` standard normal deviates; the factor keeps the generator's states of neighbouring seeds apart.
pub(crate) fn deviates(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31));
    (0..n).map(|_| StandardNormal.sample(&mut random)).collect()
}

/// Forces of a law with independent noise; none before contact.
pub(crate) fn noisy(law: &PowerLaw, overlaps_m: Vec<f64>, noise_n: f64, seed: u64) -> Curve {
    let deviates = deviates(overlaps_m.len(), seed);
    let force_n = |(x, deviate): (&f64, f64)| law.force_n(x.max(0.0)) + noise_n * deviate;
    let forces_n = overlaps_m.iter().zip(deviates).map(force_n).collect();
    (overlaps_m, forces_n)
}

pub(crate) fn fitted(curve: &Curve) -> ContactFit {
    fit_contact(&curve.0, &curve.1, Zero::Auto).unwrap()
}

/// The same curve with independent noise of its overlaps.
pub(crate) fn with_noisy_overlaps((overlaps_m, forces_n): Curve, noise_m: f64, seed: u64) -> Curve {
    let deviates = deviates(overlaps_m.len(), seed);
    let stated_m = overlaps_m.iter().zip(deviates).map(|(overlap_m, deviate)| overlap_m + noise_m * deviate);
    (stated_m.collect(), forces_n)
}
