//! The plane through neighbouring displacements of a field: its points, the weights of its slopes, and their covariance.

use super::overlap::noise_correlation;
use crate::{Field, Shape};

/// A point's offset from the centre, its displacement, and the variances of that.
pub(super) struct Sample {
    pub(super) offset_px: [f64; 2],
    pub(super) u_px: [f64; 2],
    sigma_px: [f64; 2],
    shape: Shape,
}

/// Every `stride`th point up to `reach` columns and rows away that was found.
pub(super) fn samples_around(field: &Field, point: usize, reach: usize, stride: usize) -> Vec<Sample> {
    let (column, row) = (point % field.n_columns, point / field.n_columns);
    let n_rows = field.points.len() / field.n_columns;
    let line = |own: usize, n: usize| {
        let first = own - own.min(reach) / stride * stride;
        (first..(own + reach + 1).min(n)).step_by(stride)
    };
    let (columns, rows) = (line(column, field.n_columns), line(row, n_rows));
    let centre = &field.points[point];
    let sample = |i: usize| {
        let point = &field.points[i];
        let position = point.found.as_ref().ok()?.position;
        Some(Sample {
            shape: point.shape,
            offset_px: [point.x_px - centre.x_px, point.y_px - centre.y_px],
            u_px: [position.x_px.value - point.x_px, position.y_px.value - point.y_px],
            sigma_px: [position.x_px.sigma, position.y_px.sigma],
        })
    };
    rows.flat_map(|row| columns.clone().map(move |column| row * field.n_columns + column))
        .filter_map(sample)
        .collect()
}

/// How much each sample adds to the slope of the plane along x and y.
pub(super) fn slope_weights(samples: &[Sample]) -> Option<Vec<[f64; 2]>> {
    let n = samples.len() as f64;
    let mean = [0, 1].map(|axis| samples.iter().map(|sample| sample.offset_px[axis]).sum::<f64>() / n);
    let from_mean = |sample: &Sample| [sample.offset_px[0] - mean[0], sample.offset_px[1] - mean[1]];
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for [x, y] in samples.iter().map(from_mean) {
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    let determinant = xx * yy - xy * xy;
    let weights = |[x, y]: [f64; 2]| [(yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant];
    (determinant > 1e-9 * (xx + yy).powi(2)).then(|| samples.iter().map(from_mean).map(weights).collect())
}

/// Covariance of the slopes of one component of the displacement along two axes.
pub(super) fn covariance(
    field: &Field,
    samples: &[Sample],
    weights: &[[f64; 2]],
    component: usize,
    [a, b]: [usize; 2],
) -> f64 {
    let side = (2 * field.half_px + 1) as f64;
    let mut sum = 0.0;
    for (first, of_first) in samples.iter().zip(weights) {
        for (second, of_second) in samples.iter().zip(weights) {
            let [dx, dy] = [0, 1].map(|axis| first.offset_px[axis] - second.offset_px[axis]);
            let correlation = noise_correlation([first.shape, second.shape], [dx, dy], side);
            let shared = correlation * first.sigma_px[component] * second.sigma_px[component];
            sum += of_first[a] * of_second[b] * shared;
        }
    }
    sum
}
