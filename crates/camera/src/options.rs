use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::CameraError;

/// What the caller knows of a recording, or wants to know of its reading.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// Frames per second, for recordings without time stamps of their own: images, arrays, TIFF stacks, videos (which
    /// often state the rate at which they were meant to be shown) and .mraw. Time stamps in a file win over it.
    pub rate_hz: Option<f64>,
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
