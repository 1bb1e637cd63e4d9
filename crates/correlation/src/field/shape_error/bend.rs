//! Where a field does what its shape function cannot follow, by a test of differences between neighbouring points.
//!
//! Of points about half a subset apart second differences are taken along x, along y, and along both; where the shape
//! function does not even follow a gradient, first ones. Squared over the variance that the points' sigmas give them (they share
//! pixels: [`crate::field::overlap`]) they have a mean of 1 where there is nothing but noise. Their mean over a square of
//! two and a half subsets is tested with as many degrees of freedom as quarters of a subset lie in the square.

use crate::Shape;
use crate::field::overlap::noise_correlation;
use crate::field::shape_error::grid::{Grid, Reading};

/// Normal quantile of the level: 1 % of the squares of a field that does not bend are taken for bent.
const LEVEL_QUANTILE: f64 = 2.326;

/// Columns and rows and their factors.
type Difference = [([i64; 2], f64)];

const SECOND: [&Difference; 3] = [
    &[([-1, 0], 1.0), ([0, 0], -2.0), ([1, 0], 1.0)],
    &[([0, -1], 1.0), ([0, 0], -2.0), ([0, 1], 1.0)],
    &[([-1, -1], 1.0), ([1, -1], -1.0), ([-1, 1], -1.0), ([1, 1], 1.0)],
];
const FIRST: [&Difference; 2] = [&[([-1, 0], -1.0), ([1, 0], 1.0)], &[([0, -1], -1.0), ([0, 1], 1.0)]];

/// Whether the field bends around each point; points half a subset apart are `apart` columns from each other.
pub(super) fn where_it_bends(
    grid: Grid,
    readings: &[Option<Reading>],
    apart: usize,
    side_px: f64,
) -> Vec<bool> {
    let mut squares = vec![[0.0; 3]; readings.len()];
    for (point, squares) in squares.iter_mut().enumerate() {
        let Some(reading) = &readings[point] else { continue };
        let follows_gradients = matches!(reading.shape, Shape::Affine | Shape::Quadratic);
        let first = FIRST.iter().filter(|_| !follows_gradients);
        let mut sum = [0.0; 2];
        let mut n = 0.0;
        for difference in SECOND.iter().chain(first) {
            let Some(found) = squared(grid, readings, point, difference, apart, side_px) else { continue };
            (0..2).for_each(|axis| sum[axis] += found[axis]);
            n += 1.0;
        }
        if n > 0.0 {
            *squares = [sum[0] / n, sum[1] / n, 1.0];
        }
    }
    let quarter = (grid.step_px / (0.5 * side_px)).powi(2).min(1.0);
    let bends = |[u, v, n]: [f64; 3]| n > 0.0 && u.max(v) / n > largest_mean(n * quarter);
    grid.sums(&squares, 2 * apart).into_iter().map(bends).collect()
}

/// The square of a difference of neighbours, over its variance, along x and y.
fn squared(
    grid: Grid,
    readings: &[Option<Reading>],
    point: usize,
    difference: &Difference,
    apart: usize,
    side_px: f64,
) -> Option<[f64; 2]> {
    let mut terms: Vec<([f64; 2], f64, &Reading)> = Vec::with_capacity(difference.len());
    for &(offset, factor) in difference {
        let there = grid.at(point, offset.map(|offset| offset * apart as i64))?;
        let spacing = apart as f64 * grid.step_px;
        terms.push((offset.map(|offset| offset as f64 * spacing), factor, readings[there].as_ref()?));
    }
    let own = readings[point].as_ref()?;
    Some([0, 1].map(|axis| {
        let (mut value, mut variance, mut turning) = (0.0, 0.0, 0.0);
        for (place, factor, reading) in &terms {
            value += factor * (reading.u_px[axis] - own.turned_px(*place)[axis]);
            turning += factor * own.turning_px(*place)[axis];
            for (other_place, other_factor, other) in &terms {
                let between = [place[0] - other_place[0], place[1] - other_place[1]];
                let shared = noise_correlation([reading.shape, other.shape], between, side_px);
                variance += factor * other_factor * shared * reading.sigma_px[axis] * other.sigma_px[axis];
            }
        }
        value * value / (variance + turning * turning * own.variance_of_turn(side_px))
    }))
}

/// What the mean of n squares of normal numbers exceeds in 1 % of cases (E. B. Wilson, M. M. Hilferty, Proc. Natl. Acad. Sci.
/// 17 (1931) 684-688).
pub(in crate::field) fn largest_mean(n: f64) -> f64 {
    let spread = 2.0 / (9.0 * n.max(1.0));
    (1.0 - spread + LEVEL_QUANTILE * spread.sqrt()).powi(3)
}
