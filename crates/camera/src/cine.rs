//! Vision Research's Phantom .cine: monochrome, 8 bit, 16 bit, and packed to 10 (P10) or 12 (P12L) bits.
//!
//! The file is a header that points at the picture's format, a Setup block that grew with the camera's software, tagged
//! blocks (time stamps, exposures), and a table of pointers to the frames.

mod blocks;
mod clock;
mod header;
mod pixels;
mod quirks;
mod setup;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use chainwave_measurement::{PlainFrame, RecordingInfo, Region};
use memmap2::Mmap;

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::file_recording::{FileRecording, PixelSource};
use crate::format::{Format, Opened, itself};
use crate::mapping::map_file;
use crate::options::OpenOptions;
use crate::partial;
use crate::read_ahead::{ask_for, ask_for_large, expect_pieces};
use blocks::Blocks;
use clock::Clock;
use header::CineHeader;
use pixels::{FRAME_HEAD_BYTES, PixelLayout};
use setup::Setup;

pub(crate) const FORMAT: Format = Format {
    name: "Phantom .cine (starts with 43 49)",
    recognises: |candidate| candidate.head.starts_with(b"CI"),
    open,
    files: itself,
};

fn open(path: &Path, options: &OpenOptions) -> Opened {
    let map = map_file(path)?;
    let bytes = Bytes::new(path, &map);
    let mut header = CineHeader::read(bytes)?;
    let setup = Setup::read(bytes, header.setup_offset)?;
    let mut layout = PixelLayout::of(bytes, &header, &setup)?;
    let mut blocks = Blocks::read(bytes, &header, &setup)?;
    let (frames, cut) = frame_offsets(bytes, &header, &layout, options)?;
    blocks.keep_first(frames.len());
    // No more frames than before, which 32 bits count.
    header.n_images = frames.len() as u32;
    let clock = Clock::of(bytes, &header, &setup, &blocks)?;
    let mut warnings = quirks::warnings(bytes, &header, &setup, &layout, &blocks, &frames);
    warnings.extend(clock.unused_rate(options));
    warnings.extend(clock.warnings);
    warnings.extend(cut);
    let overlapping = overlapping(&frames, &layout);
    warnings.extend(overlap_warning(&frames, &overlapping));
    warnings.extend(layout.take_stored_depth(bytes, frames[0]));
    let info = RecordingInfo {
        format: layout.storage.name().into(),
        width_px: layout.raster.width_px,
        height_px: layout.raster.height_px,
        n_frames: frames.len(),
        bit_depth: layout.bit_depth,
        rate_hz: clock.rate_hz,
        times_s: clock.times_s,
        first_image: header.first_image.into(),
        camera: setup.camera.clone(),
        exposure_s: blocks.exposure_s().or(setup.exposure_s),
        triggered_unix_s: header.triggered_unix_s(),
        warnings,
    };
    expect_pieces(&map);
    let images = CineImages { path: path.into(), map, layout, frames, overlapping };
    Ok(Box::new(FileRecording::new(path, info, images, options)))
}

/// The images of a .cine file.
struct CineImages {
    path: PathBuf,
    map: Mmap,
    layout: PixelLayout,
    /// Offset of each frame's head, in bytes from the start of the file.
    frames: Vec<u64>,
    /// Indices of those that lie where others do, in their order: which one is there is not known.
    overlapping: Vec<usize>,
}

impl CineImages {
    /// Where a frame's pixels begin that has no annotations, as nearly all: only what is read ahead hangs on it.
    fn first_pixel(&self, frame: usize) -> u64 {
        self.frames[frame] + FRAME_HEAD_BYTES
    }

    /// The pixels of a frame as they are stored.
    ///
    /// The size of the picture is the header's: the frame's own size word is garbage in files of at least one camera.
    fn image(&self, frame: usize) -> Result<&[u8], String> {
        let bytes = Bytes::new(&self.path, &self.map);
        let start = self.frames[frame];
        if self.overlapping.binary_search(&frame).is_ok() {
            return Err(format!(
                "image pointer at byte {start}: expected a place of its own, found pixels of another frame there"
            ));
        }
        let head = bytes.u32("frame head", start).map_err(|error| error.to_string())?;
        self.layout.pixels(bytes, start, head).ok_or_else(|| {
            let n_bytes = self.layout.frame_bytes;
            format!(
                "annotation size at byte {start}: expected {FRAME_HEAD_BYTES} or more with {n_bytes} bytes of pixels \
                 behind it, found {head}"
            )
        })
    }
}

impl PixelSource for CineImages {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        let image = self.image(frame)?;
        ask_for_large(&self.map, &self.layout.raster, self.first_pixel(frame), region);
        Ok(self.layout.raster.unpack(image, region, pixels))
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        ask_for(&self.map, &self.layout.raster, frames.map(|frame| self.first_pixel(frame)), regions);
    }

    fn plain_frame(&self, frame: usize) -> Option<PlainFrame<'_>> {
        self.layout.raster.plain_frame(self.image(frame).ok()?)
    }
}

/// Reads the table of pointers and checks that the file has room for every frame; of a file that is cut short, the frames
/// before the first that is not whole where `options` ask for them, and a warning.
fn frame_offsets(
    bytes: Bytes,
    header: &CineHeader,
    layout: &PixelLayout,
    options: &OpenOptions,
) -> Result<(Vec<u64>, Option<String>), CameraError> {
    let count = u64::from(header.n_images);
    let table =
        bytes.slice("image pointers", header.pointers_offset, count * header.pointer_width.bytes())?;
    let mut frames = header.pointer_width.decode(table);
    let n_stated = frames.len();
    let size = layout.frame_bytes.saturating_add(FRAME_HEAD_BYTES);
    let room = |(index, &start): (usize, &u64)| bytes.slice(format_args!("image {index}"), start, size).err();
    if let Some(error) = frames.iter().enumerate().find_map(room) {
        if !partial::forgives(options, &error) {
            return Err(error);
        }
        frames.truncate(frames.iter().enumerate().position(|frame| room(frame).is_some()).unwrap_or(0));
        if frames.is_empty() {
            return Err(error);
        }
    }
    // Annotations make a frame longer than it is at least; where frames follow each other, the last one tells.
    while let Some(error) =
        frames.last().and_then(|&start| unannotated(bytes, start, frames.len() - 1, layout))
    {
        if frames.len() == 1 || !partial::forgives(options, &error) {
            return Err(error);
        }
        frames.pop();
    }
    let cut = (frames.len() < n_stated).then(|| partial::warning(frames.len(), Some(n_stated)));
    Ok((frames, cut))
}

/// The frames whose pixels overlap those of others, by index: of a table of pointers that is damaged.
fn overlapping(frames: &[u64], layout: &PixelLayout) -> Vec<usize> {
    let size = layout.frame_bytes.saturating_add(FRAME_HEAD_BYTES);
    let mut by_place: Vec<usize> = (0..frames.len()).collect();
    by_place.sort_by_key(|frame| frames[*frame]);
    let pairs = by_place.windows(2).filter(|pair| frames[pair[1]] - frames[pair[0]] < size);
    let found: BTreeSet<usize> = pairs.flatten().copied().collect();
    found.into_iter().collect()
}

fn overlap_warning(frames: &[u64], overlapping: &[usize]) -> Option<String> {
    let first = *overlapping.first()?;
    Some(format!(
        "{} frames lie where others do, the first of them frame {first}, whose pointer says byte {}: none of them is read (hint: the table of image \
         pointers is damaged; copy the file from the camera again)",
        overlapping.len(),
        frames[first]
    ))
}

/// The error for a frame whose annotations leave no room for its pixels before the file ends.
fn unannotated(bytes: Bytes, start: u64, index: usize, layout: &PixelLayout) -> Option<CameraError> {
    let head = match bytes.u32("frame head", start) {
        Ok(head) => u64::from(head),
        Err(error) => return Some(error),
    };
    bytes.slice(format_args!("pixels of image {index}"), start + head, layout.frame_bytes).err()
}
