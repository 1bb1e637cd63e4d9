//! Uncompressed frames back to back in one file.

use std::path::PathBuf;

use chainwave_measurement::{PlainFrame, Region};
use memmap2::Mmap;

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::file_recording::PixelSource;
use crate::options::OpenOptions;
use crate::partial;
use crate::raster::Raster;

/// Uncompressed frames that lie back to back in one memory-mapped file, which has [room](Self::check_room) for them.
pub(crate) struct FlatFrames {
    pub(crate) path: PathBuf,
    pub(crate) map: Mmap,
    pub(crate) raster: Raster,
    /// Where the first frame starts, in bytes from the start of the file.
    pub(crate) first_byte: u64,
}

impl FlatFrames {
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

    /// As [`check_room`](Self::check_room); gives the number of frames, of a file that is cut short the whole ones where
    /// `options` ask for them, with a warning.
    pub(crate) fn n_whole(
        bytes: Bytes,
        raster: &Raster,
        first_byte: u64,
        n_frames: usize,
        options: &OpenOptions,
    ) -> Result<(usize, Option<String>), CameraError> {
        let n_whole = bytes.len().saturating_sub(first_byte) / raster.frame_bytes().max(1);
        if options.partial && (1..n_frames as u64).contains(&n_whole) {
            return Ok((n_whole as usize, Some(partial::warning(n_whole as usize, Some(n_frames)))));
        }
        Self::check_room(bytes, raster, first_byte, n_frames).map(|()| (n_frames, None))
    }
}

impl FlatFrames {
    /// The bytes of a frame.
    fn image(&self, frame: usize) -> Result<&[u8], CameraError> {
        let frame_bytes = self.raster.frame_bytes();
        let start = self.first_byte + frame as u64 * frame_bytes;
        Bytes::new(&self.path, &self.map).slice("pixels", start, frame_bytes)
    }
}

impl PixelSource for FlatFrames {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        let image = self.image(frame).map_err(|error| error.to_string())?;
        Ok(self.raster.unpack(image, region, pixels))
    }

    fn plain_frame(&self, frame: usize) -> Option<PlainFrame<'_>> {
        self.raster.plain_frame(self.image(frame).ok()?)
    }
}
