//! How well a subset would be told, before anything is tracked.

use chainwave_measurement::{Lost, Recording, Region, Subset};

use crate::reference::pixel_bounds;
use crate::uncertainty::expected_sigma_px;
use crate::{CorrelationError, PreparedSubset, Reference, ReferenceFrames, Settings};

/// How well a subset's position would be told, by standard uncertainties along x and y in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedSigma {
    /// What the noise of pixels makes of it, another in each frame.
    pub noise_px: [f64; 2],
    /// What interpolation may leave, the root mean square of a wave over the position's fraction of a pixel: the same in each frame in which
    /// the subset is at the same place.
    pub interpolation_px: [f64; 2],
}

/// The expected standard uncertainty of a subset's position in a frame like the reference, by a match with these settings; or why it has none.
///
/// The noise of a pixel is that between the reference frames where there are two or more, else what the reference itself tells. What
/// bending, light and obstacles add is not foreseen here.
///
/// # Errors
/// As [`Reference::read`].
pub fn expected_sigma(
    recording: &dyn Recording,
    subset: &Subset,
    frames: &ReferenceFrames,
    settings: &Settings,
) -> Result<Result<ExpectedSigma, Lost>, CorrelationError> {
    let reference = Reference::read(recording, subset, frames)?;
    // Of the subset's own pixels: the light, and the noise with it, may be another beside it.
    let [x0, x1, y0, y1] = pixel_bounds(subset);
    let info = recording.info();
    let own = Region::clipped(x0, y0, x1 + 1, y1 + 1, info.width_px, info.height_px);
    let noise = noise_between(recording, own.unwrap_or(reference.region()), frames)?;
    let prepared = PreparedSubset::new(&reference, subset, settings);
    Ok(prepared.map(|prepared| {
        let of_mean = noise.map(|variance| variance / prepared.n_averaged);
        ExpectedSigma {
            noise_px: expected_sigma_px(&prepared, of_mean.unwrap_or(prepared.noise_variance)),
            interpolation_px: prepared.bias.sigma_px(),
        }
    }))
}

/// The variance of a pixel's noise, in counts squared, as the frames of a reference differ from one to the next in a region, but for
/// their light as a whole; `None` of a single frame.
pub(crate) fn noise_between(
    recording: &dyn Recording,
    region: Region,
    frames: &ReferenceFrames,
) -> Result<Option<f64>, CorrelationError> {
    let frames = frames.range();
    let mut before = vec![0.0_f32; region.n_pixels()];
    let mut after = before.clone();
    let (mut sum, n_pairs) = (0.0, frames.len().saturating_sub(1));
    for frame in frames.clone() {
        recording.read_region(frame, region, &mut after)?;
        if frame > frames.start {
            sum += variance_of(before.iter().zip(&after).map(|(a, b)| f64::from(*b) - f64::from(*a)));
        }
        std::mem::swap(&mut before, &mut after);
    }
    // A difference has the noise of both frames.
    Ok((n_pairs > 0).then(|| 0.5 * sum / n_pairs as f64))
}

/// The variance of some numbers about their mean.
fn variance_of(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum, square) = values
        .fold((0.0, 0.0, 0.0), |(n, sum, square), value| (n + 1.0, sum + value, square + value * value));
    if n > 1.0 { ((square - sum * sum / n) / (n - 1.0)).max(0.0) } else { 0.0 }
}
