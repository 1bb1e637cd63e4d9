//! Folders of TIFF, PNG, BMP, JPEG or PGM images, one frame each, in the order of the numbers in their names; and such images
//! alone.
//!
//! Opening a folder reads the names and the first image. An image that is damaged or of another size is an error when its frame
//! is read.

mod numbering;
mod schedule;

use std::path::{Path, PathBuf};

use chainwave_measurement::{RecordingInfo, Region};

use crate::cache::FrameCache;
use crate::candidate::{files_in, has_extension, read_head};
use crate::error::CameraError;
use crate::file_recording::{FileRecording, PixelSource, without_camera};
use crate::format::{Format, Opened, itself};
use crate::mraw::header_beside;
use crate::options::OpenOptions;
use crate::partial;
use crate::picture::{Picture, PictureShape};
use crate::timing::unstated_depth;
use crate::{bmp, jpeg, pgm, png, tiff};
use numbering::Numbering;
use schedule::Schedule;

pub(crate) const FOLDER: Format = Format {
    name: "folder of TIFF, PNG, BMP, JPEG or PGM images",
    recognises: |candidate| candidate.is_folder,
    open: open_folder,
    files: files_of_folder,
};

pub(crate) const IMAGE: Format = Format {
    name: "PNG, BMP, JPEG or PGM image",
    recognises: |candidate| ImageKind::of(&candidate.head).is_some(),
    open: |path, options| open(path, vec![path.into()], &Numbering::single(), options),
    files: itself,
};

/// Endings of names that promise an image.
const IMAGE_NAMES: [&str; 7] = ["tif", "tiff", "png", "bmp", "jpg", "jpeg", "pgm"];

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum ImageKind {
    Tiff,
    Png,
    Bmp,
    Jpeg,
    Pgm,
}

impl ImageKind {
    fn of(head: &[u8]) -> Option<Self> {
        if tiff::is_tiff(head) {
            Some(Self::Tiff)
        } else if head.starts_with(png::MAGIC) {
            Some(Self::Png)
        } else if bmp::is_bmp(head) {
            Some(Self::Bmp)
        } else if head.starts_with(jpeg::MAGIC) {
            Some(Self::Jpeg)
        } else if pgm::is_netpbm(head) {
            Some(Self::Pgm)
        } else {
            None
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Tiff => "tiff",
            Self::Png => "png",
            Self::Bmp => "bmp",
            Self::Jpeg => "jpeg",
            Self::Pgm => "pgm",
        }
    }
}

/// Opens an image of whatever kind its first bytes say.
fn load(path: &Path) -> Result<(ImageKind, Picture), CameraError> {
    let head = read_head(path)?;
    let picture = |kind, picture: Result<Picture, CameraError>| picture.map(|picture| (kind, picture));
    match ImageKind::of(&head) {
        Some(ImageKind::Tiff) => picture(ImageKind::Tiff, tiff::load(path)),
        Some(ImageKind::Png) => picture(ImageKind::Png, png::load(path)),
        Some(ImageKind::Bmp) => picture(ImageKind::Bmp, bmp::load(path)),
        Some(ImageKind::Jpeg) => picture(ImageKind::Jpeg, jpeg::load(path)),
        Some(ImageKind::Pgm) => picture(ImageKind::Pgm, pgm::load(path)),
        None => Err(CameraError::Malformed {
            path: path.into(),
            what: "image".into(),
            offset: 0,
            expected: "the start of a TIFF, PNG, BMP, JPEG or PGM image".into(),
            found: "other bytes".into(),
        }),
    }
}

/// The files in a folder, and the header beside it, which times come from as from one among them.
fn files_of_folder(path: &Path) -> Result<Vec<PathBuf>, CameraError> {
    let mut files = files_in(path)?;
    files.extend(header_beside(path));
    Ok(files)
}

fn open_folder(path: &Path, options: &OpenOptions) -> Opened {
    let mut images = Vec::new();
    let (mut unreadable, mut others) = (Vec::new(), Vec::new());
    for file in files_in(path)? {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match ImageKind::of(&read_head(&file)?) {
            Some(kind) => images.push((kind, name, file)),
            None if IMAGE_NAMES.iter().any(|extension| has_extension(&file, extension)) => {
                unreadable.push(name);
            }
            None => others.push(name),
        }
    }
    if let (true, Some(first)) = (images.is_empty() && unreadable.is_empty(), others.first()) {
        return Err(CameraError::Unsupported {
            path: path.into(),
            what: format!("a folder without images, of {} other files such as `{first}`,", others.len()),
            hint: "name the recordings in it one by one, or by a pattern".into(),
        });
    }
    let names: Vec<(ImageKind, &str)> = images.iter().map(|(kind, name, _)| (*kind, name.as_str())).collect();
    let mut numbering = Numbering::of(&names).map_err(|(what, hint)| CameraError::Unsupported {
        path: path.into(),
        what,
        hint,
    })?;
    if let Some(first) = unreadable.first() {
        let n = unreadable.len();
        numbering.warnings.push(format!("{n} files are named as images and hold none, such as `{first}`"));
    }
    let files = numbering.order.iter().map(|&index| images[index].2.clone()).collect();
    open(path, files, &numbering, options)
}

fn open(path: &Path, mut files: Vec<PathBuf>, numbering: &Numbering, options: &OpenOptions) -> Opened {
    let (kind, first) = load(&files[0])?;
    let shape = first.shape();
    let n_stated = files.len();
    if options.partial {
        // The copy of a folder ends in an image that is cut short, or in some that are empty.
        while files.len() > 1 && files.last().is_some_and(|file| load(file).is_err()) {
            files.pop();
        }
    }
    let schedule = Schedule::of(path, &files, numbering, options)?;
    let mut remarks = schedule.warnings;
    remarks.extend(unstated_depth(shape.bits));
    remarks.extend((kind == ImageKind::Jpeg).then(|| jpeg::LOSSY.into()));
    remarks.extend(numbering.warnings.iter().cloned());
    if files.len() < n_stated {
        remarks.push(partial::warning(files.len(), Some(n_stated)));
    }
    let extent = if path.is_dir() { "series" } else { "image" };
    let format = format!("{} {extent} {} bit", kind.name(), shape.bits);
    let info = RecordingInfo {
        first_image: schedule.first_image,
        camera: schedule.camera,
        exposure_s: schedule.exposure_s,
        ..without_camera(format, shape, schedule.timing, remarks)
    };
    let images = SeriesImages { files, cache: FrameCache::new(()), shape };
    Ok(Box::new(FileRecording::new(path, info, images, options)))
}

/// Images of one size, one frame each.
struct SeriesImages {
    files: Vec<PathBuf>,
    cache: FrameCache<(), Picture>,
    shape: PictureShape,
}

impl SeriesImages {
    fn picture(&self, frame: usize) -> Result<Picture, String> {
        let (_, picture) = load(&self.files[frame]).map_err(|error| error.to_string())?;
        if picture.shape() != self.shape {
            let (expected, found) = (self.shape, picture.shape());
            return Err(format!("{}: expected {expected}, found {found}", self.files[frame].display()));
        }
        Ok(picture)
    }
}

impl PixelSource for SeriesImages {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        let picture = self.cache.get(frame, |()| self.picture(frame))?;
        Ok(picture.unpack(region, pixels))
    }
}
