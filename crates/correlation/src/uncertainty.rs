//! From the residual to the standard uncertainty of a position.
//!
//! Let s^2 be the variance of a target pixel's noise. The reference, a mean of m frames, has s^2/m. Interpolation at
//! a phase between two pixels multiplies the variance of the target's noise by G <= 1 ([`crate::Interpolation`]), so
//! the residual r = g - a - b f of N pixels and P + 2 fitted numbers (gain and offset are two) gives
//!
//! s^2 = (sum r^2 - b^2 E) / (N - P - 2) / (G + b^2/m (1 - e)),                                   (1)
//!
//! where E is the energy that interpolation's own errors have in the residual and e the share of the reference's noise in
//! what E was foreseen from ([`crate::interpolation_error::energy`]).
//!
//! Yet a displacement depends on the sums of r with the steepest descent images Z', which vary slowly: interpolation
//! passes such sums unchanged but for the contrast C that it takes from the gradients themselves (1, nearly, for all kernels
//! but the linear one), so there G is C^2. (Taking the residual's variance itself would understate sigma by up to
//! a quarter.) With the gradient's noise of energy K (`noise` below) and S the energy of the rest (`signal`),
//!
//! cov dp = s^2/b^2 M^-1 [ (C^2 + b^2/m) S + G K ] M^-T.                                            (2)
//!
//! Shot noise grows with the light. The variance of a pixel's noise is taken for a line over the reference's grey value f
//! (less its mean), `s^2 (1 + c f)`, with `c = sum r^2 f / sum f^2` over the mean of r^2. S, a sum of squares over pixels,
//! then has its terms multiplied with `1 + c f`, which for the centre adds `c sum (M^-1 Z')^2 f` to what s^2 multiplies.
//!
//! Where the target shows the subset smaller, several pixels of the reference share one of its pixels' noise. A sum of r with slow weights over the
//! reference's pixels is 1/J times that over the target's, J of which lie on one of the reference's, so that C^2 becomes C^2 / J (J, the
//! determinant of the warp); where it shows the subset larger, pixels between are not read, and G is the least. (Without it, intervals of 95 %
//! held 82 % at half the length.)
//!
//! Grey values are whole steps q. What noise of a third of a step and more scatters has the step's own q^2/12 in it; with less, frames at rest
//! are alike and match to nothing, and their mean is as far off as each. So s^2 is at least q^2/12, and m is one then.
//!
//! The reference's noise has no product with K: the filters are antisymmetric, D^T = -D, and n^T D n = 0. The noise in
//! the gradient is white, so the target's interpolated noise multiplies it with variance G.

use chainwave_measurement::Estimate;

use crate::PreparedSubset;
use crate::interpolation_error::energy::Foreseen;
use crate::warp::Warp;

/// What a match leaves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    /// Gain b of the target over the reference.
    pub(crate) gain: f64,
    /// Sum of r^2, in counts squared of the target.
    pub(crate) sum_of_squares: f64,
    /// Sum of r^2 f, f in counts of the reference.
    pub(crate) by_light: f64,
    /// What interpolation has in the sum of r^2, for a gain of 1.
    pub(crate) of_interpolation: Foreseen,
}

impl Residual {
    /// Gain of the scene that the target shows over the reference: the target, interpolated, has less contrast.
    pub(crate) fn gain_of_scene(&self) -> f64 {
        let [x, y] = self.of_interpolation.greys;
        self.gain / (x * y)
    }

    /// How the noise's variance grows with the light: share per count of the reference above its mean.
    fn growth(&self, subset: &PreparedSubset) -> f64 {
        let mean_square = self.sum_of_squares / subset.n_used as f64;
        if mean_square > 0.0 { self.by_light / subset.signal_energy / mean_square } else { 0.0 }
    }
}

/// Standard uncertainty of the position in x and y, in pixels of the target.
pub(crate) fn sigma_px(subset: &PreparedSubset, warp: &Warp, residual: &Residual) -> [f64; 2] {
    let [signal, noise] = scales(subset, warp, residual);
    sigma_from(subset, warp, signal, noise, residual.growth(subset))
}

/// Share of the foreseen energy of interpolation by which it may be wrong: twice the scatter of it over subsets of 3 to 6 px
/// speckles.
const UNFORESEEN_ENERGY: f64 = 0.15;

/// The factors of the two parts of [`UnitCovariance`] in the covariance of a match's parameters.
pub(crate) fn scales(subset: &PreparedSubset, warp: &Warp, residual: &Residual) -> [f64; 2] {
    let interpolation_gain = mean_noise_gain(subset, warp);
    let from_reference = residual.gain.powi(2) / subset.n_averaged;
    let degrees_of_freedom = degrees_of_freedom(subset) as f64;
    let foreseen = &residual.of_interpolation;
    let gain = residual.gain_of_scene();
    let interpolation = gain.powi(2) * foreseen.energy;
    let share = interpolation_gain + from_reference * (1.0 - foreseen.noise_share);
    // Where interpolation has most of the residual, that tells little of the noise: then it is the reference's, unless more is
    // left, or less, than interpolation explains.
    let of_reference = subset.noise_variance * subset.n_averaged * share * degrees_of_freedom;
    let excess = residual.sum_of_squares - interpolation - of_reference;
    let unclear = UNFORESEEN_ENERGY * interpolation.abs();
    let noise = (of_reference + excess - excess.clamp(-unclear, unclear)).max(of_reference.min(unclear));
    let variance = (noise / degrees_of_freedom / share).max(subset.rounding_of_one());
    let scale = variance / gain.powi(2);
    let [x, y] = foreseen.gradients();
    let of_target = warp.area().recip().max(interpolation_gain);
    [scale * (of_target + gain.powi(2) / subset.n_averaged), scale * interpolation_gain / (x * y)]
}

/// Pixels less the numbers that a match fits, with gain and offset of the light.
pub(crate) fn degrees_of_freedom(subset: &PreparedSubset) -> usize {
    subset.n_used.saturating_sub(subset.settings.shape.n_parameters() + 2).max(1)
}

/// Standard uncertainty of the position in the reference frame itself. There the position is given and the residual
/// zero; what is uncertain is which point of the body the noisy reference stands for.
pub(crate) fn reference_sigma_px(subset: &PreparedSubset) -> [f64; 2] {
    sigma_from(subset, &Warp::at(subset.centre_px), subset.noise_variance, 0.0, 0.0)
}

/// As [`sigma_px`], without the share of the noise in the gradients that this crate's own matches have.
pub(crate) fn signal_sigma_px(subset: &PreparedSubset, warp: &Warp, residual: &Residual) -> [f64; 2] {
    let [signal, _] = scales(subset, warp, residual);
    sigma_from(subset, warp, signal, 0.0, residual.growth(subset))
}

/// What [`signal_sigma_px`] is expected to be for a frame like the reference, with noise of a `variance` in the reference.
pub(crate) fn expected_sigma_px(subset: &PreparedSubset, variance: f64) -> [f64; 2] {
    sigma_from(subset, &Warp::at(subset.centre_px), variance * (1.0 + subset.n_averaged), 0.0, 0.0)
}

/// The angle by which a match turns the subset, in radians from x towards y; `None` for a shape function that only shifts.
///
/// What makes the centre uncertain by `sigma_px` makes the angle uncertain through the same normal equations, so its sigma is theirs, by the
/// ratio of the angle's variance to the centre's that the subset's texture has.
pub(crate) fn angle_rad(subset: &PreparedSubset, warp: &Warp, sigma_px: [f64; 2]) -> Option<Estimate> {
    if subset.settings.shape.n_terms() < 3 {
        return None;
    }
    let covariance = subset.covariance.of_gradient();
    let factors = warp.turn_of_step();
    let terms = || (0..4).zip(factors);
    let of_angle: f64 = terms().flat_map(|(p, a)| terms().map(move |(q, b)| a * b * covariance[p][q])).sum();
    let [x, y] = sigma_from(subset, warp, 1.0, 0.0, 0.0);
    let sigma_rad = of_angle.max(0.0).sqrt() * sigma_px[0].hypot(sigma_px[1]) / x.hypot(y);
    Some(Estimate::new(warp.angle_rad(), sigma_rad))
}

fn sigma_from(subset: &PreparedSubset, warp: &Warp, signal: f64, noise: f64, growth: f64) -> [f64; 2] {
    let [of_signal, of_noise] = subset.covariance.of_centre();
    let own = [0, 1, 2].map(|i| {
        let unequal = growth * subset.light_moments[i];
        // no less than a quarter, whatever a few pixels say
        let of_light = if i == 1 { unequal } else { unequal.max(-0.75 * of_signal[i]) };
        signal * (of_signal[i] + of_light) + noise * of_noise[i]
    });
    warp.variances_in_target(own).map(f64::sqrt)
}

/// G over the subset, whose phases differ where it is deformed: the mean over a grid of 4 x 4 places.
fn mean_noise_gain(subset: &PreparedSubset, warp: &Warp) -> f64 {
    const N: usize = 4;
    let place = |i: usize, first: f64, n: usize| first + ((i as f64 + 0.5) / N as f64 * n as f64).floor();
    let gain = subset.settings.interpolation.noise_gain();
    if warp.is_translation() {
        let [x, y] = warp.apply(subset.first_px);
        return gain.at(x) * gain.at(y);
    }
    let mut sum = 0.0;
    let columns: [f64; N] = std::array::from_fn(|i| place(i, subset.first_px[0], subset.width));
    let rows: [f64; N] = std::array::from_fn(|i| place(i, subset.first_px[1], subset.height));
    // Not for vectors, but for their instruction that rounds down.
    chainwave_vectors::dispatch_loop(
        #[inline(always)]
        || {
            sum = 0.0;
            for i in 0..N * N {
                let [x, y] = warp.apply([columns[i % N], rows[i / N]]);
                sum += gain.at(x) * gain.at(y);
            }
        },
    );
    sum / (N * N) as f64
}
