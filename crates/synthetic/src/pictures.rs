//! Pairs of pictures of a deformed texture whose displacement is known in closed form: the truth for image correlation.
//!
//! A deformed surface carries its brightness with it: what the reference picture shows at X, the deformed one shows at
//! x = X + u(X). Each pixel is the mean over its square of the texture at the sources of its points: the texture is a sum of
//! Gaussians in closed form, the sources follow by Newton's method, and the mean by Gauss-Legendre quadrature, three points
//! along each side of parts that cover at most a pixel of the reference. No image is interpolated, and this module knows no
//! matcher. Under a homogeneous deformation F a spot is shown as the Gaussian of covariance sigma^2 F F^T, and its light is
//! det F times what it was.
//!
//! ```
//! use chainwave_synthetic::pictures::{Deformation, Surface, Texture, picture};
//!
//! let texture = Texture::speckles(1, 4.5, [64.0, 64.0], [96.0, 96.0]);
//! let surface = Surface::everywhere(texture, Deformation::NONE);
//! let stretched = Deformation::stretch([64.0, 64.0], [0.30, 0.0]);
//! let reference = picture([128, 128], &[surface.clone()])?;
//! let deformed = picture([128, 128], &[surface.deformed(stretched)])?;
//! assert_eq!(reference.dim(), deformed.dim());
//! assert!((stretched.displacement_px([74.0, 64.0])[0] - 3.0).abs() < 1e-12);
//! # Ok::<(), chainwave_synthetic::SyntheticError>(())
//! ```

mod deformation;
mod samples;
mod spots;
mod texture;

use ndarray::Array2;
use rand::RngExt;
use rand_distr::StandardNormal;

pub use self::deformation::Deformation;
pub use self::samples::picture_by_samples;
pub use self::spots::picture_by_spots;
pub use self::texture::Texture;

use crate::SyntheticError;
use crate::blur::{Blur, NODE, WEIGHTS};
use crate::check::{require, require_not_negative};
use crate::half_plane::half_plane_coverage;
use crate::seed::{Purpose, stream};

/// A textured surface that deforms. Tones are fractions of full scale.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Its spots.
    pub texture: Texture,
    /// Its outline in the reference picture: centre (column, row) and radius of a disc; none for one that fills the picture.
    pub disc: Option<([f64; 2], f64)>,
    /// How it deforms.
    pub deformation: Deformation,
    /// Tone between the spots.
    pub tone: f64,
    /// How much darker it is in the middle of a spot of depth 1.
    pub contrast: f64,
}

/// Tones of a surface unless others are given: a contrast of about 0.13 rms with speckles, far from both ends.
const TONE: f64 = 0.8;
const CONTRAST: f64 = 0.55;

/// Most parts along a side into which a pixel is cut: more means a surface pressed together beyond what a picture can show.
const MOST_PARTS: f64 = 64.0;

impl Surface {
    /// A surface that fills the picture.
    pub fn everywhere(texture: Texture, deformation: Deformation) -> Self {
        Self { texture, disc: None, deformation, tone: TONE, contrast: CONTRAST }
    }

    /// A disc with its own speckles, that turns about its centre (from right towards down) and moves.
    pub fn turned_disc(
        seed: u64,
        diameter_px: f64,
        disc: ([f64; 2], f64),
        turn_rad: f64,
        shift_px: [f64; 2],
    ) -> Self {
        let (centre_px, radius_px) = disc;
        let texture = Texture::speckles(seed, diameter_px, centre_px, [radius_px; 2]);
        let deformation = Deformation::rigid(centre_px, turn_rad, shift_px);
        Self { disc: Some(disc), ..Self::everywhere(texture, deformation) }
    }

    /// The same surface under another deformation.
    pub fn deformed(self, deformation: Deformation) -> Self {
        Self { deformation, ..self }
    }

    /// The surface's cover of a pixel and its tone there; `None` where the deformation folds.
    fn seen(&self, centre_px: [f64; 2]) -> Option<(f64, f64)> {
        let source_px = self.deformation.source_px(centre_px)?;
        let back = inverse_of(self.deformation.gradient(source_px));
        let covered = self.disc.map_or(1.0, |disc| disc_cover(disc, source_px, back));
        if covered <= 0.0 {
            return Some((0.0, 0.0));
        }
        let widest = back.iter().map(|row| row[0].hypot(row[1])).fold(0.0, f64::max);
        if widest > MOST_PARTS {
            return None;
        }
        let n_parts = widest.ceil().max(1.0);
        let depth = self.mean_depth(centre_px, n_parts as usize)?;
        Some((covered, self.tone - self.contrast * depth))
    }

    /// The mean of the spots' depth over a pixel cut into parts.
    fn mean_depth(&self, centre_px: [f64; 2], n_parts: usize) -> Option<f64> {
        let side_px = 1.0 / n_parts as f64;
        let node = |index: usize| {
            let middle_px = ((index / 3) as f64 + 0.5) * side_px - 0.5;
            let at_px = middle_px + 0.5 * NODE * ((index % 3) as f64 - 1.0) * side_px;
            (at_px, WEIGHTS[index % 3] * side_px)
        };
        let mut mean = 0.0;
        for (down_px, weight_down) in (0..3 * n_parts).map(node) {
            for (right_px, weight_right) in (0..3 * n_parts).map(node) {
                let seen_px = [centre_px[0] + right_px, centre_px[1] + down_px];
                mean += weight_down * weight_right * self.texture.depth(self.deformation.source_px(seen_px)?);
            }
        }
        Some(mean)
    }
}

/// The picture of some surfaces before a black ground, each over those before it: tones from 0 to 1 (sums of spots may leave
/// that range), shape `[height, width]`. Pixel (column, row) covers half a pixel to either side of that point.
///
/// # Errors
/// [`SyntheticError::Setting`] when a deformation folds its surface within the picture.
pub fn picture(size_px: [usize; 2], surfaces: &[Surface]) -> Result<Array2<f64>, SyntheticError> {
    let [width_px, height_px] = size_px;
    let mut tones = Array2::zeros((height_px, width_px));
    for surface in surfaces {
        for ((row, column), value) in tones.indexed_iter_mut() {
            let (covered, tone) = surface.seen([column as f64, row as f64]).ok_or_else(folded)?;
            *value += covered * (tone - *value);
        }
    }
    Ok(tones)
}

/// The counts of a camera that sees the tones: normal noise of a standard deviation (a fraction of full scale), rounded to
/// whole counts of `bit_depth` bits; each pair of seed and number (of the picture) has noise of its own.
///
/// # Errors
/// [`SyntheticError::Setting`] when the noise is negative or the bit depth not 1 to 16.
pub fn counts(
    tones: &Array2<f64>,
    bit_depth: u32,
    noise_sigma: f64,
    seed: u64,
    number: u64,
) -> Result<Array2<f32>, SyntheticError> {
    require_not_negative("noise_sigma", noise_sigma)?;
    require((1..=16).contains(&bit_depth), "bit_depth", "1 to 16", bit_depth)?;
    let full_scale = f64::from((1_u32 << bit_depth) - 1);
    let mut random = stream(Purpose::PictureNoise, seed, number);
    Ok(tones.mapv(|tone| {
        let noise = noise_sigma * random.sample::<f64, _>(StandardNormal);
        (full_scale * (tone + noise)).round().clamp(0.0, full_scale) as f32
    }))
}

fn folded() -> SyntheticError {
    SyntheticError::Setting {
        name: "deformation",
        expected: "one that shows every point of the surface once",
        found: "a surface folded over (weaken the amplitude, or lengthen the period)".into(),
    }
}

/// The inverse of 1 + gradient: how the source moves with the pixel.
fn inverse_of([[a, b], [c, d]]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let determinant = (1.0 + a) * (1.0 + d) - b * c;
    [[(1.0 + d) / determinant, -b / determinant], [-c / determinant, (1.0 + a) / determinant]]
}

/// The share of a pixel that a disc covers, its edge replaced by the tangent near the pixel.
fn disc_cover((centre_px, radius_px): ([f64; 2], f64), source_px: [f64; 2], back: [[f64; 2]; 2]) -> f64 {
    let apart = [source_px[0] - centre_px[0], source_px[1] - centre_px[1]];
    let distance_px = apart[0].hypot(apart[1]);
    if distance_px <= 0.0 {
        return 1.0;
    }
    let outward = apart.map(|component| component / distance_px);
    let slope = [0, 1].map(|axis| outward[0] * back[0][axis] + outward[1] * back[1][axis]);
    let steepness = slope[0].hypot(slope[1]);
    let normal = slope.map(|component| component / steepness);
    half_plane_coverage(normal, (radius_px - distance_px) / steepness, Blur::default())
}
