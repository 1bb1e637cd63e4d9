//! Whether the residuals of a match bear out what its neighbours make of the displacement within its subset.
//!
//! A polynomial through the neighbours moves the pixels of the subset by w beyond what the shape function follows, which leaves `-b w grad f` in
//! its residuals, b being the gain of the light. How much of that they hold along each axis is found by least squares, beside what a match
//! fits anyway: 1 where the field is the polynomial, and 0 where that has been led astray by what lies across a crack, and the subset moves
//! as its shape function does. Residuals of `N` pixels tell it to `s/w`, s the standard uncertainty of the match and w in root mean square, so what
//! they do not tell is no more than noise.

use nalgebra::{Matrix2, Vector2};

use crate::field::shape_error::local_fit::Polynomial;
use crate::icgn::outcome::Match;
use crate::simd::dot;
use crate::structure::orthonormal;
use crate::uncertainty::degrees_of_freedom;
use crate::warp::Warp;
use crate::{PreparedSubset, Window, Workspace};

/// Share of the polynomial below which the residuals hold rather nothing of it.
const LEAST_SHARE_HELD: f64 = 0.5;
/// Standard deviations by which the whole of it is not what they hold.
const NOT_THE_WHOLE: f64 = 2.0;

/// Whether the residuals say that the displacement within a subset is not that of a polynomial, along one of the axes.
pub(super) fn is_refuted(
    polynomial: &Polynomial,
    subset: &PreparedSubset,
    window: &Window,
    found: &Match,
) -> bool {
    let mut workspace = Workspace::default();
    if found.is_whole {
        return is_refuted_by(polynomial, subset, window, found, &mut workspace);
    }
    let part = subset.visible_at(window, found, &mut workspace).and_then(|seen| subset.only(&seen).ok());
    part.is_some_and(|part| is_refuted_by(polynomial, &part, window, found, &mut workspace))
}

fn is_refuted_by(
    polynomial: &Polynomial,
    subset: &PreparedSubset,
    window: &Window,
    found: &Match,
    workspace: &mut Workspace,
) -> bool {
    let warp = found.warp();
    let Some((compared, residual)) = subset.compare(window, &warp, workspace) else { return false };
    let fitted = orthonormal(subset.fitted_images());
    let foreseen = images(polynomial, subset, &warp).map(|image| beside(image, &fitted));
    let residuals: Vec<f32> =
        subset.residuals(&compared, workspace).into_iter().map(|residual| residual as f32).collect();
    let product = |i: usize, j: usize| dot(&foreseen[i], &foreseen[j]);
    let normal = Matrix2::new(product(0, 0), product(0, 1), product(1, 0), product(1, 1));
    let Some(inverse) = normal.try_inverse() else { return false };
    let held =
        -inverse * Vector2::new(dot(&residuals, &foreseen[0]), dot(&residuals, &foreseen[1])) / compared.gain;
    let variance = residual.sum_of_squares / degrees_of_freedom(subset) as f64 / compared.gain.powi(2);
    (0..2).any(|axis| {
        let sigma = (variance * inverse[(axis, axis)]).sqrt();
        held[axis] < LEAST_SHARE_HELD && held[axis] + NOT_THE_WHOLE * sigma < 1.0
    })
}

/// What a displacement of the pixels along x and along y of the target by the polynomial changes of the reference.
fn images(polynomial: &Polynomial, subset: &PreparedSubset, warp: &Warp) -> [Vec<f32>; 2] {
    let mut images = slopes(subset, warp);
    let [along_x, along_y] = &mut images;
    let places = subset.columns.iter().zip(subset.rows.iter());
    for ((column, row), (x, y)) in places.zip(along_x.iter_mut().zip(along_y)) {
        let moved = polynomial.at([f64::from(*column), f64::from(*row)]);
        (*x, *y) = (*x * moved[0] as f32, *y * moved[1] as f32);
    }
    images
}

/// What one pixel along x and along y of the target changes of the reference, pixel by pixel.
pub(super) fn slopes(subset: &PreparedSubset, warp: &Warp) -> [Vec<f32>; 2] {
    let [ux, uy, vx, vy] = warp.gradient;
    let determinant = (1.0 + ux) * (1.0 + vy) - uy * vx;
    // In the reference a displacement along x of the target is one along the first column of the inverse gradient.
    let back = [[1.0 + vy, -vx], [-uy, 1.0 + ux]].map(|column| column.map(|part| part / determinant));
    back.map(|[x, y]| {
        let along = |k: usize| x * f64::from(subset.gradient_x[k]) + y * f64::from(subset.gradient_y[k]);
        (0..subset.n_pixels()).map(|k| along(k) as f32).collect()
    })
}

/// What an image has beside those that are fitted.
fn beside(mut image: Vec<f32>, fitted: &[Vec<f32>]) -> Vec<f32> {
    for known in fitted {
        let share = dot(known, &image) as f32;
        image.iter_mut().zip(known).for_each(|(value, known)| *value -= share * known);
    }
    image
}
