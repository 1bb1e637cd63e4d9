//! A TIFF of one or many images as a recording, with the stack's description by ImageJ or OME.

use std::path::Path;

use chainwave_measurement::{RecordingInfo, Region};
use memmap2::Mmap;

use super::coded::CodedImages;
use super::description::Description;
use super::directory::{Directory, Reader};
use super::page::{Page, PageStorage, SAMPLES};
use crate::bytes::Bytes;
use crate::cache::FrameCache;
use crate::error::CameraError;
use crate::file_recording::{FileRecording, PixelSource, without_camera};
use crate::flat::FlatFrames;
use crate::format::Opened;
use crate::mapping::map_file;
use crate::options::OpenOptions;
use crate::partial;
use crate::picture::{Gray, PictureShape, Strips};
use crate::raster::Raster;
use crate::timing::{Timing, unstated_depth};

const DESCRIPTION: u16 = 270;

/// Opens the images of one TIFF file.
pub(super) fn open(path: &Path, options: &OpenOptions) -> Opened {
    let map = map_file(path)?;
    let reader = Reader::new(Bytes::new(path, &map))?;
    let mut directories = Vec::new();
    let mut ended = reader.walk(&mut directories).err();
    if let Some(error) = ended.take_if(|error| directories.is_empty() || !partial::forgives(options, error)) {
        return Err(error);
    }
    let first = directories.first().ok_or_else(|| reader.no_image())?;
    let text = reader.text(first, DESCRIPTION).unwrap_or_default();
    let description = Description::of(&text);
    let n_samples = reader.value(first, SAMPLES)?.unwrap_or(1);
    if let Some((what, hint)) = description.refusal(usize::try_from(n_samples).unwrap_or(1)) {
        return Err(CameraError::Unsupported { path: path.into(), what, hint });
    }
    let mut images = StackImages::read(&reader, &directories, options)?;
    if ended.is_some() {
        images.is_cut = true;
    }
    images.add_imagej_frames(reader.bytes, &description, options)?;
    images.expect_stated(&reader, first, &description, options)?;
    let info = images.info(&description, options);
    let pixels = images.pixels(path, map)?;
    Ok(Box::new(FileRecording::new(path, info, pixels, options)))
}

enum Pixels {
    /// Every frame lies in the file as it is.
    Plain { map: Mmap, raster: Raster, frames: Vec<Strips> },
    /// Frames are decoded, each from the directory of its number.
    Coded { cache: Box<FrameCache<CodedImages, Gray>>, directories: Vec<usize>, shape: PictureShape },
}

impl PixelSource for Pixels {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        match self {
            Self::Plain { map, raster, frames } => Ok(frames[frame].unpack(map, raster, region, pixels)),
            Self::Coded { cache, directories, shape } => {
                let decode = |decoder: &mut CodedImages| {
                    decoder.image(directories[frame], *shape).map_err(|refusal| refusal.to_string())
                };
                cache.get(frame, decode)?.copy(region, pixels);
                Ok(0)
            }
        }
    }
}

/// The images of a file that are frames: all of one size, and no thumbnails.
struct StackImages {
    shape: PictureShape,
    /// Number of each frame's directory.
    directories: Vec<usize>,
    /// The rows of frames that need no decoding, and where each such frame's rows lie.
    raster: Option<Raster>,
    plain: Vec<Strips>,
    n_thumbnails: usize,
    /// The file ends before its last frame.
    is_cut: bool,
}

impl StackImages {
    /// The frames of the directories; of a file that is cut short, those before the first that is not whole where `options` ask
    /// for them.
    fn read(reader: &Reader, directories: &[Directory], options: &OpenOptions) -> Result<Self, CameraError> {
        let mut images: Option<Self> = None;
        let mut n_thumbnails = 0;
        for (number, directory) in directories.iter().enumerate() {
            let page = match (Page::read(reader, directory), &mut images) {
                (Err(error), Some(images)) if partial::forgives(options, &error) => {
                    images.is_cut = true;
                    break;
                }
                (page, _) => page?,
            };
            if page.is_thumbnail {
                n_thumbnails += 1;
            } else {
                let images = images.get_or_insert_with(|| Self::none(page.shape));
                images.add(page, number).map_err(|(expected, found)| {
                    reader.bytes.malformed("image", directory.offset, expected, found)
                })?;
                if images.plain_bytes() > reader.bytes.len() {
                    let expected = "images apart from each other";
                    return Err(reader.bytes.malformed("image", directory.offset, expected, "overlap"));
                }
            }
        }
        images.map(|images| Self { n_thumbnails, ..images }).ok_or_else(|| reader.no_image())
    }

    fn none(shape: PictureShape) -> Self {
        Self {
            shape,
            directories: Vec::new(),
            raster: None,
            plain: Vec::new(),
            n_thumbnails: 0,
            is_cut: false,
        }
    }

    /// Takes an image as the next frame, or says what was expected and found.
    fn add(&mut self, page: Page, number: usize) -> Result<(), (String, String)> {
        if page.shape != self.shape {
            return Err((format!("{}, as the first", self.shape), page.shape.to_string()));
        }
        self.directories.push(number);
        if let PageStorage::Plain { raster, strips } = page.storage {
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
    fn add_imagej_frames(
        &mut self,
        bytes: Bytes,
        description: &Description,
        options: &OpenOptions,
    ) -> Result<(), CameraError> {
        if let (Some(raster), [frame], [_], Some(n_frames)) =
            (&self.raster, self.plain.as_slice(), self.directories.as_slice(), description.n_images())
            && let Some(start) = frame.in_one_piece()
        {
            let (n_frames, cut) = FlatFrames::n_whole(bytes, raster, start, n_frames, options)?;
            self.is_cut |= cut.is_some();
            let starts = (0..n_frames as u64).map(|index| start + index * raster.frame_bytes());
            self.plain = starts.map(|start| Strips::whole(raster, start)).collect();
            self.directories = vec![0; n_frames];
        }
        Ok(())
    }

    /// Refuses fewer frames than the description states, unless `options` ask for those that are there.
    fn expect_stated(
        &mut self,
        reader: &Reader,
        first: &Directory,
        description: &Description,
        options: &OpenOptions,
    ) -> Result<(), CameraError> {
        let found = self.directories.len();
        let Some(n_stated) = description.n_images().filter(|&n_stated| n_stated > found) else {
            return Ok(());
        };
        if !options.partial {
            let expected = format_args!("{n_stated}, as the description states");
            let found = format_args!("{found} (those of a file that was cut are read on request)");
            return Err(reader.bytes.malformed("number of images", first.offset, expected, found));
        }
        self.is_cut = true;
        Ok(())
    }

    fn info(&self, description: &Description, options: &OpenOptions) -> RecordingInfo {
        let bit_depth = self.shape.bits;
        let n_frames = self.directories.len();
        let (stated_hz, unknown_unit) = match description.rate_hz() {
            Ok(stated_hz) => (stated_hz, None),
            Err(warning) => (None, Some(warning)),
        };
        let timing = Timing::of(0..n_frames as u64, options, stated_hz);
        let mut remarks: Vec<String> = unknown_unit.into_iter().collect();
        if self.is_cut {
            remarks.push(partial::warning(n_frames, description.n_images()));
        }
        remarks.extend(unstated_depth(bit_depth));
        if self.n_thumbnails > 0 {
            remarks.push(format!("{} reduced copies of images are left out", self.n_thumbnails));
        }
        without_camera(format!("tiff {bit_depth} bit"), self.shape, timing, remarks)
    }

    fn pixels(self, path: &Path, map: Mmap) -> Result<Pixels, CameraError> {
        match self.raster {
            Some(raster) if self.plain.len() == self.directories.len() => {
                Ok(Pixels::Plain { map, raster, frames: self.plain })
            }
            _ => {
                let mut decoder = CodedImages::open(path, self.shape.n_pixels())
                    .map_err(|reason| CameraError::Decoder { path: path.into(), reason })?;
                // Whether the pictures are gray shows only when one is decoded.
                let first = self.directories.first().copied().unwrap_or(0);
                decoder.image(first, self.shape).map_err(|refusal| refusal.of(path))?;
                let cache = Box::new(FrameCache::new(decoder));
                Ok(Pixels::Coded { cache, directories: self.directories, shape: self.shape })
            }
        }
    }
}
