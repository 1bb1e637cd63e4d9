//! How far the errors of two points of a field go together: by the pixels that their subsets share.

use crate::Shape;

/// The correlation of the noise of two points' displacements whose subsets of this side are so far apart.
///
/// A displacement is a mean of what the pixels say with the weights of a Savitzky-Golay filter: equal ones, or those of a
/// polynomial of second order. The noise of two of them has in common what these weights have. With x over half a side, p(x)
/// = 1 - 3 x^2 and equal texture everywhere, the weights of the second order are `1 + 5/4 (p(x) + p(y))`.
pub(crate) fn noise_correlation(shapes: [Shape; 2], apart_px: [f64; 2], side_px: f64) -> f64 {
    let apart = apart_px.map(|distance| 2.0 * distance.abs() / side_px);
    if apart.iter().any(|&distance| distance >= 2.0) {
        return 0.0;
    }
    let [x, y] = apart.map(Shared::at);
    let n_curved = shapes.iter().filter(|&&shape| shape == Shape::Quadratic).count();
    let flat = x.flat * y.flat;
    let mixed = x.mixed * y.flat + x.flat * y.mixed;
    let curved = x.curved * y.flat + x.flat * y.curved + 2.0 * x.mixed * y.mixed;
    match n_curved {
        0 => flat / 4.0,
        1 => (flat + 1.25 * mixed) / (4.0_f64 * 14.0).sqrt(),
        _ => (flat + 2.5 * mixed + 1.5625 * curved) / 14.0,
    }
}

/// The correlations of the noise of points of a grid.
pub(crate) struct NoiseCorrelations {
    /// Steps along x and y that points are apart at most, and one.
    n_lags: usize,
    /// By steps along y, then along x, and by how many of the two shape functions are quadratic.
    by_lag: Vec<[f64; 3]>,
}

impl NoiseCorrelations {
    /// Those of points up to so many steps of this length apart, with subsets of so many pixels on each side.
    pub(crate) fn new(step_px: usize, half_px: usize, most_steps: usize) -> Self {
        let n_lags = most_steps + 1;
        let side_px = (2 * half_px + 1) as f64;
        let at = |lag: usize| {
            let apart_px = [lag % n_lags, lag / n_lags].map(|steps| (steps * step_px) as f64);
            [[Shape::Affine; 2], [Shape::Affine, Shape::Quadratic], [Shape::Quadratic; 2]]
                .map(|shapes| noise_correlation(shapes, apart_px, side_px))
        };
        Self { n_lags, by_lag: (0..n_lags * n_lags).map(at).collect() }
    }

    /// That of two points so many steps apart.
    pub(crate) fn between(&self, [columns, rows]: [usize; 2], n_quadratic: usize) -> f64 {
        self.by_lag[rows * self.n_lags + columns][n_quadratic]
    }
}

/// Integrals over what two intervals of half length 1 share.
struct Shared {
    /// Of 1.
    flat: f64,
    /// Of p about the centre of one of them.
    mixed: f64,
    /// Of the product of both p.
    curved: f64,
}

impl Shared {
    fn at(apart: f64) -> Self {
        let (to_middle, half) = (0.5 * apart, 1.0 - 0.5 * apart);
        let (e2, a2) = (to_middle * to_middle, half * half);
        let c = 1.0 - 3.0 * e2;
        let inside = 1.0 - apart;
        Self {
            flat: 2.0 * half,
            mixed: inside - inside.powi(3),
            curved: 2.0 * half * (c * c - 2.0 * c * a2 + 1.8 * a2 * a2 - 12.0 * e2 * a2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_displacement_is_its_own_and_a_sum_over_pixels_agrees() {
        let side = 200;
        let weights = |shape: Shape| -> Vec<f64> {
            let place = |i: usize| 2.0 * (i as f64 + 0.5) / side as f64 - 1.0;
            let p = |i: usize| 1.0 - 3.0 * place(i).powi(2);
            let curved = if shape == Shape::Quadratic { 1.25 } else { 0.0 };
            (0..side * side).map(|k| 1.0 + curved * (p(k % side) + p(k / side))).collect()
        };
        for shapes in [
            [Shape::Affine, Shape::Affine],
            [Shape::Affine, Shape::Quadratic],
            [Shape::Quadratic, Shape::Quadratic],
        ] {
            let [a, b] = shapes.map(weights);
            let norm = |w: &[f64]| w.iter().map(|w| w * w).sum::<f64>().sqrt();
            for [dx, dy] in [[0, 0], [37, 0], [0, 80], [120, 30], [199, 199]] {
                let mut sum = 0.0;
                for (row, column) in
                    (0..side - dy).flat_map(|row| (0..side - dx).map(move |column| (row, column)))
                {
                    sum += a[(row + dy) * side + column + dx] * b[row * side + column];
                }
                let found = noise_correlation(shapes, [dx as f64, dy as f64], side as f64);
                let expected = sum / norm(&a) / norm(&b);
                // the sum over pixels in place of the integral errs by the square of a pixel over the side
                assert!((found - expected).abs() < 2e-3, "{shapes:?} {dx} {dy}: {found} {expected}");
            }
        }
    }
}
