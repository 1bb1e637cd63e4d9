//! Uncompressed frames back to back in one file.

use std::ops::Range;
use std::path::{Path, PathBuf};

use chainwave_measurement::{PlainFrame, Region};
use memmap2::Mmap;

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::file_recording::PixelSource;
use crate::options::OpenOptions;
use crate::partial;
use crate::raster::Raster;
use crate::read_ahead::{ask_for, ask_for_large, expect_pieces};

/// Uncompressed frames that lie back to back in one memory-mapped file, which has [room](Self::check_room) for them.
pub(crate) struct FlatFrames {
    path: PathBuf,
    map: Mmap,
    raster: Raster,
    /// Where the first frame starts, in bytes from the start of the file.
    first_byte: u64,
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
    /// The frames of a map, which are read by pieces.
    pub(crate) fn new(path: &Path, map: Mmap, raster: Raster, first_byte: u64) -> Self {
        expect_pieces(&map);
        Self { path: path.into(), map, raster, first_byte }
    }

    fn start(&self, frame: usize) -> u64 {
        self.first_byte + frame as u64 * self.raster.frame_bytes()
    }

    /// The bytes of a frame.
    fn image(&self, frame: usize) -> Result<&[u8], CameraError> {
        Bytes::new(&self.path, &self.map).slice("pixels", self.start(frame), self.raster.frame_bytes())
    }
}

impl PixelSource for FlatFrames {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        let image = self.image(frame).map_err(|error| error.to_string())?;
        ask_for_large(&self.map, &self.raster, self.start(frame), region);
        Ok(self.raster.unpack(image, region, pixels))
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        ask_for(&self.map, &self.raster, frames.map(|frame| self.start(frame)), regions);
    }

    fn plain_frame(&self, frame: usize) -> Option<PlainFrame<'_>> {
        self.raster.plain_frame(self.image(frame).ok()?)
    }
}
