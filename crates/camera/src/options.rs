//! What a caller may state when a recording is opened, and the count of bytes that were looked at.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::CameraError;
use crate::raw_geometry::RawGeometry;

/// What the caller knows of a recording, or wants to know of its reading.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// Frames per second, for recordings without time stamps of their own: images, arrays, TIFF stacks, videos (which
    /// often state the rate at which they were meant to be shown) and .mraw. Time stamps in a file win over it.
    pub rate_hz: Option<f64>,
    /// Takes the whole frames of a recording that ends before its last one, and says in its warnings how many those are.
    /// Otherwise such a recording is refused, as nobody asked for a part of it; but a video, whose header may count frames that were never
    /// written, is read as far as it goes, and says so.
    pub partial: bool,
    /// Reads every file as pixels of this geometry without a header, whatever its first bytes are.
    pub raw: Option<RawGeometry>,
    /// Counts the bytes of uncompressed pixels that are looked at.
    pub pixel_bytes: ByteCounter,
}

impl OpenOptions {
    /// Refuses a frame rate that is none.
    pub(crate) fn check(&self, path: &Path) -> Result<(), CameraError> {
        match self.rate_hz {
            Some(rate_hz) if !(rate_hz.is_finite() && rate_hz > 0.0) => {
                Err(CameraError::FrameRate { path: path.into(), found: rate_hz })
            }
            _ => Ok(()),
        }
    }
}

/// A count of bytes that goes on while a recording is read; a clone counts the same bytes.
#[derive(Debug, Clone, Default)]
pub struct ByteCounter(Arc<AtomicU64>);

impl ByteCounter {
    /// Bytes counted so far.
    pub fn bytes(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    pub(crate) fn add(&self, n_bytes: u64) {
        self.0.fetch_add(n_bytes, Ordering::Relaxed);
    }
}
