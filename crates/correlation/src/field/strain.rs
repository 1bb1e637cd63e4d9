//! Strain of a field, by planes through neighbouring displacements.

use std::num::NonZero;

use chainwave_measurement::Estimate;

use crate::Field;
use crate::field::overlap::NoiseCorrelations;
use crate::field::plane::{covariances, in_rows, samples_around, slope_weights};
use crate::field::truncation::{Truncation, truncations};

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
pub fn strains(field: &Field, reach: usize, n_threads: NonZero<usize>) -> Vec<Option<Strain>> {
    let truncations = truncations(field, reach, n_threads);
    let correlations = NoiseCorrelations::new(field.step_px, field.half_px, 2 * reach);
    in_rows(field, n_threads, |point| strain_at(field, &correlations, point, reach, &truncations[point]))
}

fn strain_at(
    field: &Field,
    correlations: &NoiseCorrelations,
    point: usize,
    reach: usize,
    truncation: &Truncation,
) -> Option<Strain> {
    let samples = samples_around(field, point, reach, 1);
    let side = 2 * reach + 1;
    if samples.len() * 2 < side * side || samples.len() < 3 {
        return None;
    }
    let slopes = slope_weights(&samples)?;
    let gradient = |component: usize, axis: usize| -> f64 {
        samples.iter().zip(&slopes).map(|(sample, weights)| weights[axis] * sample.u_px[component]).sum()
    };
    let of_noise = covariances(correlations, &samples, &slopes);
    let variance =
        |component: usize, axis: usize| of_noise[component].along(axis) + truncation[component][axis];
    let [ux, uy, vx, vy] = [gradient(0, 0), gradient(0, 1), gradient(1, 0), gradient(1, 1)];
    let along = |value: f64, [du, dv]: [f64; 2], axis: usize| {
        let sum = du * du * variance(0, axis) + dv * dv * variance(1, axis);
        Estimate::new(value, sum.max(0.0).sqrt())
    };
    // E = (F^T F - 1)/2, and the slopes of E by the displacement gradient.
    let shear = 0.5 * (uy + vx + ux * uy + vx * vy);
    let mixed = |component: usize, a: f64, b: f64| {
        a * a * variance(component, 0) + b * b * variance(component, 1) + 2.0 * a * b * of_noise[component].xy
    };
    let shear_variance = 0.25 * (mixed(0, uy, 1.0 + ux) + mixed(1, 1.0 + vy, vx));
    Some(Strain {
        xx: along(ux + 0.5 * (ux * ux + vx * vx), [1.0 + ux, vx], 0),
        yy: along(vy + 0.5 * (uy * uy + vy * vy), [uy, 1.0 + vy], 1),
        xy: Estimate::new(shear, shear_variance.max(0.0).sqrt()),
    })
}
