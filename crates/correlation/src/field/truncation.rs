//! What the plane of a strain leaves of a displacement that bends.
//!
//! A plane's slope over a window is a weighted mean of the gradients within it: of a wave as long as two windows it misses a fifth. What it
//! misses of a polynomial follows from its weights, and the polynomial is told by the points around: of third order over a window half
//! again as wide, which has little noise (that of a third derivative falls with the eighth power of the window's width), and over the
//! window itself, which follows shorter waves and counts where it stands clear of its noise. Each is squared, less the variance
//! of its noise, and meant over the points near; the larger counts as a variance of the slope. Nothing is taken off: a strain stays that
//! of its plane. (The truncation of a local fit: B. Pan et al., Opt. Lasers Eng. 45 (2007) 645-650; F. Sur, B. Blaysat, M. Grediac,
//! Exp. Mech. 58 (2018) 1029-1043.)

use nalgebra::{DMatrix, DVector};

use crate::Field;
use crate::field::shape_error::bend::largest_mean;
use crate::field::shape_error::grid::Grid;
use crate::field::strain::{Sample, covariance, samples_around, slope_weights};

/// Variance of a gradient du/dx, du/dy, dv/dx, dv/dy by what the plane leaves, row by row.
pub(super) type Truncation = [[f64; 2]; 2];

/// Monomials of second and third order, after those that a plane follows.
const BEYOND: [[i32; 2]; 7] = [[2, 0], [1, 1], [0, 2], [3, 0], [2, 1], [1, 2], [0, 3]];
const PLANE: [[i32; 2]; 3] = [[0, 0], [1, 0], [0, 1]];
/// Points from which on ten coefficients are told: half as many more.
const LEAST_POINTS: usize = 15;

/// The truncation of the plane at each point of a field.
pub(super) fn truncations(field: &Field, reach: usize) -> Vec<Truncation> {
    let stride = (field.half_px / field.step_px.max(1)).clamp(1, reach.max(1));
    let wide = (3 * reach).div_ceil(2).max(2).next_multiple_of(stride);
    let found: Vec<[Option<Missed>; 2]> = (0..field.points.len())
        .map(|point| {
            let plane = samples_around(field, point, reach, 1);
            let Some(slopes) = slope_weights(&plane) else { return [None; 2] };
            let by = |samples: &[Sample]| missed(field, &plane, &slopes, samples);
            [by(&samples_around(field, point, wide, stride)), by(&plane)]
        })
        .collect();
    let n_columns = field.n_columns;
    let grid = Grid { n_columns, n_rows: found.len() / n_columns, step_px: field.step_px as f64 };
    let [by_wide, by_own] = [0, 1].map(|window| grid.sums(&terms(&found, window), 2 * reach));
    let window = ((2 * reach + 1) * (2 * reach + 1)) as f64;
    by_wide.into_iter().zip(by_own).map(|(wide, own)| larger(&wide, &own, window)).collect()
}

/// What a plane misses of the gradients, and the variance of its noise.
type Missed = [[[f64; 2]; 2]; 2];

/// What the plane with these weights of its slopes misses of a polynomial of third order through some samples.
fn missed(field: &Field, plane: &[Sample], slopes: &[[f64; 2]], samples: &[Sample]) -> Option<Missed> {
    if samples.len() < LEAST_POINTS {
        return None;
    }
    let unit_px =
        samples.iter().flat_map(|sample| sample.offset_px).fold(1.0_f64, |most, px| most.max(px.abs()));
    let value = |sample: &Sample, [i, j]: [i32; 2]| {
        let [x, y] = sample.offset_px.map(|offset| offset / unit_px);
        x.powi(i) * y.powi(j)
    };
    let n_terms = PLANE.len() + BEYOND.len();
    let design = DMatrix::from_fn(samples.len(), n_terms, |row, term| {
        value(&samples[row], PLANE.iter().chain(&BEYOND).copied().nth(term).unwrap_or_default())
    });
    let normal = design.tr_mul(&design).cholesky()?;
    // what the plane makes of each monomial that it does not follow
    let of_axes = [0, 1].map(|axis| {
        let made = |monomial| {
            plane.iter().zip(slopes).map(|(sample, weights)| weights[axis] * value(sample, monomial)).sum()
        };
        let sums = [0.0; 3].into_iter().chain(BEYOND.into_iter().map(made));
        &design * normal.solve(&DVector::from_iterator(n_terms, sums))
    });
    let weights: Vec<[f64; 2]> = (0..samples.len()).map(|k| [of_axes[0][k], of_axes[1][k]]).collect();
    Some([0, 1].map(|component| {
        [0, 1].map(|axis| {
            let terms = samples.iter().zip(&weights);
            let missed: f64 = terms.map(|(sample, weights)| weights[axis] * sample.u_px[component]).sum();
            [missed, covariance(field, samples, &weights, component, [axis, axis])]
        })
    }))
}

/// Of each gradient the square of what is missed less its noise, and that square over its noise; last, 1 where there are any.
fn terms(found: &[[Option<Missed>; 2]], window: usize) -> Vec<[f64; 9]> {
    let of_point = |of_windows: &[Option<Missed>; 2]| {
        let mut terms = [0.0; 9];
        let Some(missed) = of_windows[window] else { return terms };
        for (k, [missed, variance]) in missed.into_iter().flatten().enumerate() {
            terms[k] = missed * missed - variance;
            terms[4 + k] = if variance > 0.0 { missed * missed / variance } else { 0.0 };
        }
        terms[8] = 1.0;
        terms
    };
    found.iter().map(of_point).collect()
}

/// The larger of what the windows tell; what the plane's own does counts where all it missed stands clear of its noise.
fn larger(wide: &[f64; 9], own: &[f64; 9], window: f64) -> Truncation {
    let mean = |sums: &[f64; 9], k: usize| if sums[8] > 0.0 { (sums[k] / sums[8]).max(0.0) } else { 0.0 };
    let [of_u, of_v] = [0, 1].map(|component| {
        [0, 1].map(|axis| {
            let k = 2 * component + axis;
            let is_clear = mean(own, 4 + k) > largest_mean(own[8] / window);
            let by_own = if is_clear { mean(own, k) } else { 0.0 };
            mean(wide, k).max(by_own)
        })
    });
    [of_u, of_v]
}
