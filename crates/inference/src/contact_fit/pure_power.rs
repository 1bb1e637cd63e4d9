//! A curve without an offset: F = A Delta^p, as of spheres that nothing presses together.
//!
//! The law's k_0 then goes to zero or without end as delta_0 goes to zero, so that no best one is found; the power is told all the same.

use chainwave_analysis::summit;
use chainwave_measurement::Estimate;

use super::curve::Curve;
use super::error::ContactFitError;
use super::law::EXPONENTS;

/// Residuals over the curve's own noise up to which a power of the overlap explains it.
const EXPLAINED: f64 = 1.5;
/// The same over the largest force, of a curve without noise: what the search for the exponent leaves.
const EXACT: f64 = 1e-6;
/// Of the exponent: near its least a sum of squares differs by less than its rounding within some 1e-8 of the place.
const TOLERANCE: f64 = 1e-9;
/// Step in p over which the sum of squares tells its curvature.
const STEP: f64 = 1e-3;

/// What a curve has to say for itself for which no law with an offset was found, where a power of the overlap explains it.
pub(super) fn without_offset(curve: &Curve, start_m: f64) -> Option<ContactFitError> {
    let sum_at = |p: f64| fitted(curve, start_m, p).1;
    let (low, high) = EXPONENTS;
    let p = summit(|p| Some(-sum_at(p)), [low, high], 0.5 * (low + high), TOLERANCE)?;
    let (a, sum) = fitted(curve, start_m, p);
    let noise_n = (sum / (curve.len() as f64 - 2.0)).sqrt();
    let largest_n = curve.force_n.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
    if noise_n > (EXPLAINED * curve.noise_n()).max(EXACT * largest_n) {
        return None;
    }
    let curvature = (sum_at(p + STEP) - 2.0 * sum + sum_at(p - STEP)) / (STEP * STEP);
    let sigma = noise_n * (2.0 / curvature).sqrt();
    Some(ContactFitError::NoOffset { a, p: Estimate::new(p, sigma) })
}

/// A for an exponent, and the sum of squares that it leaves.
fn fitted(curve: &Curve, start_m: f64, p: f64) -> (f64, f64) {
    let powers: Vec<f64> = curve.overlap_m.iter().map(|x_m| (x_m - start_m).max(0.0).powf(p)).collect();
    let pairs = || powers.iter().zip(&curve.force_n);
    let a = pairs().map(|(power, f)| power * f).sum::<f64>()
        / powers.iter().map(|power| power * power).sum::<f64>();
    (a, pairs().map(|(power, f)| (f - a * power).powi(2)).sum())
}
