//! A [`Recording`] made of what a file says of itself and of a source of pixels.

use std::ops::Range;
use std::path::{Path, PathBuf};

use chainwave_measurement::{PlainFrame, ReadError, Recording, RecordingInfo, Region};

use crate::options::{ByteCounter, OpenOptions};
use crate::picture::PictureShape;
use crate::timing::Timing;

/// What is known of a recording whose file says nothing of a camera, an exposure and a trigger: its format, the shape of its frames,
/// when each was taken, and what else a reader should know.
pub(crate) fn without_camera(
    format: String,
    shape: PictureShape,
    timing: Timing,
    mut remarks: Vec<String>,
) -> RecordingInfo {
    remarks.insert(0, timing.warning);
    RecordingInfo {
        format,
        width_px: shape.width_px,
        height_px: shape.height_px,
        n_frames: timing.times_s.len(),
        bit_depth: shape.bits,
        rate_hz: timing.rate_hz,
        times_s: timing.times_s,
        first_image: 0,
        camera: None,
        exposure_s: None,
        triggered_unix_s: None,
        warnings: remarks,
    }
}

/// Where the pixels of a recording come from.
pub(crate) trait PixelSource: Send + Sync {
    /// Writes the counts of `region` in `frame`, which lie in the recording and are not empty, and says how many bytes of
    /// uncompressed pixels it looked at, or what was expected and found.
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String>;

    /// As [`Recording::plain_frame`]; the frame lies in the recording.
    fn plain_frame(&self, _frame: usize) -> Option<PlainFrame<'_>> {
        None
    }

    /// As [`Recording::is_sequential`].
    fn is_sequential(&self) -> bool {
        false
    }

    /// As [`Recording::will_read`]; frames and regions lie in the recording.
    fn will_read(&self, _frames: Range<usize>, _regions: &[Region]) {}
}

/// A recording in a file or a folder: what it says of itself, and its pixels.
pub(crate) struct FileRecording<S> {
    path: PathBuf,
    info: RecordingInfo,
    source: S,
    pixel_bytes: ByteCounter,
}

impl<S: PixelSource> FileRecording<S> {
    pub(crate) fn new(path: &Path, info: RecordingInfo, source: S, options: &OpenOptions) -> Self {
        Self { path: path.into(), info, source, pixel_bytes: options.pixel_bytes.clone() }
    }
}

impl<S: PixelSource> Recording for FileRecording<S> {
    fn path(&self) -> &Path {
        &self.path
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn is_sequential(&self) -> bool {
        self.source.is_sequential()
    }

    fn plain_frame(&self, frame: usize) -> Option<PlainFrame<'_>> {
        (frame < self.info.n_frames).then(|| self.source.plain_frame(frame))?
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        let RecordingInfo { n_frames, width_px, height_px, .. } = &self.info;
        let lie_inside = regions.iter().all(|region| region.fits_in(*width_px, *height_px));
        if lie_inside {
            self.source.will_read(frames.start.min(*n_frames)..frames.end.min(*n_frames), regions);
        }
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        if !pixels.is_empty() {
            let unreadable = |reason| ReadError::Unreadable { path: self.path.clone(), frame, reason };
            self.pixel_bytes.add(self.source.read(frame, region, pixels).map_err(unreadable)?);
        }
        Ok(())
    }
}
