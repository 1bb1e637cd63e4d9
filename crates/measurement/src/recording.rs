//! The trait by which pixels of a recording are read, and what a recording says of itself.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::Region;
use crate::observation::proper_frames;

/// What a recording says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingInfo {
    /// File format and packing, such as `cine 16 bit` or `cine P10`.
    pub format: String,
    /// Columns of a frame.
    pub width_px: usize,
    /// Rows of a frame.
    pub height_px: usize,
    /// Frames in the file.
    pub n_frames: usize,
    /// Significant bits of a pixel's linear count: a pixel lies in `0..2^bit_depth`.
    pub bit_depth: u32,
    /// Frame rate: from the time stamps where the file has them, else as the header states it.
    pub rate_hz: Option<f64>,
    /// Time of each frame relative to the trigger, in seconds; length `n_frames`.
    pub times_s: Vec<f64>,
    /// The camera's number of the first frame (the trigger is image 0).
    pub first_image: i64,
    /// Camera model, where the file names it.
    pub camera: Option<String>,
    /// Exposure of a frame, in seconds.
    pub exposure_s: Option<f64>,
    /// When the trigger was by the camera's clock, in seconds since 1970 (UTC), where the file tells.
    pub triggered_unix_s: Option<f64>,
    /// What a careful reader should know: quirks, corrections, contradictions in the header.
    pub warnings: Vec<String>,
}

impl RecordingInfo {
    /// The largest count of a pixel, at which it saturates.
    pub fn full_scale(&self) -> f64 {
        f64::from(self.bit_depth).exp2() - 1.0
    }

    /// The same without frames behind the recording proper, such as a last one that was never exposed and is stamped months later.
    #[must_use]
    pub fn proper(mut self) -> Self {
        self.n_frames = proper_frames(&self.times_s).end;
        self.times_s.truncate(self.n_frames);
        self
    }

    /// When the recording proper ends, in seconds after the trigger; `None` without frames.
    pub fn last_s(&self) -> Option<f64> {
        self.times_s.get(proper_frames(&self.times_s).end.checked_sub(1)?).copied()
    }
}

/// A frame whose pixels lie in memory as whole counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlainFrame<'a> {
    /// The bytes of all rows.
    pub bytes: &'a [u8],
    /// Bytes of a pixel: 1 or 2.
    pub pixel_bytes: usize,
    /// Whether the high byte of a pixel comes first.
    pub is_big_endian: bool,
    /// Bytes from the start of a row to the start of the next.
    pub row_bytes: usize,
    /// Whether the rows are stored from the bottom.
    pub bottom_row_first: bool,
}

/// A sequence of monochrome frames whose pixels are read by region, so that a recording costs what is looked at.
pub trait Recording: Send + Sync {
    /// Where the recording lies, for messages.
    fn path(&self) -> &Path;

    /// Size, rate, time stamps and the like.
    fn info(&self) -> &RecordingInfo;

    /// Whether frames are decoded one after the other, so that readers at different frames hinder each other.
    fn is_sequential(&self) -> bool {
        false
    }

    /// A frame as it lies in memory, where that is how its counts are: neither packed, scaled, companded nor compressed. Another
    /// way to the same counts as [`Recording::read_region`]'s, for callers that can do without a copy.
    fn plain_frame(&self, _frame: usize) -> Option<PlainFrame<'_>> {
        None
    }

    /// Tells that `regions` of `frames` will be read soon, so that what lies on a slow disk can be there by then; changes nothing that
    /// is read.
    fn will_read(&self, _frames: Range<usize>, _regions: &[Region]) {}

    /// Writes the linear counts of `region` in `frame` into `pixels`, row by row from the top; `pixels` holds exactly
    /// `region.n_pixels()` values.
    ///
    /// # Errors
    /// [`ReadError`] when the frame or the region lies outside the recording, the buffer has another size, or the
    /// file's bytes cannot be read.
    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError>;

    /// Checks a request of [`Recording::read_region`] against the recording's size.
    ///
    /// # Errors
    /// [`ReadError`] as above.
    fn check_request(&self, frame: usize, region: Region, n_pixels: usize) -> Result<(), ReadError> {
        let info = self.info();
        if frame >= info.n_frames {
            return Err(ReadError::FrameOutside { path: self.path().into(), frame, n_frames: info.n_frames });
        }
        if !region.fits_in(info.width_px, info.height_px) {
            return Err(ReadError::RegionOutside {
                path: self.path().into(),
                region,
                width_px: info.width_px,
                height_px: info.height_px,
            });
        }
        if n_pixels != region.n_pixels() {
            return Err(ReadError::BufferSize { expected: region.n_pixels(), found: n_pixels });
        }
        Ok(())
    }
}

impl<R: Recording + ?Sized> Recording for Arc<R> {
    fn path(&self) -> &Path {
        self.as_ref().path()
    }

    fn info(&self) -> &RecordingInfo {
        self.as_ref().info()
    }

    fn is_sequential(&self) -> bool {
        self.as_ref().is_sequential()
    }

    fn plain_frame(&self, frame: usize) -> Option<PlainFrame<'_>> {
        self.as_ref().plain_frame(frame)
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        self.as_ref().will_read(frames, regions);
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.as_ref().read_region(frame, region, pixels)
    }
}

/// Why a region could not be read from an opened recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The frame number is too large.
    #[error("{}: frame {frame}: expected a frame below {n_frames}", path.display())]
    FrameOutside {
        /// The recording.
        path: PathBuf,
        /// The frame asked for.
        frame: usize,
        /// Frames in the recording.
        n_frames: usize,
    },
    /// The region reaches outside the frame.
    #[error("{}: region {region:?}: expected one inside {width_px} x {height_px} px", path.display())]
    RegionOutside {
        /// The recording.
        path: PathBuf,
        /// The region asked for.
        region: Region,
        /// Columns of a frame.
        width_px: usize,
        /// Rows of a frame.
        height_px: usize,
    },
    /// The buffer does not hold the region's pixels.
    #[error("pixel buffer: expected {expected} values, found {found}")]
    BufferSize {
        /// Pixels in the region.
        expected: usize,
        /// Values in the buffer.
        found: usize,
    },
    /// The bytes are missing or cannot be decoded.
    #[error("{}: frame {frame}: {reason}", path.display())]
    Unreadable {
        /// The recording.
        path: PathBuf,
        /// The frame asked for.
        frame: usize,
        /// What was expected and found.
        reason: String,
    },
}
