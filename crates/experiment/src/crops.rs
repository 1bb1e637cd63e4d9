//! Equal parts of frames as a recording of their own, in memory: what is matched again after tracking.

use std::path::{Path, PathBuf};

use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region};

/// Equal parts of frames of one recording or of several, by their order.
pub(crate) struct Crops {
    path: PathBuf,
    info: RecordingInfo,
    frames: Vec<Vec<f32>>,
}

impl Crops {
    /// Parts of `width_px` columns, row by row; what is said of the recording is that of the one they come from, but for its size and times.
    pub(crate) fn new(of: &dyn Recording, width_px: usize, frames: Vec<Vec<f32>>) -> Self {
        let n_pixels = frames.first().map_or(0, Vec::len);
        let info = RecordingInfo {
            width_px,
            height_px: n_pixels / width_px.max(1),
            n_frames: frames.len(),
            times_s: (0..frames.len()).map(|frame| frame as f64).collect(),
            ..of.info().clone()
        };
        Self { path: of.path().into(), info, frames }
    }
}

impl Recording for Crops {
    fn path(&self) -> &Path {
        &self.path
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        let rows = self.frames[frame].chunks_exact(self.info.width_px).skip(region.y);
        for (row, out) in rows.zip(pixels.chunks_exact_mut(region.width)) {
            out.copy_from_slice(&row[region.x..region.x + region.width]);
        }
        Ok(())
    }
}
