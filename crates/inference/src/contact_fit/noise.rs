//! Whether overlaps err: forces then scatter the more, the steeper the curve is where they were read.

use chainwave_analysis::summit;
use nalgebra::DVector;

use super::curve::Curve;
use super::search::{Parameters, off_n};
use super::statistics::memory;

/// Twice the gain in the logarithm of the likelihood at which overlaps that err are told: a share that cannot be negative gains as much by chance in
/// one of a hundred curves.
const TOLD_GAIN: f64 = 5.41;
/// The largest share of the noise that overlaps make, so that forces where the curve is flat keep some.
const MOST_SHARE: f64 = 1.0 - 1e-6;
/// Of the share: a thousandth of its own standard error, of a thousand readings.
const TOLERANCE: f64 = 1e-4;

/// Noise of forces and of overlaps, both independent and normal.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OverlapNoise {
    /// Standard deviation of an overlap, in metres.
    pub(super) sigma_m: f64,
    /// Mean noise of all forces over that of each, by both.
    pub(super) weights: Vec<f64>,
}

impl OverlapNoise {
    /// What the residuals of a law tell of it: nothing where equal noise of all forces may well have made them, or where they follow each other,
    /// as then the law misses something, and that may be larger where the curve is steep.
    pub(super) fn of(curve: &Curve, parameters: &Parameters) -> Option<Self> {
        let off_n = off_n(curve, parameters);
        if memory(&off_n) > 1.0 || off_n.amax() <= curve.rounding_n() {
            return None;
        }
        let slopes = curve.overlap_m.iter().map(|x_m| {
            let overlap_m = x_m - parameters.start_m;
            if overlap_m > 0.0 { parameters.law.at(overlap_m).stiffness_n_per_m } else { 0.0 }
        });
        let slopes = DVector::from_iterator(curve.len(), slopes);
        let n = curve.len() as f64;
        let usual_n_per_m = (slopes.norm_squared() / n).sqrt();
        let relative = |share: f64| {
            slopes.map(|slope_n_per_m| 1.0 - share + share * (slope_n_per_m / usual_n_per_m).powi(2))
        };
        let variance_n2 =
            |share: f64| off_n.map(|off_n| off_n * off_n).component_div(&relative(share)).mean();
        let ln_likelihood =
            |share: f64| -0.5 * (n * variance_n2(share).ln() + relative(share).map(f64::ln).sum());
        let share = summit(|share| Some(ln_likelihood(share)), [0.0, MOST_SHARE], 0.5, TOLERANCE)?;
        if 2.0 * (ln_likelihood(share) - ln_likelihood(0.0)) <= TOLD_GAIN {
            return None;
        }
        Some(Self {
            sigma_m: (share * variance_n2(share)).sqrt() / usual_n_per_m,
            weights: relative(share).iter().map(|relative| relative.sqrt().recip()).collect(),
        })
    }
}
