//! The reference of a film: the mean of its frames at rest, its gradients and its noise.

pub(crate) mod edge;
pub(crate) mod filter;
pub(crate) mod gradient;
pub(crate) mod image;
pub(crate) mod mask;
pub(crate) mod shift;

use std::sync::{Arc, OnceLock};

use chainwave_measurement::{ReadError, Recording, Region, Subset};

use crate::pixel_places::pixel_places;
use crate::reference::gradient::Gradients;
use crate::reference::image::ReferenceImage;
use crate::{CorrelationError, ReferenceFrames};

/// The first place of a subset's pixels from its centre, and their columns and rows.
type Rectangle = ([f64; 2], usize, usize);

/// The pixels of the reference image around a subset, or around many.
#[derive(Debug, Clone)]
pub struct Reference {
    image: ReferenceImage,
    gradients: OnceLock<Gradients>,
    /// The first place and the size of its first subset, with the places of its pixels, which others of that size share.
    places: OnceLock<(Rectangle, [Arc<[f32]>; 3])>,
}

impl Reference {
    /// Pixels beyond the subset on each side that the gradients and the estimate of the noise use where the image has
    /// them.
    pub const MARGIN_PX: usize = gradient::MARGIN_PX;

    /// A reference from its pixels (counts, row by row from the top), the mean of `n_averaged` frames. A pixel that is no
    /// number is left out of every subset.
    ///
    /// # Errors
    /// [`CorrelationError::PixelCount`] when the pixels do not fill the region.
    pub fn new(region: Region, pixels: Vec<f32>, n_averaged: usize) -> Result<Self, CorrelationError> {
        if pixels.len() != region.n_pixels() || pixels.is_empty() {
            return Err(CorrelationError::PixelCount { region, found: pixels.len() });
        }
        Ok(Self {
            image: ReferenceImage::new(region, pixels, n_averaged),
            gradients: OnceLock::new(),
            places: OnceLock::new(),
        })
    }

    /// Leaves out of every subset the pixels at `full_scale` (counts) and above: what was brighter looks the same there.
    #[must_use]
    pub fn saturating_at(mut self, full_scale: f64) -> Self {
        let saturates = |pixel: f32| f64::from(pixel) >= full_scale;
        let pixels = self.image.invalid.iter_mut().zip(&self.image.pixels);
        pixels.for_each(|(invalid, &pixel)| *invalid |= saturates(pixel));
        self.gradients = OnceLock::new();
        self
    }

    /// Reads what `subset` needs from the reference frames of a recording.
    ///
    /// # Errors
    /// [`CorrelationError::NoSuchReference`], [`CorrelationError::SubsetOutside`], or
    /// [`CorrelationError::Reference`] when a frame cannot be read.
    pub fn read(
        recording: &dyn Recording,
        subset: &Subset,
        frames: &ReferenceFrames,
    ) -> Result<Self, CorrelationError> {
        let region = Self::check_inside(recording, subset)?;
        Self::read_region(recording, region, frames)
    }

    /// Reads whole frames.
    ///
    /// # Errors
    /// [`CorrelationError::NoSuchReference`], or [`CorrelationError::Reference`] when a frame cannot be read.
    pub fn read_whole(recording: &dyn Recording, frames: &ReferenceFrames) -> Result<Self, CorrelationError> {
        let whole = Region::whole(recording.info().width_px, recording.info().height_px);
        Self::read_region(recording, whole, frames)
    }

    /// The mean of `region` over the reference frames.
    pub(crate) fn read_region(
        recording: &dyn Recording,
        region: Region,
        frames: &ReferenceFrames,
    ) -> Result<Self, CorrelationError> {
        Self::check_frames(recording, frames)?;
        let (info, frames) = (recording.info(), frames.range());
        let n_averaged = frames.len();
        recording.will_read(frames.clone(), &[region]);
        let pixels = mean_of_frames(recording, region, frames)?;
        Ok(Self::new(region, pixels, n_averaged)?.saturating_at(info.full_scale()))
    }

    /// Refuses reference frames that the recording does not have.
    pub(crate) fn check_frames(
        recording: &dyn Recording,
        frames: &ReferenceFrames,
    ) -> Result<(), CorrelationError> {
        let (range, n_frames) = (frames.range(), recording.info().n_frames);
        if range.is_empty() || range.end > n_frames {
            let (path, first, end) = (recording.path().into(), range.start, range.end);
            return Err(CorrelationError::NoSuchReference { path, first, end, n_frames });
        }
        Ok(())
    }

    /// Whether a subset lies in the frames of a recording, so that it can be prepared there.
    pub fn lies_inside(recording: &dyn Recording, subset: &Subset) -> bool {
        Self::check_inside(recording, subset).is_ok()
    }

    /// The pixels that a subset's preparation uses.
    pub(crate) fn check_inside(
        recording: &dyn Recording,
        subset: &Subset,
    ) -> Result<Region, CorrelationError> {
        let info = recording.info();
        region_of(subset, info.width_px, info.height_px).ok_or_else(|| outside(recording, subset))
    }

    /// Frames behind the mean.
    pub fn n_averaged(&self) -> usize {
        self.image.n_averaged
    }

    /// Its pixels without what follows from them.
    pub(crate) fn image(&self) -> &ReferenceImage {
        &self.image
    }

    /// Where the reference lies in its image.
    pub(crate) fn region(&self) -> Region {
        self.image.region
    }

    /// Mean of the pixels, in counts.
    pub(crate) fn level(&self) -> f64 {
        self.image.level
    }

    /// The gradients of all pixels, made when they are asked for first.
    pub(crate) fn gradients(&self) -> &Gradients {
        self.gradients.get_or_init(|| Gradients::of(&self.image))
    }

    /// Column and row of each pixel of a rectangle whose first is at a place from its centre, and 1.
    pub(crate) fn places(&self, first_px: [f64; 2], width: usize, height: usize) -> [Arc<[f32]>; 3] {
        let wanted = (first_px, width, height);
        let (found, shared) = self.places.get_or_init(|| (wanted, pixel_places(first_px, width, height)));
        if *found == wanted { shared.clone() } else { pixel_places(first_px, width, height) }
    }

    /// The pixels smoothed as their noise requires.
    pub(crate) fn without_noise(&self) -> Vec<f32> {
        let mut smooth = self.gradients().filter.smooth(&self.image, self.image.region);
        smooth.iter_mut().for_each(|value| *value += self.image.level as f32);
        smooth
    }

    /// The pixels, row by row from the top.
    pub(crate) fn pixels(&self) -> &[f32] {
        &self.image.pixels
    }

    /// Whether the reference holds the pixels of columns `x0..=x1` and rows `y0..=y1`.
    pub(crate) fn holds(&self, columns: [i64; 2], rows: [i64; 2]) -> bool {
        self.image.holds(columns, rows)
    }

    /// The pixel at a place of the image that subsets use; `None` for others, and beyond the reference.
    pub(crate) fn usable_pixel(&self, [x, y]: [i64; 2]) -> Option<f64> {
        let region = self.image.region;
        let (column, row) = (x - region.x as i64, y - region.y as i64);
        let inside = self.holds([x, x], [y, y]);
        let index = inside.then(|| row as usize * region.width + column as usize)?;
        let usable = self.gradients().usable.as_ref().is_none_or(|usable| usable[index] > 0.0);
        usable.then(|| f64::from(self.image.pixels[index]))
    }
}

/// The subset with its margin, clipped to the frame; `None` when the subset itself reaches outside.
fn region_of(subset: &Subset, width: usize, height: usize) -> Option<Region> {
    let [x0, x1, y0, y1] = pixel_bounds(subset);
    let inside = x0 >= 0 && y0 >= 0 && x1 < width as i64 && y1 < height as i64;
    let margin = Reference::MARGIN_PX as i64;
    let clipped = Region::clipped(x0 - margin, y0 - margin, x1 + margin + 1, y1 + margin + 1, width, height);
    clipped.filter(|_| inside)
}

/// First and last column, first and last row of a subset.
pub(crate) fn pixel_bounds(subset: &Subset) -> [i64; 4] {
    let (x, y) = (subset.x_px.round() as i64, subset.y_px.round() as i64);
    let (half_width, half_height) = (subset.half_width_px as i64, subset.half_height_px as i64);
    [
        x.saturating_sub(half_width),
        x.saturating_add(half_width),
        y.saturating_sub(half_height),
        y.saturating_add(half_height),
    ]
}

pub(crate) fn outside(recording: &dyn Recording, subset: &Subset) -> CorrelationError {
    CorrelationError::SubsetOutside {
        path: recording.path().into(),
        name: subset.name.clone(),
        x_px: subset.x_px,
        y_px: subset.y_px,
        width_px: recording.info().width_px,
        height_px: recording.info().height_px,
    }
}

/// Mean counts of `region` over some frames, row by row from the top; NaN for no frames. A pixel that saturates in one of
/// them is at full scale, one that is no number in one of them is none.
///
/// # Errors
/// [`ReadError`] when a frame cannot be read.
pub fn mean_of_frames(
    recording: &dyn Recording,
    region: Region,
    frames: std::ops::Range<usize>,
) -> Result<Vec<f32>, ReadError> {
    let full_scale = recording.info().full_scale();
    let scale = 1.0 / frames.len() as f64;
    let mut sum = vec![0.0; region.n_pixels()];
    let mut pixels = vec![0.0; region.n_pixels()];
    for frame in frames {
        recording.read_region(frame, region, &mut pixels)?;
        // A pixel that saturates once has no mean.
        let usable =
            |pixel: f32| if f64::from(pixel) >= full_scale { f64::INFINITY } else { f64::from(pixel) };
        sum.iter_mut().zip(&pixels).for_each(|(sum, &pixel)| *sum += usable(pixel));
    }
    let mean = |sum: f64| if sum == f64::INFINITY { full_scale } else { sum * scale };
    Ok(sum.into_iter().map(|sum| mean(sum) as f32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beyond_its_edge_a_reference_is_mirrored() {
        let pixels = (0..12).map(|i| i as f32).collect();
        let reference = Reference::new(Region { x: 10, y: 20, width: 4, height: 3 }, pixels, 1).unwrap();
        let row = |y: i64| [9, 10, 13, 14].map(|x| reference.image.pixel(x, y) as u8);
        assert_eq!(row(20), [1, 0, 3, 2]);
        assert_eq!(row(19), row(21));
        assert_eq!(row(23), row(21));
    }

    #[test]
    fn frames_that_are_alike_count_as_one() {
        let region = Region { x: 0, y: 0, width: 4, height: 3 };
        let n_averaged = |pixels: Vec<f32>| Reference::new(region, pixels, 40).unwrap().image.n_averaged;
        assert_eq!(n_averaged((0..12).map(|i| i as f32).collect()), 1, "whole counts");
        assert_eq!(n_averaged((0..12).map(|i| i as f32 + 0.025 * (i % 2) as f32).collect()), 40);
    }

    #[test]
    fn a_subset_beyond_the_frame_has_no_region() {
        let subset = |x_px| Subset::new("a", x_px, 50.0, 10, 5);
        assert!(region_of(&subset(10.4), 100, 100).is_some());
        assert!(region_of(&subset(9.4), 100, 100).is_none());
        assert!(region_of(&subset(f64::INFINITY), 100, 100).is_none());
    }
}
