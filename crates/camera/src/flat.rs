use std::path::{Path, PathBuf};

use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region};
use memmap2::Mmap;

use crate::bytes::Bytes;
use crate::raster::Raster;
use crate::{ByteCounter, CameraError, OpenOptions};

/// Uncompressed frames that lie back to back in one memory-mapped file.
pub(crate) struct FlatFrames {
    path: PathBuf,
    map: Mmap,
    raster: Raster,
    /// Where the first frame starts, in bytes from the start of the file.
    first_byte: u64,
    info: RecordingInfo,
    pixel_bytes: ByteCounter,
}

impl FlatFrames {
    /// Frames of the file `path`, which is `map` and has [room](Self::check_room) for them.
    pub(crate) fn new(
        path: &Path,
        map: Mmap,
        raster: Raster,
        first_byte: u64,
        info: RecordingInfo,
        options: &OpenOptions,
    ) -> Self {
        Self { path: path.into(), map, raster, first_byte, info, pixel_bytes: options.pixel_bytes.clone() }
    }

    /// Refuses a file that ends before its last frame, to be asked before anything is allocated for each frame.
    pub(crate) fn check_room(
        bytes: Bytes,
        raster: &Raster,
        first_byte: u64,
        n_frames: usize,
    ) -> Result<(), CameraError> {
        let n_bytes = raster.frame_bytes().saturating_mul(n_frames as u64);
        bytes.slice(format_args!("{n_frames} frames"), first_byte, n_bytes).map(|_| ())
    }
}

impl Recording for FlatFrames {
    fn path(&self) -> &Path {
        &self.path
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        let frame_bytes = self.raster.frame_bytes();
        let start = self.first_byte + frame as u64 * frame_bytes;
        let image =
            Bytes::new(&self.path, &self.map).slice("pixels", start, frame_bytes).map_err(|error| {
                ReadError::Unreadable { path: self.path.clone(), frame, reason: error.to_string() }
            })?;
        self.pixel_bytes.add(self.raster.unpack(image, region, pixels));
        Ok(())
    }
}
