//! Strain of a field, by planes through neighbouring displacements.

use crate::Field;
use crate::field::truncation::{Truncation, truncations};
use chainwave_measurement::Estimate;

/// The Green-Lagrange strain of the reference's plane at one point, with rotation taken out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strain {
    /// Elongation along x.
    pub xx: Estimate,
    /// Elongation along y.
    pub yy: Estimate,
    /// Shear; half of the change of the right angle, where it is small.
    pub xy: Estimate,
}

/// The strain at every point of a field, from the plane through the displacements within `reach` points to each side
/// (least squares; B. Pan et al., Opt. Lasers Eng. 45 (2007) 645-650). `None` where fewer than half of these points were
/// found, or all in a line.
///
/// The points' errors come from pixels, so two points share as much of their error as their subsets overlap: that
/// share of area is taken for their correlation. What the plane leaves of a displacement that bends is part of the uncertainty
/// (`field/truncation.rs`): where it exceeds the noise, intervals are as wide as it is around the point.
pub fn strains(field: &Field, reach: usize) -> Vec<Option<Strain>> {
    let truncations = truncations(field, reach);
    truncations
        .iter()
        .enumerate()
        .map(|(point, truncation)| strain_at(field, point, reach, truncation))
        .collect()
}

/// A point's offset from the centre, its displacement, and the variances of that.
pub(super) struct Sample {
    pub(super) offset_px: [f64; 2],
    pub(super) u_px: [f64; 2],
    sigma_px: [f64; 2],
}

fn strain_at(field: &Field, point: usize, reach: usize, truncation: &Truncation) -> Option<Strain> {
    let samples = samples_around(field, point, reach, 1);
    let side = 2 * reach + 1;
    if samples.len() * 2 < side * side || samples.len() < 3 {
        return None;
    }
    let slopes = slope_weights(&samples)?;
    let gradient = |component: usize, axis: usize| -> f64 {
        samples.iter().zip(&slopes).map(|(sample, weights)| weights[axis] * sample.u_px[component]).sum()
    };
    let variance = |component: usize, a: usize, b: usize| {
        let of_plane = if a == b { truncation[component][a] } else { 0.0 };
        covariance(field, &samples, &slopes, component, [a, b]) + of_plane
    };
    let [ux, uy, vx, vy] = [gradient(0, 0), gradient(0, 1), gradient(1, 0), gradient(1, 1)];
    let along = |value: f64, [du, dv]: [f64; 2], axis: usize| {
        let sum = du * du * variance(0, axis, axis) + dv * dv * variance(1, axis, axis);
        Estimate::new(value, sum.max(0.0).sqrt())
    };
    // E = (F^T F - 1)/2, and the slopes of E by the displacement gradient.
    let shear = 0.5 * (uy + vx + ux * uy + vx * vy);
    let mixed = |component: usize, a: f64, b: f64| {
        a * a * variance(component, 0, 0)
            + b * b * variance(component, 1, 1)
            + 2.0 * a * b * variance(component, 0, 1)
    };
    let shear_variance = 0.25 * (mixed(0, uy, 1.0 + ux) + mixed(1, 1.0 + vy, vx));
    Some(Strain {
        xx: along(ux + 0.5 * (ux * ux + vx * vx), [1.0 + ux, vx], 0),
        yy: along(vy + 0.5 * (uy * uy + vy * vy), [uy, 1.0 + vy], 1),
        xy: Estimate::new(shear, shear_variance.max(0.0).sqrt()),
    })
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
    let overlap = |distance: f64| (1.0 - distance.abs() / side).max(0.0);
    let mut sum = 0.0;
    for (first, of_first) in samples.iter().zip(weights) {
        for (second, of_second) in samples.iter().zip(weights) {
            let [dx, dy] = [0, 1].map(|axis| first.offset_px[axis] - second.offset_px[axis]);
            let shared = overlap(dx) * overlap(dy) * first.sigma_px[component] * second.sigma_px[component];
            sum += of_first[a] * of_second[b] * shared;
        }
    }
    sum
}
