//! Pictures by their spots: each drawn once, where it lies and as it is deformed there, instead of each pixel by all that reaches it.
//!
//! Under a homogeneous deformation F a spot is the Gaussian of covariance sigma^2 F F^T. Its mean over a pixel is the product of its
//! integrals along x and y where that is diagonal (turns, and stretches along the axes): closed form. Else the integral along x at a given
//! row is closed form, a Gaussian whose middle moves with the row, and that along y is Gauss-Legendre's, as in [`super::picture`].
//!
//! Where a deformation bends, each spot is deformed by the gradient in its middle. A bend b (second derivative, per pixel) moves what lies
//! r off the middle by b r^2/2 from there: with 3 px and a thousandth per pixel 5 mpx, at the edge of a spot and to all sides alike.

use ndarray::{Array2, ArrayViewMut1, s};

use super::{Surface, Texture, disc_cover, folded, inverse_of};
use crate::SyntheticError;
use crate::blur::{NODE, WEIGHTS};
use crate::gaussian::primitive;
use crate::pictures::Deformation;
use crate::speckle::REACH_SIGMA;

/// As [`super::picture`], some hundred times as fast: exact for homogeneous deformations, and good to some millipixels where they bend.
///
/// # Errors
/// As [`super::picture`].
pub fn picture_by_spots(size_px: [usize; 2], surfaces: &[Surface]) -> Result<Array2<f64>, SyntheticError> {
    composed(size_px, surfaces, depths)
}

/// Draws the sum of a texture's spots under a deformation into a picture of so many columns and rows.
pub(super) type Depths = fn([usize; 2], &Texture, &Deformation) -> Result<Array2<f64>, SyntheticError>;

/// Each surface over those before it, from the sums of its texture's spots.
pub(super) fn composed(
    size_px: [usize; 2],
    surfaces: &[Surface],
    depths: Depths,
) -> Result<Array2<f64>, SyntheticError> {
    let [width_px, height_px] = size_px;
    let mut tones = Array2::zeros((height_px, width_px));
    for surface in surfaces {
        let depths = depths(size_px, &surface.texture, &surface.deformation)?;
        let tone = |depth: f64| surface.tone - surface.contrast * depth;
        if surface.disc.is_none() {
            tones = depths.mapv_into(tone);
            continue;
        }
        let [columns, rows] = bounds(surface, size_px);
        for row in rows {
            for column in columns.clone() {
                let covered = surface.cover([column as f64, row as f64]).ok_or_else(folded)?;
                let value = &mut tones[[row, column]];
                *value += covered * (tone(depths[[row, column]]) - *value);
            }
        }
    }
    Ok(tones)
}

impl Surface {
    /// The share of a pixel that the surface covers; `None` where the deformation folds.
    fn cover(&self, centre_px: [f64; 2]) -> Option<f64> {
        let Some(disc) = self.disc else { return Some(1.0) };
        let source_px = self.deformation.source_px(centre_px)?;
        Some(disc_cover(disc, source_px, inverse_of(self.deformation.gradient(source_px))))
    }
}

/// Columns and rows that a surface may cover.
fn bounds(surface: &Surface, [width_px, height_px]: [usize; 2]) -> [std::ops::Range<usize>; 2] {
    let (Some((centre_px, radius_px)), Deformation::Affine { gradient, .. }) =
        (surface.disc, surface.deformation)
    else {
        return [0..width_px, 0..height_px];
    };
    let middle_px = surface.deformation.displaced_px(centre_px);
    let along = |axis: usize, n: usize| {
        let of_axis = |other: usize| f64::from(u8::from(axis == other)) + gradient[axis][other];
        // two pixels for the edge's own
        let reach_px = radius_px * of_axis(0).hypot(of_axis(1)) + 2.0;
        pixels_between(middle_px[axis] - reach_px, middle_px[axis] + reach_px, n)
    };
    [along(0, width_px), along(1, height_px)]
}

/// The pixels of `n` whose middles lie between two places, by and large.
pub(super) fn pixels_between(low_px: f64, high_px: f64, n: usize) -> std::ops::Range<usize> {
    let within = |place: f64| place.clamp(0.0, n as f64) as usize;
    within(low_px.floor())..within(high_px.ceil() + 1.0)
}

/// The sum of a texture's spots, meant over each pixel.
fn depths(
    [width_px, height_px]: [usize; 2],
    texture: &Texture,
    deformation: &Deformation,
) -> Result<Array2<f64>, SyntheticError> {
    let mut depths = Array2::zeros((height_px, width_px));
    let mut along = Vec::new();
    for spot in &texture.spots {
        let place_px = [spot.x_px, spot.y_px];
        let shown = Shown::new(deformation.gradient(place_px), texture.sigma_px).ok_or_else(folded)?;
        let middle_px = deformation.displaced_px(place_px);
        let reach_px = [shown.variance[0], shown.variance[2]].map(|variance| REACH_SIGMA * variance.sqrt());
        let [columns, rows] = [0, 1].map(|axis| {
            let n = [width_px, height_px][axis];
            pixels_between(middle_px[axis] - reach_px[axis], middle_px[axis] + reach_px[axis], n)
        });
        if columns.is_empty() || rows.is_empty() {
            continue;
        }
        let first_px = columns.start as f64 - middle_px[0];
        along.resize(columns.len(), 0.0);
        if shown.is_upright() {
            shown.along_row(0.0, first_px, &mut along);
        }
        for row in rows {
            let target = depths.slice_mut(s![row, columns.clone()]);
            shown.add(row as f64 - middle_px[1], first_px, spot.depth, &mut along, target);
        }
    }
    Ok(depths)
}

/// A spot as it is shown.
struct Shown {
    /// Covariance xx, xy, yy.
    variance: [f64; 3],
    /// How the middle of a row moves from row to row, and its standard deviation.
    slope: f64,
    row_sigma_px: f64,
}

impl Shown {
    fn new([[a, b], [c, d]]: [[f64; 2]; 2], sigma_px: f64) -> Option<Self> {
        let (forth_x, forth_y) = ([1.0 + a, b], [c, 1.0 + d]);
        let variance = sigma_px * sigma_px;
        let product = |u: [f64; 2], v: [f64; 2]| variance * (u[0] * v[0] + u[1] * v[1]);
        let [xx, xy, yy] = [product(forth_x, forth_x), product(forth_x, forth_y), product(forth_y, forth_y)];
        let determinant = forth_x[0] * forth_y[1] - forth_x[1] * forth_y[0];
        let slope = xy / yy;
        (determinant > 0.0).then(|| Self {
            variance: [xx, xy, yy],
            slope,
            row_sigma_px: (xx - slope * xy).max(0.0).sqrt(),
        })
    }

    /// Whether the integrals along x and y are independent; what is left by rounding moves the edge by less than a rounding error.
    fn is_upright(&self) -> bool {
        let [xx, xy, yy] = self.variance;
        xy.abs() <= 1.0e-13 * xx.max(yy)
    }

    /// The integrals along x over pixels of which the first lies at a place, of the row at a distance from the spot's middle.
    fn along_row(&self, row_px: f64, first_px: f64, along: &mut [f64]) {
        let at = |edge_px: f64| self.row_sigma_px * primitive(edge_px / self.row_sigma_px);
        let start_px = first_px - 0.5 - self.slope * row_px;
        let mut before = at(start_px);
        for (index, value) in along.iter_mut().enumerate() {
            let after = at(start_px + index as f64 + 1.0);
            *value = after - before;
            before = after;
        }
    }

    /// Adds the spot to a row of pixels.
    fn add(
        &self,
        row_px: f64,
        first_px: f64,
        depth: f64,
        along: &mut [f64],
        mut target: ArrayViewMut1<'_, f64>,
    ) {
        let sigma_px = self.variance[2].sqrt();
        if self.is_upright() {
            let at = |edge_px: f64| sigma_px * primitive(edge_px / sigma_px);
            let weight = depth * (at(row_px + 0.5) - at(row_px - 0.5));
            target.iter_mut().zip(along).for_each(|(value, along)| *value += weight * *along);
            return;
        }
        let n_parts = (1.0 / sigma_px.min(self.row_sigma_px)).ceil().max(1.0) as usize;
        let side_px = 1.0 / n_parts as f64;
        for index in 0..3 * n_parts {
            let middle_px = ((index / 3) as f64 + 0.5) * side_px - 0.5;
            let at_px = row_px + middle_px + 0.5 * NODE * ((index % 3) as f64 - 1.0) * side_px;
            let weight = depth * WEIGHTS[index % 3] * side_px;
            let height = weight * libm::exp(-0.5 * (at_px / sigma_px).powi(2));
            self.along_row(at_px, first_px, along);
            target.iter_mut().zip(&*along).for_each(|(value, along)| *value += height * along);
        }
    }
}
