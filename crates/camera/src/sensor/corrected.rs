//! A recording whose dark level, gain and defects are taken out while it is read, region by region.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region};

use super::correction::SensorCorrection;
use super::neighbours::{MOST_REACH_PX, Surroundings};
use crate::error::CameraError;

/// A recording of light: (count - dark) gain of the recording behind it, with defects filled from their neighbours.
///
/// Only the regions that are asked for are read, wider by a few pixels where a defect lies in them. Counts of what is darker than the
/// dark level by noise are below 0. Saturated pixels stay so: they have the full scale of this recording, whose bit depth is
/// larger where gains lift other pixels above the old one.
pub struct Corrected {
    recording: Box<dyn Recording>,
    correction: Arc<SensorCorrection>,
    info: RecordingInfo,
    /// Whether each pixel of the sensor is a defect.
    is_defect: Arc<Vec<bool>>,
}

impl Corrected {
    /// Corrects a recording.
    ///
    /// # Errors
    /// [`CameraError::Correction`] when the recording has another size or bit depth than the correction.
    pub fn new(
        recording: Box<dyn Recording>,
        correction: Arc<SensorCorrection>,
    ) -> Result<Self, CameraError> {
        correction.check(recording.as_ref())?;
        let mut info = recording.info().clone();
        let mut is_defect = vec![false; info.width_px * info.height_px];
        for defect in correction.defects().defects() {
            is_defect[defect.y * info.width_px + defect.x] = true;
        }
        // Gains below this lift no pixel above full scale.
        info.bit_depth += correction.most_gain().log2().ceil().clamp(0.0, 64.0) as u32;
        info.warnings.extend(correction.remarks(info.exposure_s));
        Ok(Self { recording, correction, info, is_defect: Arc::new(is_defect) })
    }

    /// The correction.
    pub fn correction(&self) -> &SensorCorrection {
        &self.correction
    }

    fn place(&self, x: usize, y: usize) -> usize {
        y * self.info.width_px + x
    }

    /// Turns the counts of a region into light.
    fn correct(&self, region: Region, pixels: &mut [f32]) {
        let (raw_full, full) = (self.recording.info().full_scale(), self.info.full_scale() as f32);
        for (y, row) in (region.y..).zip(pixels.chunks_exact_mut(region.width.max(1))) {
            for (x, pixel) in (region.x..).zip(row) {
                let is_saturated = f64::from(*pixel) >= raw_full;
                *pixel = if is_saturated { full } else { self.correction.light(self.place(x, y), *pixel) };
            }
        }
    }

    fn has_defect(&self, region: Region) -> bool {
        (region.y..region.y + region.height)
            .any(|y| self.is_defect[self.place(region.x, y)..][..region.width].contains(&true))
    }

    /// Reads a region with a margin, and fills its defects.
    fn read_filled(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        let (x, y) = (region.x.saturating_sub(MOST_REACH_PX), region.y.saturating_sub(MOST_REACH_PX));
        let wide = Region {
            x,
            y,
            width: (region.x + region.width + MOST_REACH_PX).min(self.info.width_px) - x,
            height: (region.y + region.height + MOST_REACH_PX).min(self.info.height_px) - y,
        };
        let mut light = vec![0.0; wide.n_pixels()];
        self.recording.read_region(frame, wide, &mut light)?;
        self.correct(wide, &mut light);
        let full = self.info.full_scale() as f32;
        let at = |column: usize, row: usize| light[row * wide.width + column];
        let count = |column: usize, row: usize| f64::from(at(column, row));
        // What is saturated tells of its neighbours only that they are bright.
        let is_good = |column: usize, row: usize| {
            !self.is_defect[self.place(wide.x + column, wide.y + row)] && at(column, row) < full
        };
        let surroundings =
            Surroundings { width_px: wide.width, height_px: wide.height, count: &count, is_good: &is_good };
        let (dx, dy) = (region.x - wide.x, region.y - wide.y);
        for (row, target) in pixels.chunks_exact_mut(region.width).enumerate() {
            for (column, pixel) in target.iter_mut().enumerate() {
                let is_defect = self.is_defect[self.place(region.x + column, region.y + row)];
                let (column, row) = (column + dx, row + dy);
                // A defect without a good neighbour counts as saturated: nothing is known of it.
                *pixel = if is_defect {
                    surroundings.expected(column, row).map_or(full, |count| count as f32)
                } else {
                    at(column, row)
                };
            }
        }
        Ok(())
    }
}

impl Recording for Corrected {
    fn path(&self) -> &Path {
        self.recording.path()
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn is_sequential(&self) -> bool {
        self.recording.is_sequential()
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        self.recording.will_read(frames, regions);
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        if pixels.is_empty() {
            return Ok(());
        }
        if self.has_defect(region) {
            return self.read_filled(frame, region, pixels);
        }
        self.recording.read_region(frame, region, pixels)?;
        self.correct(region, pixels);
        Ok(())
    }
}
