//! Folders of TIFF, PNG or BMP images, one frame each, in the order of the numbers in their names; and single PNG and BMP
//! images.
//!
//! Opening a folder reads the names and the first image. An image that is damaged or of another size is an error when its frame
//! is read.

mod numbering;

use std::path::{Path, PathBuf};

use chainwave_measurement::{RecordingInfo, Region};

use crate::cache::FrameCache;
use crate::candidate::{files_in, read_head};
use crate::file_recording::{FileRecording, PixelSource};
use crate::picture::Picture;
use crate::timing::{Timing, unstated_depth};
use crate::{CameraError, Format, OpenOptions, Opened, bmp, png, tiff};
use numbering::Numbering;

pub(crate) const FOLDER: Format = Format {
    name: "folder of TIFF, PNG or BMP images",
    recognises: |candidate| candidate.is_folder,
    open: open_folder,
};

pub(crate) const IMAGE: Format = Format {
    name: "PNG or BMP image",
    recognises: |candidate| Kind::of(&candidate.head).is_some(),
    open: |path, options| open(path, vec![path.into()], &Numbering::single(), options),
};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Tiff,
    Png,
    Bmp,
}

impl Kind {
    fn of(head: &[u8]) -> Option<Self> {
        if tiff::is_tiff(head) {
            Some(Self::Tiff)
        } else if head.starts_with(png::MAGIC) {
            Some(Self::Png)
        } else if bmp::is_bmp(head) {
            Some(Self::Bmp)
        } else {
            None
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Tiff => "tiff",
            Self::Png => "png",
            Self::Bmp => "bmp",
        }
    }
}

/// Opens an image of whatever kind its first bytes say.
fn load(path: &Path) -> Result<(Kind, Picture), CameraError> {
    let head = read_head(path)?;
    let picture = |kind, picture: Result<Picture, CameraError>| picture.map(|picture| (kind, picture));
    match Kind::of(&head) {
        Some(Kind::Tiff) => picture(Kind::Tiff, tiff::load(path)),
        Some(Kind::Png) => picture(Kind::Png, png::load(path)),
        Some(Kind::Bmp) => picture(Kind::Bmp, bmp::load(path)),
        None => Err(CameraError::Malformed {
            path: path.into(),
            what: "image".into(),
            offset: 0,
            expected: "the start of a TIFF, PNG or BMP image".into(),
            found: "other bytes".into(),
        }),
    }
}

fn open_folder(path: &Path, options: &OpenOptions) -> Opened {
    let mut images = Vec::new();
    for file in files_in(path)? {
        if let Some(kind) = Kind::of(&read_head(&file)?) {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            images.push((kind, name, file));
        }
    }
    let names: Vec<(Kind, &str)> = images.iter().map(|(kind, name, _)| (*kind, name.as_str())).collect();
    let numbering = Numbering::of(&names).map_err(|(what, hint)| CameraError::Unsupported {
        path: path.into(),
        what,
        hint,
    })?;
    let files = numbering.order.iter().map(|&index| images[index].2.clone()).collect();
    open(path, files, &numbering, options)
}

fn open(path: &Path, files: Vec<PathBuf>, numbering: &Numbering, options: &OpenOptions) -> Opened {
    let (kind, first) = load(&files[0])?;
    let shape @ (width_px, height_px, bit_depth) = first.shape();
    let timing = Timing::of(numbering.steps.iter().copied(), options, None);
    let mut warnings = vec![timing.warning];
    warnings.extend(unstated_depth(bit_depth));
    warnings.extend(numbering.warnings.iter().cloned());
    let extent = if path.is_dir() { "series" } else { "image" };
    let info = RecordingInfo {
        format: format!("{} {extent} {bit_depth} bit", kind.name()),
        width_px,
        height_px,
        n_frames: files.len(),
        bit_depth,
        rate_hz: timing.rate_hz,
        times_s: timing.times_s,
        first_image: numbering.first,
        camera: None,
        exposure_s: None,
        warnings,
    };
    let images = Images { files, cache: FrameCache::new(()), shape };
    Ok(Box::new(FileRecording::new(path, info, images, options)))
}

/// Images of one size, one frame each.
struct Images {
    files: Vec<PathBuf>,
    cache: FrameCache<(), Picture>,
    /// Width, height and bits of a pixel.
    shape: (usize, usize, u32),
}

impl Images {
    fn picture(&self, frame: usize) -> Result<Picture, String> {
        let (_, picture) = load(&self.files[frame]).map_err(|error| error.to_string())?;
        if picture.shape() != self.shape {
            let text = |(width, height, bits)| format!("{width} x {height} px of {bits} bits");
            let (expected, found) = (text(self.shape), text(picture.shape()));
            return Err(format!("{}: expected {expected}, found {found}", self.files[frame].display()));
        }
        Ok(picture)
    }
}

impl PixelSource for Images {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        let picture = self.cache.get(frame, |()| self.picture(frame))?;
        Ok(picture.unpack(region, pixels))
    }
}
