//! From the residual to the standard uncertainty of a position.
//!
//! Let s^2 be the variance of a target pixel's noise. The reference, a mean of m frames, has s^2/m. Interpolation at
//! a phase between two pixels multiplies the variance of the target's noise by G <= 1 ([`crate::Interpolation`]), so
//! the residual r = g - a - b f of N pixels and P + 2 fitted numbers (gain and offset are two) gives
//!
//! s^2 = sum r^2 / (N - P - 2) / (G + b^2/m).                                                      (1)
//!
//! Yet a displacement depends on the sums of r with the steepest descent images Z', which vary slowly: interpolation
//! passes such sums unchanged, so there G is 1. (Taking the residual's variance itself would understate sigma by up to
//! a quarter.) With the gradient's noise of energy K (`noise` below) and S the energy of the rest (`signal`),
//!
//! cov dp = s^2/b^2 M^-1 [ (1 + b^2/m) S + G K ] M^-T.                                              (2)
//!
//! The reference's noise has no product with K: the filters are antisymmetric, D^T = -D, and n^T D n = 0. The noise in
//! the gradient is white, so the target's interpolated noise multiplies it with variance G.

use crate::PreparedSubset;
use crate::prepared::Patch;
use crate::warp::Warp;

/// Covariance of the displacement of the centre (xx, xy, yy) per unit variance of a pixel's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UnitCovariance {
    /// M^-1 S M^-T.
    pub(crate) signal: [f64; 3],
    /// M^-1 K M^-T.
    pub(crate) noise: [f64; 3],
}

impl UnitCovariance {
    pub(crate) fn largest_signal(&self) -> f64 {
        let [xx, _, yy] = self.signal;
        // NaN stays NaN
        if xx > yy { xx } else { yy }
    }
}

/// What a match leaves.
pub(crate) struct Residual {
    /// Gain b of the target over the reference.
    pub(crate) gain: f64,
    /// Sum of r^2, in counts squared of the target.
    pub(crate) sum_of_squares: f64,
}

/// Standard uncertainty of the position in x and y, in pixels of the target.
pub(crate) fn sigma_px(subset: &PreparedSubset, warp: &Warp, residual: &Residual) -> [f64; 2] {
    let n_fitted = 2 * subset.settings.shape.n_terms() + 2;
    let degrees_of_freedom = subset.n_pixels().saturating_sub(n_fitted).max(1) as f64;
    let interpolation_gain = mean_noise_gain(subset, warp);
    let from_reference = residual.gain.powi(2) / subset.n_averaged;
    let variance = residual.sum_of_squares / degrees_of_freedom / (interpolation_gain + from_reference);
    let scale = variance / residual.gain.powi(2);
    sigma_from(subset, warp, scale * (1.0 + from_reference), scale * interpolation_gain)
}

/// Standard uncertainty of the position in the reference frame itself. There the position is given and the residual
/// zero; what is uncertain is which point of the body the noisy reference stands for.
pub(crate) fn reference_sigma_px(subset: &PreparedSubset) -> [f64; 2] {
    sigma_from(subset, &Warp::at(subset.centre_px), subset.noise_variance, 0.0)
}

fn sigma_from(subset: &PreparedSubset, warp: &Warp, signal: f64, noise: f64) -> [f64; 2] {
    let term = |i: usize| signal * subset.covariance.signal[i] + noise * subset.covariance.noise[i];
    let [xx, xy, yy] = [term(0), term(1), term(2)];
    [[1.0, 0.0], [0.0, 1.0]].map(|axis| {
        // The covariance is that of the subset's own coordinates: (1 + A) cov (1 + A)^T, row by row.
        let [a, b] = [
            axis[0] * (1.0 + warp.gradient[0]) + axis[1] * warp.gradient[2],
            axis[0] * warp.gradient[1] + axis[1] * (1.0 + warp.gradient[3]),
        ];
        (a * a * xx + 2.0 * a * b * xy + b * b * yy).max(0.0).sqrt()
    })
}

/// G over the subset, whose phases differ where it is deformed: the mean over a grid of 4 x 4 places.
fn mean_noise_gain(subset: &PreparedSubset, warp: &Warp) -> f64 {
    const N: usize = 4;
    let place = |i: usize, first: f64, n: usize| first + ((i as f64 + 0.5) / N as f64 * n as f64).floor();
    let interpolation = subset.settings.interpolation;
    let mut sum = 0.0;
    for i in 0..N * N {
        let x = place(i % N, subset.first_px[0], subset.width);
        let y = place(i / N, subset.first_px[1], subset.height);
        let [x, y] = warp.apply([x, y]);
        sum += interpolation.noise_gain(x) * interpolation.noise_gain(y);
    }
    sum / (N * N) as f64
}

/// Variance of the noise of one reference pixel, from the image's highest frequencies, where optics leave no texture:
/// the mean square of fourth differences along x and y, 1 -4 6 -4 1 in each, whose squares sum to 70 in each.
///
/// (J. Immerkaer, Comput. Vis. Image Underst. 64 (1996) 300-302, uses second differences; by their spectrum, speckles
/// of 4.5 px leave 1 % of full range in those and 0.2 % here.)
pub(crate) fn reference_noise_variance(patch: &Patch) -> f64 {
    const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
    let differences = patch.filtered(&FOURTH, 2, &FOURTH, 2);
    let mean_square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
    // Rounding of f32 pixels: so an image of exact stripes has no texture along them either.
    let rounding = 1e-6 * patch.mean.abs();
    mean_square / (70.0 * 70.0) + rounding * rounding
}
