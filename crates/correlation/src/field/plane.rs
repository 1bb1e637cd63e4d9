//! The plane through neighbouring displacements of a field: its points, the weights of its slopes, and their covariance.

use std::num::NonZero;

use chainwave_measurement::map_in_parallel;

use super::overlap::NoiseCorrelations;
use crate::{Field, Shape};

/// A point's offset from the centre, its displacement, and the variances of that.
pub(super) struct Sample {
    pub(super) offset_px: [f64; 2],
    /// Column and row of the field.
    place: [usize; 2],
    pub(super) u_px: [f64; 2],
    sigma_px: [f64; 2],
    /// 1 for the quadratic shape function.
    n_quadratic: usize,
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
            place: [i % field.n_columns, i / field.n_columns],
            n_quadratic: usize::from(point.shape == Shape::Quadratic),
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

/// Covariance of the slopes of one component of the displacement along x and y.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SlopeCovariance {
    pub(super) xx: f64,
    pub(super) xy: f64,
    pub(super) yy: f64,
}

impl SlopeCovariance {
    /// The variance of the slope along an axis.
    pub(super) fn along(&self, axis: usize) -> f64 {
        if axis == 0 { self.xx } else { self.yy }
    }

    /// Adds what two samples share that weigh so much; each counts with the other once more unless they are one.
    fn add(&mut self, shared: f64, [a, b]: [[f64; 2]; 2], is_one: bool) {
        let times = if is_one { 1.0 } else { 2.0 };
        self.xx += times * shared * a[0] * b[0];
        self.yy += times * shared * a[1] * b[1];
        self.xy += 0.5 * times * shared * (a[0] * b[1] + a[1] * b[0]);
    }
}

/// Covariance of the slopes of u and of v.
pub(super) fn covariances(
    correlations: &NoiseCorrelations,
    samples: &[Sample],
    weights: &[[f64; 2]],
) -> [SlopeCovariance; 2] {
    let mut covariances = [SlopeCovariance::default(); 2];
    for (i, (first, of_first)) in samples.iter().zip(weights).enumerate() {
        for (j, (second, of_second)) in samples.iter().zip(weights).enumerate().take(i + 1) {
            let steps = [0, 1].map(|axis| first.place[axis].abs_diff(second.place[axis]));
            let correlation = correlations.between(steps, first.n_quadratic + second.n_quadratic);
            for (component, covariance) in covariances.iter_mut().enumerate() {
                let shared = correlation * first.sigma_px[component] * second.sigma_px[component];
                covariance.add(shared, [*of_first, *of_second], i == j);
            }
        }
    }
    covariances
}

/// What is worked out for each point of a field, row by row, on so many threads.
pub(super) fn in_rows<T: Send + Sync>(
    field: &Field,
    n_threads: NonZero<usize>,
    of_point: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let n_columns = field.n_columns.max(1);
    let of_row = |row: usize| -> Vec<T> { (row * n_columns..(row + 1) * n_columns).map(&of_point).collect() };
    map_in_parallel(field.points.len() / n_columns, n_threads, of_row).into_iter().flatten().collect()
}
