//! AVI whose frames are uncompressed gray of eight bits: read where they lie, without a decoder.
//!
//! A RIFF file is chunks of a name, a size and that many bytes, some of them lists of chunks. The first stream of type `vids` has its rate in
//! `strh` and its picture in `strf`, a Windows bitmap header: pixels named Y800, Y8 or GREY lie from the top, a palette of grays from the
//! bottom and in rows of whole words. Frames are the chunks `NNdb` and `NNdc` of the lists `movi`.

use std::ops::Range;
use std::path::{Path, PathBuf};

use chainwave_measurement::{PlainFrame, Region};
use memmap2::Mmap;

use super::timing;
use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::file_recording::{FileRecording, PixelSource, without_camera};
use crate::format::Opened;
use crate::mapping::map_file;
use crate::options::OpenOptions;
use crate::packing::Packing;
use crate::partial;
use crate::picture::PictureShape;
use crate::raster::Raster;
use crate::read_ahead::{ask_for, ask_for_large, expect_pieces};

/// Bytes of a chunk's name and size, and of a list's name behind them.
const CHUNK_HEAD_BYTES: u64 = 8;
const LIST_NAME_BYTES: u64 = 4;
/// Bytes of a bitmap header that are looked at; a palette follows what it says of itself.
const BITMAP_HEAD_BYTES: u64 = 40;

/// What the header of such a file says; `None` where a decoder has to look at it.
struct Header {
    /// Number of the stream of pictures, as its chunks are named.
    stream: [u8; 2],
    rate_hz: Option<f64>,
    width_px: usize,
    height_px: usize,
    bottom_row_first: bool,
    /// Whether rows are filled up to whole words; `None` where a frame's size has to tell.
    is_padded: Option<bool>,
    /// Frames that the file states.
    n_stated: usize,
}

/// Whether a file holds uncompressed gray of eight bits.
pub(super) fn is_plain(path: &Path) -> bool {
    map_file(path).is_ok_and(|map| Header::of(Bytes::new(path, &map)).is_some())
}

/// Opens such a file; `None` where a decoder has to look at it.
pub(super) fn open(path: &Path, options: &OpenOptions) -> Option<Opened> {
    let map = map_file(path).ok()?;
    let header = Header::of(Bytes::new(path, &map))?;
    Some(opened(path, map, &header, options))
}

fn opened(path: &Path, map: Mmap, header: &Header, options: &OpenOptions) -> Opened {
    let Header { width_px, height_px, n_stated, .. } = *header;
    let stored = Stored::of(Bytes::new(path, &map), header)?;
    let timing = timing(stored.steps.iter().copied(), options, header.rate_hz.unwrap_or(0.0));
    let mut remarks = Vec::new();
    let n_frames = stored.frames.len();
    if stored.is_cut || n_frames + stored.missing.len() < n_stated {
        remarks.push(partial::warning(n_frames, Some(n_stated).filter(|n_stated| *n_stated > n_frames)));
    }
    remarks.extend(missing_warning(&stored.missing));
    let shape = PictureShape { width_px, height_px, bits: 8 };
    let info = without_camera("AVI, uncompressed 8 bit gray".into(), shape, timing, remarks);
    expect_pieces(&map);
    let images = Images { path: path.into(), map, raster: stored.raster, frames: stored.frames };
    Ok(Box::new(FileRecording::new(path, info, images, options)))
}

impl Header {
    fn of(bytes: Bytes) -> Option<Self> {
        let riff = Chunk::at(bytes, 0)?;
        let header = riff.list(bytes, b"AVI ")?.find(|chunk| chunk.is_list(bytes, b"hdrl"))?;
        let streams = header.list(bytes, b"hdrl")?.filter(|chunk| chunk.is_list(bytes, b"strl"));
        let parts = |stream: &Chunk| {
            let of = |name: &[u8; 4]| stream.list(bytes, b"strl")?.find(|chunk| chunk.name == *name);
            Some((of(b"strh")?, of(b"strf")?))
        };
        streams
            .enumerate()
            .find_map(|(number, stream)| {
                let (stream, picture) = parts(&stream)?;
                let is_video = bytes.slice("stream type", stream.inside.start, 4).ok()? == b"vids";
                is_video.then_some((number, stream, picture))
            })
            .and_then(|(number, stream, picture)| Self::of_stream(bytes, number, &stream, &picture))
    }

    fn of_stream(bytes: Bytes, number: usize, stream: &Chunk, picture: &Chunk) -> Option<Self> {
        let of_stream = |offset: u64| bytes.u32("stream header", stream.inside.start + offset).ok();
        let at = picture.inside.start;
        let of_picture = |offset: u64| bytes.i32("picture header", at + offset).ok();
        let (width, height) = (of_picture(4)?, of_picture(8)?);
        let bits = bytes.u16("bits of a pixel", at + 14).ok()?;
        let code = bytes.slice("codec", at + 16, 4).ok()?;
        let is_top_down = [b"Y800", b"Y8  ", b"GREY"].iter().any(|name| code == *name);
        let is_bitmap = code == [0; 4] && bits == 8 && has_gray_palette(bytes, picture);
        if !(is_top_down || is_bitmap) || number > 99 {
            return None;
        }
        let (scale, rate) = (of_stream(20)?, of_stream(24)?);
        Some(Self {
            stream: [b'0' + (number / 10) as u8, b'0' + (number % 10) as u8],
            rate_hz: (scale > 0).then(|| f64::from(rate) / f64::from(scale)),
            width_px: usize::try_from(width).ok().filter(|&side| side > 0)?,
            height_px: usize::try_from(height.unsigned_abs()).ok().filter(|&side| side > 0)?,
            bottom_row_first: is_bitmap && height > 0,
            is_padded: is_bitmap.then_some(true),
            n_stated: of_stream(32)? as usize,
        })
    }

    /// How a frame of so many bytes lies in the file.
    fn raster(&self, n_bytes: u64) -> Option<Raster> {
        let plain = Raster::plain(Packing::Gray8, self.width_px, self.height_px)?;
        let plain = Raster { bottom_row_first: self.bottom_row_first, ..plain };
        let padded = Raster { row_bytes: plain.row_bytes.next_multiple_of(4), ..plain };
        match self.is_padded {
            Some(true) => Some(padded),
            _ => [plain, padded].into_iter().find(|raster| raster.frame_bytes() == n_bytes),
        }
        .filter(|raster| raster.frame_bytes() == n_bytes)
    }
}

/// Whether a palette gives every count its own gray.
fn has_gray_palette(bytes: Bytes, picture: &Chunk) -> bool {
    let at = picture.inside.start;
    let n_used = bytes.u32("colours", at + 32).map_or(0, |n| if n == 0 { 256 } else { n });
    let palette = bytes.slice("palette", at + BITMAP_HEAD_BYTES, 4 * u64::from(n_used));
    let room = picture.inside.end - at >= BITMAP_HEAD_BYTES + 4 * u64::from(n_used);
    let is_gray = |(count, entry): (usize, &[u8])| entry[..3].iter().all(|&tone| usize::from(tone) == count);
    n_used == 256 && room && palette.is_ok_and(|palette| palette.chunks_exact(4).enumerate().all(is_gray))
}

/// The frames that a file holds.
struct Stored {
    raster: Raster,
    /// Offset of the pixels of each, in bytes from the start of the file.
    frames: Vec<u64>,
    /// Frame intervals from the first to each.
    steps: Vec<u64>,
    /// Frames of which a chunk without pixels is kept.
    missing: Vec<u64>,
    /// Whether the file ends within a frame.
    is_cut: bool,
}

impl Stored {
    fn of(bytes: Bytes, header: &Header) -> Result<Self, CameraError> {
        let (mut chunks, mut is_cut) = (Vec::new(), false);
        let mut at = 0;
        while let Some(chunk) = Chunk::at(bytes, at) {
            let holds_frames =
                [b"AVI ", b"AVIX", b"movi", b"rec "].iter().any(|name| chunk.is_list(bytes, name));
            if holds_frames {
                at = chunk.inside.start + LIST_NAME_BYTES;
                continue;
            }
            let [tens, ones, kind @ ..] = chunk.name;
            if [tens, ones] == header.stream && (kind == *b"db" || kind == *b"dc") {
                is_cut |= chunk.inside.end > bytes.len();
                chunks.push(chunk.inside.clone());
            }
            at = chunk.next();
        }
        if is_cut {
            chunks.pop();
        }
        let size = |chunk: &Range<u64>| chunk.end - chunk.start;
        let first = chunks.iter().find(|chunk| size(chunk) > 0);
        let Some(first) = first else {
            let expected = format_args!("frames of {} x {} px", header.width_px, header.height_px);
            return Err(bytes.malformed("frames", 0, expected, "none that is whole"));
        };
        let raster = header.raster(size(first)).ok_or_else(|| {
            let expected = format_args!("{} x {} bytes", header.width_px, header.height_px);
            bytes.malformed("size of a frame", first.start, expected, size(first))
        })?;
        let mut stored = Self { raster, frames: Vec::new(), steps: Vec::new(), missing: Vec::new(), is_cut };
        for (step, chunk) in (0..).zip(&chunks) {
            match size(chunk) {
                0 => stored.missing.push(step),
                n_bytes if n_bytes == stored.raster.frame_bytes() => {
                    stored.frames.push(chunk.start);
                    stored.steps.push(step);
                }
                n_bytes => {
                    let expected = format_args!("{} bytes", stored.raster.frame_bytes());
                    return Err(bytes.malformed(
                        format_args!("size of frame {step}"),
                        chunk.start,
                        expected,
                        n_bytes,
                    ));
                }
            }
        }
        Ok(stored)
    }
}

/// What is said of frames that the recorder has left out.
fn missing_warning(missing: &[u64]) -> Option<String> {
    let first = missing.first()?;
    Some(format!(
        "{} frames were left out by the recorder, frame {first} first: nothing is kept of them, and the times of the others are theirs",
        missing.len()
    ))
}

/// A chunk of a RIFF file.
#[derive(Debug, Clone)]
struct Chunk {
    name: [u8; 4],
    /// Its bytes, from the start of the file: the file may end before them.
    inside: Range<u64>,
}

impl Chunk {
    fn at(bytes: Bytes, at: u64) -> Option<Self> {
        let name = *bytes.slice("chunk", at, 4).ok()?.first_chunk()?;
        let size = u64::from(bytes.u32("size of a chunk", at + 4).ok()?);
        let start = at + CHUNK_HEAD_BYTES;
        // Zeros where a disk was full are no chunks.
        let is_name = name.iter().all(|letter| letter.is_ascii_graphic() || *letter == b' ');
        is_name.then_some(Self { name, inside: start..start + size })
    }

    fn next(&self) -> u64 {
        self.inside.end.next_multiple_of(2)
    }

    fn is_list(&self, bytes: Bytes, name: &[u8; 4]) -> bool {
        [b"RIFF", b"LIST"].contains(&&self.name)
            && bytes.slice("list", self.inside.start, LIST_NAME_BYTES).is_ok_and(|found| found == name)
    }

    /// The chunks of a list of this name. Programs that stop early leave no size: such a list ends with the file.
    fn list<'a>(&self, bytes: Bytes<'a>, name: &[u8; 4]) -> Option<impl Iterator<Item = Self> + use<'a>> {
        self.is_list(bytes, name).then(|| {
            let start = self.inside.start + LIST_NAME_BYTES;
            let stated = self.inside.end;
            let end = if stated <= start { bytes.len() } else { stated.min(bytes.len()) };
            let from = move |at: u64| Self::at(bytes, at).filter(|_| at < end);
            std::iter::successors(from(start), move |chunk| from(chunk.next()))
        })
    }
}

/// The frames of a file.
struct Images {
    path: PathBuf,
    map: Mmap,
    raster: Raster,
    /// Offset of each frame's pixels, in bytes from the start of the file.
    frames: Vec<u64>,
}

impl Images {
    fn image(&self, frame: usize) -> Result<&[u8], CameraError> {
        Bytes::new(&self.path, &self.map).slice("pixels", self.frames[frame], self.raster.frame_bytes())
    }
}

impl PixelSource for Images {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        let image = self.image(frame).map_err(|error| error.to_string())?;
        ask_for_large(&self.map, &self.raster, self.frames[frame], region);
        Ok(self.raster.unpack(image, region, pixels))
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        ask_for(&self.map, &self.raster, frames.map(|frame| self.frames[frame]), regions);
    }

    fn plain_frame(&self, frame: usize) -> Option<PlainFrame<'_>> {
        self.raster.plain_frame(self.image(frame).ok()?)
    }
}
