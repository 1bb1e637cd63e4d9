//! What the plane of a strain leaves of a displacement that bends.
//!
//! A plane's slope over a window is a weighted mean of the gradients within it: of a wave as long as two windows it misses a fifth. What it
//! misses of a polynomial follows from its weights, and the polynomial is told by the points around: of third order over a window half
//! again as wide, which has little noise (that of a third derivative falls with the eighth power of the window's width), and over the
//! window itself, which follows shorter waves and counts where it stands clear of its noise. Each is squared, less the variance
//! of its noise, and meant over the points near; the larger counts as a variance of the slope. Nothing is taken off: a strain stays that
//! of its plane. (The truncation of a local fit: B. Pan et al., Opt. Lasers Eng. 45 (2007) 645-650; F. Sur, B. Blaysat, M. Grediac,
//! Exp. Mech. 58 (2018) 1029-1043.)

use std::num::NonZero;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use crate::Field;
use crate::field::overlap::NoiseCorrelations;
use crate::field::plane::{Sample, covariances, in_rows, samples_around, slope_weights};
use crate::field::shape_error::bend::largest_mean;
use crate::field::shape_error::grid::Grid;

/// Variance of a gradient du/dx, du/dy, dv/dx, dv/dy by what the plane leaves, row by row.
pub(super) type Truncation = [[f64; 2]; 2];

/// Monomials of second and third order, after those that a plane follows.
const BEYOND: [[i32; 2]; 7] = [[2, 0], [1, 1], [0, 2], [3, 0], [2, 1], [1, 2], [0, 3]];
const PLANE: [[i32; 2]; 3] = [[0, 0], [1, 0], [0, 1]];
/// Points from which on ten coefficients are told: half as many more.
const LEAST_POINTS: usize = 15;

/// Square of a normal number that one in a thousand exceeds.
const CLEAR: f64 = 10.8;

/// The truncation of the plane at each point of a field.
pub(super) fn truncations(field: &Field, reach: usize, n_threads: NonZero<usize>) -> Vec<Truncation> {
    let stride = (field.half_px / field.step_px.max(1)).clamp(1, reach.max(1));
    let wide = (3 * reach).div_ceil(2).max(2).next_multiple_of(stride);
    let (own_side, wide_side) = (2 * reach + 1, 2 * wide / stride + 1);
    let correlations = NoiseCorrelations::new(field.step_px, field.half_px, 2 * wide.max(reach));
    // Where all points of both windows were found the weights are the same.
    let of_whole = [const { OnceLock::new() }; 2];
    let found = in_rows(field, n_threads, |point| {
        let plane = samples_around(field, point, reach, 1);
        let Some(slopes) = slope_weights(&plane) else { return [None; 2] };
        let is_whole = |samples: &[Sample], side: usize| samples.len() == side * side;
        // Beside what was lost, or in a corner, a cubic would reach far beyond what tells it.
        let by = |samples: &[Sample], side: usize, of_whole: &OnceLock<Option<Vec<[f64; 2]>>>| {
            let weights = || missed_weights(&plane, &slopes, samples);
            if is_whole(&plane, own_side) && is_whole(samples, side) {
                return Some(missed(&correlations, samples, of_whole.get_or_init(weights).as_ref()?));
            }
            let is_enough = 2 * samples.len() >= side * side;
            is_enough.then(|| Some(missed(&correlations, samples, &weights()?)))?
        };
        let around = samples_around(field, point, wide, stride);
        [by(&around, wide_side, &of_whole[0]), by(&plane, own_side, &of_whole[1])]
    });
    let n_columns = field.n_columns;
    let grid = Grid { n_columns, n_rows: found.len() / n_columns, step_px: field.step_px as f64 };
    let window = ((2 * reach + 1) * (2 * reach + 1)) as f64;
    let mut truncations = vec![[[0.0; 2]; 2]; found.len()];
    for (component, axis) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let of_gradient = |missed: &Option<Missed>| missed.map(|missed| missed[component][axis]);
        let [wide, own] = [0, 1].map(|which| {
            let terms: Vec<Sums> = found.iter().map(|missed| terms(of_gradient(&missed[which]))).collect();
            grid.sums(&terms, 2 * reach)
        });
        for (point, truncation) in truncations.iter_mut().enumerate() {
            let here = of_gradient(&found[point][0]);
            truncation[component][axis] = larger(&wide[point], &own[point], here, window);
        }
    }
    truncations
}

/// What a plane misses of the gradients, and the variance of its noise.
type Missed = [[[f64; 2]; 2]; 2];

/// How much each sample adds to what the plane with these weights of its slopes misses of a polynomial of third order through the samples.
fn missed_weights(plane: &[Sample], slopes: &[[f64; 2]], samples: &[Sample]) -> Option<Vec<[f64; 2]>> {
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
    Some((0..samples.len()).map(|k| [of_axes[0][k], of_axes[1][k]]).collect())
}

/// What a plane misses of a polynomial through some samples, by how much each adds to that.
fn missed(correlations: &NoiseCorrelations, samples: &[Sample], weights: &[[f64; 2]]) -> Missed {
    let of_noise = covariances(correlations, samples, weights);
    [0, 1].map(|component| {
        [0, 1].map(|axis| {
            let terms = samples.iter().zip(weights);
            let missed: f64 = terms.map(|(sample, weights)| weights[axis] * sample.u_px[component]).sum();
            [missed, of_noise[component].along(axis)]
        })
    })
}

/// Sums over points of one gradient: the square of what is missed less its noise and the weight of that, the square over its noise, and 1.
/// Weights fall with the square of the noise, as they should for such squares: at an edge a cubic may have a hundred times as much.
type Sums = [f64; 4];

fn terms(missed: Option<[f64; 2]>) -> Sums {
    let Some([missed, variance]) = missed.filter(|[_, variance]| *variance > 0.0) else { return [0.0; 4] };
    let weight = variance.powi(-2);
    [weight * (missed * missed - variance), weight, missed * missed / variance, 1.0]
}

/// The larger of what the windows tell around a point, and of what the wide one tells there alone where that is clear; what the
/// plane's own does counts where all it missed stands clear of its noise.
fn larger(wide: &Sums, own: &Sums, here: Option<[f64; 2]>, window: f64) -> f64 {
    let mean = |[sum, weights, ..]: &Sums| if *weights > 0.0 { (sum / weights).max(0.0) } else { 0.0 };
    let [.., ratios, n] = *own;
    let is_clear = n > 0.0 && ratios / n > largest_mean(n / window);
    let by_own = if is_clear { mean(own) } else { 0.0 };
    let clear = |[missed, variance]: &[f64; 2]| missed * missed > CLEAR * variance;
    let by_itself = here.filter(clear).map_or(0.0, |[missed, variance]| missed * missed - variance);
    mean(wide).max(by_own).max(by_itself)
}
