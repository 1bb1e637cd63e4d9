//! Whether a subset shows the point that it stands for, and whether anything is to be seen there.

use crate::PreparedSubset;

/// Least share of the middle of a subset, half as wide and high, that has to be usable.
const LEAST_MIDDLE: f64 = 0.5;

/// Whether a subset shows the point that it stands for: ground beside a texture moves with nothing that its subset shows.
pub(crate) fn shows_its_middle(subset: &PreparedSubset) -> bool {
    subset.share_used_in_middle() >= LEAST_MIDDLE
}

/// Variance of the pixels in its middle over that of their noise up to which a subset shows bare ground there: the noise's own is known to a
/// tenth or so.
const FLAT_RATIO: f64 = 1.5;

/// Whether the middle of a subset is bare: not used, or without anything that noise does not explain.
pub(crate) fn is_bare_in_middle(subset: &PreparedSubset) -> bool {
    let middle = |n: usize| n / 4..n - n / 4;
    let (mut n, mut sum, mut square) = (0.0, 0.0, 0.0);
    for row in middle(subset.height) {
        for column in middle(subset.width) {
            let i = row * subset.width + column;
            let (weight, value) = (f64::from(subset.weights[i]), f64::from(subset.intensity[i]));
            (n, sum, square) = (n + weight, sum + weight * value, square + weight * value * value);
        }
    }
    let variance = (square - sum * sum / n) / n;
    !shows_its_middle(subset) || variance <= FLAT_RATIO * subset.noise_variance
}
