//! What the residuals of a match say of the displacement at its own centre.
//!
//! A match gives a mean of the displacement over its subset. Where that changes over less than a subset, as in a band of strain, neither its shape
//! function nor a polynomial through its neighbours follows, but what they leave stands in the residuals, as `-b w grad f` (see
//! [`super::borne_out`]), and w at the centre is what the match is off by there. A quadratic w by least squares, whose pixels count by a bell around the
//! centre, tells it: a constant would have half of how w bends within the bell. It tells it not as well as the match tells its mean, since the pixels
//! are few, so that it takes no error off. What it is beyond chance is stated.

use chainwave_measurement::Estimate;
use nalgebra::{SMatrix, SVector};

use crate::field::shape_error::bend::largest_mean;
use crate::field::shape_error::borne_out::slopes;
use crate::field::shape_error::grid::Grid;
use crate::warp::Warp;
use crate::{PreparedSubset, Window, Workspace};

/// Standard deviation of the bell over the side of the subset, and how many of them it reaches.
const BELL: f64 = 1.0 / 6.0;
const REACH: f64 = 2.0;
/// Terms of a quadratic along one axis, and along both.
const N_TERMS: usize = 6;
const N_BOTH: usize = 2 * N_TERMS;
/// Standard deviations from which on it is no chance: of a hundred points of a field without such bands less than one is stated with more.
const BEYOND_CHANCE: f64 = 3.0;

type Normal = SMatrix<f64, N_BOTH, N_BOTH>;
type Terms = SVector<f64, N_BOTH>;

/// By how much the displacement at the centre of a subset differs from that of a warp, along x and y in the target, with the standard uncertainty by what
/// residuals have beside it. `None` where they do not tell it, or the warp leaves the window.
pub(super) fn at_centre(
    subset: &PreparedSubset,
    window: &Window,
    warp: &Warp,
    workspace: &mut Workspace,
) -> Option<[Estimate; 2]> {
    let (compared, _) = subset.compare(window, warp, workspace)?;
    let residuals = subset.residuals(&compared, workspace);
    let slopes = slopes(subset, warp);
    let [across, down] = [subset.width, subset.height].map(|side| BELL * side as f64);
    let pixel = |k: usize| {
        let (x, y) = (f64::from(subset.columns[k]) / across, f64::from(subset.rows[k]) / down);
        let square = x * x + y * y;
        let weight = f64::from(subset.weights[k]) * (-0.5 * square).exp();
        let of_axis = [1.0, x, y, x * x, x * y, y * y];
        let terms = Terms::from_fn(|i, _| of_axis[i % N_TERMS] * f64::from(slopes[i / N_TERMS][k]));
        (square < REACH * REACH && weight > 0.0).then_some((weight, terms, residuals[k]))
    };
    let pixels: Vec<(f64, Terms, f64)> = (0..residuals.len()).filter_map(pixel).collect();
    let (mut normal, mut square, mut right) = (Normal::zeros(), Normal::zeros(), Terms::zeros());
    for (weight, terms, residual) in &pixels {
        normal.syger(*weight, terms, terms, 1.0);
        square.syger(weight * weight, terms, terms, 1.0);
        right.axpy(-weight * residual, terms, 1.0);
    }
    [&mut normal, &mut square]
        .into_iter()
        .for_each(|matrix| matrix.fill_upper_triangle_with_lower_triangle());
    let inverse = normal.cholesky()?.inverse();
    let asked = inverse * right;
    let (sum, n) = pixels.iter().fold((0.0, 0.0), |(sum, n), (weight, terms, residual)| {
        (sum + weight * (residual + terms.dot(&asked)).powi(2), n + weight)
    });
    let covariance = inverse * square * inverse * (sum / n);
    let in_px = |term: usize| Estimate::new(asked[term], covariance[(term, term)].sqrt());
    Some([in_px(0), in_px(N_TERMS)].map(|px| px.scaled(compared.gain.recip())))
}

/// What is left at the centres of points along x and y, in pixels: what a point's own residuals show beyond chance, or the root mean square of what those
/// around it do, up to `reach` columns and rows away, where all of them together are beyond chance.
pub(super) fn left_px(
    grid: Grid,
    found: &[Option<[Estimate; 2]>],
    reach: usize,
    side_px: f64,
) -> Vec<[f64; 2]> {
    let quarter = (grid.step_px / (0.5 * side_px)).powi(2).min(1.0);
    let of_axis = |axis: usize| -> Vec<f64> {
        let terms = |found: &Option<[Estimate; 2]>| {
            found.map_or([0.0; 3], |px| [px[axis].value.powi(2), px[axis].sigma.powi(2), 1.0])
        };
        let squares: Vec<[f64; 3]> = found.iter().map(terms).collect();
        let around = |[square, variance, n]: [f64; 3]| {
            let is_told = n > 0.0 && square > largest_mean(n * quarter) * variance;
            if is_told { ((square - variance) / n).max(0.0).sqrt() } else { 0.0 }
        };
        let own = |found: &Option<[Estimate; 2]>| {
            let told = found.map(|px| px[axis]).filter(|px| px.value.abs() > BEYOND_CHANCE * px.sigma);
            told.map_or(0.0, |px| px.value.abs())
        };
        grid.sums(&squares, reach)
            .into_iter()
            .zip(found)
            .map(|(sums, found)| around(sums).max(own(found)))
            .collect()
    };
    let [x, y] = [0, 1].map(of_axis);
    x.into_iter().zip(y).map(|(x, y)| [x, y]).collect()
}
