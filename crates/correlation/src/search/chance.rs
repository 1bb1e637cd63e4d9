//! How well a texture resembles another one by chance.

use crate::PreparedSubset;
use crate::simd::dot;

/// Share of searches in which something unrelated may resemble a subset by more than the level of chance.
pub(crate) const RARE: f64 = 2e-8;

/// The correlation that a subset reaches with something unrelated in a share `p` of cases, at the best of `n_trials` places and
/// deformations.
///
/// Of n independent pairs, P regressors of the one explain more than a share r^2 of the other with a probability of about
/// `(1 - r^2)^((n - 2 - P)/2)` (R. A. Fisher's distribution of the correlation, 1915, whose tail is exactly so for n = 4 and P = 0): the
/// parameters of the shape function count as regressors, for the match goes where they resemble most.
pub(crate) fn chance_zncc(subset: &PreparedSubset, n_trials: f64, p: f64) -> f64 {
    chance_zncc_by(subset.settings.shape.n_parameters(), subset, n_trials, p)
}

/// The same of a match of which so many parameters were chosen, and the others came out as was expected.
pub(crate) fn chance_zncc_by(n_parameters: usize, subset: &PreparedSubset, n_trials: f64, p: f64) -> f64 {
    chance_zncc_over(1.0, n_parameters, subset, n_trials, p)
}

/// The same of a match on a smaller part of the target than the subset has of the reference, by the share of that: as many fewer speckles were
/// compared.
pub(crate) fn chance_zncc_over(
    share: f64,
    n_parameters: usize,
    subset: &PreparedSubset,
    n_trials: f64,
    p: f64,
) -> f64 {
    let n_compared = share * n_independent(subset);
    let degrees_of_freedom = (n_compared - 2.0 - n_parameters as f64).max(1.0);
    let unexplained = (p / n_trials.max(1.0)).powf(2.0 / degrees_of_freedom);
    (1.0 - unexplained).max(0.0).sqrt()
}

/// The ways to leave out as many of a subset's speckles as a match did that has this share of its pixels: something else resembles it best in one of them.
pub(crate) fn ways_to_leave_out(subset: &PreparedSubset, share_seen: f64) -> f64 {
    let entropy = |share: f64| if share > 0.0 { -share * share.ln() } else { 0.0 };
    (n_independent(subset) * (entropy(share_seen) + entropy(1.0 - share_seen))).exp()
}

/// The correlation that noise leaves of a subset with what it shows itself: of a reference of m frames, and a frame with m times its variance.
pub(crate) fn expected_zncc(subset: &PreparedSubset) -> f64 {
    let contrast = subset.signal_energy / subset.n_used as f64;
    let left = |variance: f64| contrast / (contrast + variance);
    let noise = subset.noise_variance;
    (left(noise) * left(noise * subset.n_averaged)).sqrt()
}

/// Standard errors by which what noise leaves of a correlation has to exceed chance, so that a search is not in vain.
const DETECTION_SIGMAS: f64 = 3.0;

/// Whether noise leaves enough of a subset that a search among so many places and deformations can tell it from chance.
pub(crate) fn is_told(subset: &PreparedSubset, n_trials: f64) -> bool {
    is_told_by(fisher(expected_zncc(subset)), subset, n_trials)
}

/// Whether a search among so many places and deformations can tell a subset from chance that resembles the target by so much, after
/// Fisher's transform, give or take its scatter.
pub(crate) fn is_told_by(correlation: f64, subset: &PreparedSubset, n_trials: f64) -> bool {
    let scatter = (n_independent(subset) - 3.0).max(1.0).sqrt().recip();
    correlation >= fisher(chance_zncc(subset, n_trials, RARE)) + DETECTION_SIGMAS * scatter
}

/// Speckles of a subset that are independent of each other.
///
/// With the autocorrelation of a Gaussian speckle, exp(-(k_x x^2 + k_y y^2)/2), k = mean f_x^2 / mean f^2, a pixel counts
/// sqrt(k_x k_y)/pi.
pub(crate) fn n_speckles(subset: &PreparedSubset) -> f64 {
    let [k_x, k_y] = [&subset.gradient_x, &subset.gradient_y].map(|g| dot(g, g) / subset.energy);
    subset.n_used as f64 * (k_x * k_y).sqrt() / std::f64::consts::PI
}

/// The share of a subset's speckles that have most of the contrast: it falls as the kurtosis of the grey values exceeds that of normal ones.
/// A subset with a lone spot has room for many, and shows one.
pub(crate) fn share_told(subset: &PreparedSubset) -> f64 {
    let squares: Vec<f32> = subset.intensity.iter().map(|value| value * value).collect();
    let kurtosis = subset.n_used as f64 * dot(&squares, &squares) / subset.energy.powi(2);
    (3.0 / kurtosis).min(1.0)
}

/// Independent pairs of grey values of a subset and something unrelated with such a texture and noise.
///
/// The variance of their correlation is the sum of the products of both autocorrelations over all shifts, over the number of pixels
/// (M. S. Bartlett, J. R. Stat. Soc. B 8 (1946) 27-41): pixels share their speckle, but not their noise.
pub(crate) fn n_independent(subset: &PreparedSubset) -> f64 {
    let n = subset.n_used as f64;
    let [k_x, k_y] = [&subset.gradient_x, &subset.gradient_y].map(|g| dot(g, g) / subset.signal_energy);
    let speckle_px = (std::f64::consts::PI / (k_x * k_y).sqrt()).max(1.0);
    let contrast = subset.signal_energy / n;
    let in_frame = contrast / (contrast + subset.noise_variance * subset.n_averaged);
    let in_reference = (subset.signal_energy / subset.energy).min(1.0);
    n / (1.0 + in_frame * in_reference * (speckle_px - 1.0))
}

/// Shifts within which a subset resembles itself: twice the width of its autocorrelation at half its height.
pub(crate) fn correlation_length_px(subset: &PreparedSubset) -> f64 {
    let area_px = subset.n_used() as f64 / n_speckles(subset).max(1.0);
    (2.0 * area_px.sqrt()).clamp(3.0, subset.half_px()[0].max(3.0))
}

/// Fisher's transform of a correlation.
pub(crate) fn fisher(zncc: f64) -> f64 {
    zncc.clamp(-0.999_999, 0.999_999).atanh()
}
