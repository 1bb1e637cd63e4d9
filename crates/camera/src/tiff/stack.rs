use std::path::Path;

use chainwave_measurement::{RecordingInfo, Region};
use memmap2::Mmap;

use super::coded::Decoder;
use super::directory::{Directory, Reader};
use super::no_image;
use super::page::{Page, Storage};
use crate::bytes::Bytes;
use crate::cache::FrameCache;
use crate::file_recording::{FileRecording, PixelSource};
use crate::flat::FlatFrames;
use crate::mapping::map_file;
use crate::picture::{Gray, Strips};
use crate::raster::Raster;
use crate::timing::{Timing, unstated_depth};
use crate::{CameraError, OpenOptions, Opened};

const DESCRIPTION: u16 = 270;

/// Opens the images of one TIFF file.
pub(super) fn open(path: &Path, options: &OpenOptions) -> Opened {
    let map = map_file(path)?;
    let reader = Reader::new(Bytes::new(path, &map))?;
    let directories = reader.directories()?;
    let first = directories.first().ok_or_else(|| no_image(&reader))?;
    let description = reader.text(first, DESCRIPTION).unwrap_or_default();
    let mut images = Images::read(&reader, &directories)?;
    images.add_imagej_frames(reader.bytes, &description)?;
    let info = images.info(stated_hz(&description), options);
    let pixels = images.pixels(path, map)?;
    Ok(Box::new(FileRecording::new(path, info, pixels, options)))
}

enum Pixels {
    /// Every frame lies in the file as it is.
    Plain { map: Mmap, raster: Raster, frames: Vec<Strips> },
    /// Frames are decoded, each from the directory of its number.
    Coded { cache: Box<FrameCache<Decoder, Gray>>, directories: Vec<usize>, shape: (usize, usize, u32) },
}

impl PixelSource for Pixels {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        match self {
            Self::Plain { map, raster, frames } => Ok(frames[frame].unpack(map, raster, region, pixels)),
            Self::Coded { cache, directories, shape } => {
                cache.get(frame, |decoder| decoder.image(directories[frame], *shape))?.copy(region, pixels);
                Ok(0)
            }
        }
    }
}

/// The images of a file that are frames: all of one size, and no thumbnails.
struct Images {
    /// Width, height and bits of a pixel.
    shape: (usize, usize, u32),
    /// Number of each frame's directory.
    directories: Vec<usize>,
    /// The rows of frames that need no decoding, and where each such frame's rows lie.
    raster: Option<Raster>,
    plain: Vec<Strips>,
    n_thumbnails: usize,
}

impl Images {
    fn read(reader: &Reader, directories: &[Directory]) -> Result<Self, CameraError> {
        let mut images: Option<Self> = None;
        let mut n_thumbnails = 0;
        for (number, directory) in directories.iter().enumerate() {
            let page = Page::read(reader, directory)?;
            if page.is_thumbnail {
                n_thumbnails += 1;
            } else {
                let shape = (page.width_px, page.height_px, page.bits);
                let images = images.get_or_insert_with(|| Self::none(shape));
                images.add(page, number).map_err(|(expected, found)| {
                    reader.bytes.malformed("image", directory.offset, expected, found)
                })?;
                if images.plain_bytes() > reader.bytes.len() {
                    let expected = "images apart from each other";
                    return Err(reader.bytes.malformed("image", directory.offset, expected, "overlap"));
                }
            }
        }
        images.map(|images| Self { n_thumbnails, ..images }).ok_or_else(|| no_image(reader))
    }

    fn none(shape: (usize, usize, u32)) -> Self {
        Self { shape, directories: Vec::new(), raster: None, plain: Vec::new(), n_thumbnails: 0 }
    }

    /// Takes an image as the next frame, or says what was expected and found.
    fn add(&mut self, page: Page, number: usize) -> Result<(), (String, String)> {
        let shape = (page.width_px, page.height_px, page.bits);
        if shape != self.shape {
            let text = |(width, height, bits)| format!("{width} x {height} px of {bits} bits");
            return Err((format!("{}, as the first", text(self.shape)), text(shape)));
        }
        self.directories.push(number);
        if let Storage::Plain { raster, strips } = page.storage {
            self.raster = Some(raster);
            self.plain.push(strips);
        }
        Ok(())
    }

    /// Bytes of the frames that need no decoding, which bounds how many there can be.
    fn plain_bytes(&self) -> u64 {
        let frame_bytes = self.raster.as_ref().map_or(0, Raster::frame_bytes);
        frame_bytes.saturating_mul(self.plain.len() as u64)
    }

    /// ImageJ describes only the first of the frames of a file above 4 GB, and how many follow it.
    fn add_imagej_frames(&mut self, bytes: Bytes, description: &str) -> Result<(), CameraError> {
        let n_frames = imagej(description, "images").and_then(|text| text.parse::<usize>().ok());
        if let (Some(raster), [frame], [_], Some(n_frames)) =
            (&self.raster, self.plain.as_slice(), self.directories.as_slice(), n_frames)
            && let Some(start) = frame.in_one_piece()
            && n_frames > 1
        {
            FlatFrames::check_room(bytes, raster, start, n_frames)?;
            let starts = (0..n_frames as u64).map(|index| start + index * raster.frame_bytes());
            self.plain = starts.map(|start| Strips::whole(raster, start)).collect();
            self.directories = vec![0; n_frames];
        }
        Ok(())
    }

    fn info(&self, stated_hz: Option<f64>, options: &OpenOptions) -> RecordingInfo {
        let (width_px, height_px, bit_depth) = self.shape;
        let n_frames = self.directories.len();
        let timing = Timing::of(0..n_frames as u64, options, stated_hz);
        let mut warnings = vec![timing.warning];
        warnings.extend(unstated_depth(bit_depth));
        if self.n_thumbnails > 0 {
            warnings.push(format!("{} reduced copies of images are left out", self.n_thumbnails));
        }
        RecordingInfo {
            format: format!("tiff {bit_depth} bit"),
            width_px,
            height_px,
            n_frames,
            bit_depth,
            rate_hz: timing.rate_hz,
            times_s: timing.times_s,
            first_image: 0,
            camera: None,
            exposure_s: None,
            warnings,
        }
    }

    fn pixels(self, path: &Path, map: Mmap) -> Result<Pixels, CameraError> {
        match self.raster {
            Some(raster) if self.plain.len() == self.directories.len() => {
                Ok(Pixels::Plain { map, raster, frames: self.plain })
            }
            _ => {
                let decoder = Decoder::open(path, self.shape.0 * self.shape.1)
                    .map_err(|reason| CameraError::Decoder { path: path.into(), reason })?;
                let cache = Box::new(FrameCache::new(decoder));
                Ok(Pixels::Coded { cache, directories: self.directories, shape: self.shape })
            }
        }
    }
}

/// A value of the description that ImageJ writes, line by line.
fn imagej<'a>(description: &'a str, key: &str) -> Option<&'a str> {
    let mut lines = description.starts_with("ImageJ=").then(|| description.lines())?;
    lines.find_map(|line| line.strip_prefix(key)?.strip_prefix('='))
}

/// Frame rate from ImageJ's frame interval.
fn stated_hz(description: &str) -> Option<f64> {
    let interval_s: f64 = imagej(description, "finterval")?.trim().parse().ok()?;
    Some(interval_s.recip()).filter(|rate_hz| rate_hz.is_finite() && *rate_hz > 0.0)
}
