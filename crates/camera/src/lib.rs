//! Foreign recordings -> [`Recording`]: pixels by region, time stamps, and what a careful reader should know of the
//! file.
//!
//! | recording | depth | reading a region costs |
//! |---|---|---|
//! | Phantom .cine | 8, 16 bit, P10, P12L | its rows |
//! | Photron .mraw with .cih or .cihx, opened by either | 8, 10, 12, 16 bit | its rows |
//! | TIFF, BigTIFF, ImageJ stacks | 8 to 16 bit | its rows; compressed: the frame, once |
//! | folder of TIFF, PNG, BMP, JPEG or PGM images, or one of them | 8, 16 bit; PGM 1 to 16 | as above |
//! | NumPy .npy | 8, 16 bit | its rows |
//! | pixels without a header, of a stated [`RawGeometry`] | 8 to 16 bit | its rows |
//! | AVI of uncompressed 8-bit gray (Y800, GREY, a palette of grays) | 8 bit | its rows |
//! | other AVI, MP4, Matroska, by a [`VisionLibrary`] | the codec's; above 8 bits by the program `ffmpeg` | the frame, once |
//!
//! - **One file per format.** [`open`] asks each entry of `FORMATS` whether a path is its own, by the first bytes of the
//!   file. The name decides only where no bytes can: a .mraw holds nothing but pixels. To add a format, write a
//!   module with a `FORMAT` constant (a name, how to recognise it, how to open it) and add one line to that list. Opening
//!   gives a `FileRecording`: what the file says of itself, and a `PixelSource`, which has one thing to do. Frames that lie back to
//!   back need no more than a header: `flat` reads them; `raster` and `packing` unpack rows; `cache` keeps what was decoded;
//!   `timing` gives times to what has no clock.
//! - **Read only what is looked at.** Uncompressed recordings are memory-mapped and opening one reads the header alone,
//!   so that a region costs its rows; [`ByteCounter`] counts them. Of frames back to back and of .cine files the system reads from
//!   a disk what [`Recording::will_read`] foretells, and what is touched. Compressed
//!   recordings decode a frame once for all its regions.
//! - **Linear counts as recorded.** Companded pixels are linearised, because a tracker needs counts proportional to
//!   light; display settings (gain, gamma, flips, crops) never touch pixels, and a [`Calibration`] only coordinates.
//! - **Nothing in a file is believed.** Every offset and size goes through one checked reader before it is used, and
//!   nothing is allocated that the file is too short to fill. What contradicts itself becomes a warning when the
//!   pixels are still certain, and otherwise an error that names the place.
//! - **No time is invented.** Where neither the file nor the caller ([`OpenOptions`]) knows a frame rate, it is `None`,
//!   and times count frames.
//!
//! - **Only what belongs to the light.** [`SensorCorrection`] takes the dark level, the gain and the defects of a sensor out of
//!   what is read ([`Corrected`]), from files that the user has or from scenes at rest. What it rests on has an uncertainty, which
//!   all frames share.
//!
//! - **Libraries stay outside.** Decoding videos and finding the corners of boards is a [`VisionLibrary`]'s work, which a program registers
//!   if it has one; `chainwave-opencv` does. Everything else is this crate's own.
//!
//! What is tracked in the pictures is no matter of this crate. Its files import each other in one direction: readers of formats
//! what they share (`bytes`, `raster`, `picture`, `file_recording`), and the list of formats below the readers; a module's parts may
//! use the types that the module's own file defines.
//!
//! ```
//! use chainwave_camera::open;
//! use chainwave_measurement::Region;
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("strike.pgm");
//! # std::fs::write(&path, b"P5 4 2 255 \x0A\x14\x1E\x28\x32\x3C\x46\x50")?;
//! let recording = open(&path)?;
//! let info = recording.info();
//! assert_eq!((info.width_px, info.height_px, info.n_frames, info.bit_depth), (4, 2, 1, 8));
//!
//! // Two columns of both rows, from the second column on.
//! let region = Region { x: 1, y: 0, width: 2, height: 2 };
//! let mut counts = vec![0.0; region.n_pixels()];
//! recording.read_region(0, region, &mut counts)?;
//! assert_eq!(counts, [20.0, 30.0, 60.0, 70.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bmp;
mod board;
mod bytes;
mod cache;
mod calibration;
mod candidate;
mod cine;
mod corners;
mod error;
mod file_recording;
mod flat;
mod format;
mod jpeg;
mod library;
mod linearise;
mod mapping;
mod mraw;
mod name_list;
mod npy;
mod options;
mod packing;
mod partial;
mod pgm;
mod picture;
mod png;
mod raster;
mod raw;
mod raw_geometry;
mod read_ahead;
mod sensor;
mod series;
mod stated_depth;
mod survey;
mod tiff;
mod timing;
mod unsupported;
mod video;

use std::path::{Path, PathBuf};

use chainwave_measurement::Recording;

pub use board::{Board, Corner, Markers};
pub use calibration::{Calibration, Lens, MapError, Mark, PlaneMap, Source};
use candidate::Candidate;
pub use corners::find_corners;
pub use error::CameraError;
use format::{Format, itself};
pub use library::{OpenedVideo, VideoFrames, VisionLibrary, register_vision, vision_library};
pub use options::{ByteCounter, OpenOptions};
pub use raw::open_raw;
pub use raw_geometry::RawGeometry;
pub use sensor::{Corrected, Defect, DefectKind, DefectMap, PixelStatistics, SensorCorrection};
pub use survey::{
    ContactSheet, GrayFrame, Histogram, NoiseEstimate, Saturation, SheetLayout, contact_sheet, gray_frame,
    gray_frames, histogram, noise,
};

/// The formats, in the order in which they are asked.
const FORMATS: &[Format] =
    &[cine::FORMAT, tiff::FORMAT, npy::FORMAT, series::IMAGE, series::FOLDER, video::FORMAT, mraw::FORMAT];

/// Opens a recording whose format is found from its first bytes, as [`open_with`] does with nothing else known of it.
///
/// # Errors
/// As [`open_with`].
pub fn open(path: &Path) -> Result<Box<dyn Recording>, CameraError> {
    open_with(path, &OpenOptions::default())
}

/// Opens a recording whose format is found from its first bytes.
///
/// # Errors
/// [`CameraError`] when the file cannot be read, is of no known format, is in colour, contradicts itself, or ends
/// before its last frame (unless [`OpenOptions::partial`] asks for the whole ones), and when the frame rate in `options` is none.
pub fn open_with(path: &Path, options: &OpenOptions) -> Result<Box<dyn Recording>, CameraError> {
    options.check(path)?;
    if let Some(geometry) = options.raw {
        return open_raw(path, geometry, options);
    }
    let candidate = Candidate::read(path)?;
    match FORMATS.iter().find(|format| (format.recognises)(&candidate)) {
        Some(format) => (format.open)(path, options),
        None => Err(unsupported::refusal(&candidate).unwrap_or_else(|| unknown_format(&candidate))),
    }
}

/// What is said of each format that can be read.
pub fn format_names() -> Vec<&'static str> {
    FORMATS.iter().map(|format| format.name).collect()
}

/// The files that a recording consists of: itself; those in a folder, by name, without hidden ones, and behind them the .cih or .cihx beside the
/// folder; of a Photron recording its header and its pixels, whichever of them was named. A file of no known format, and one of a pair whose other file is missing, is taken for itself alone.
///
/// # Errors
/// A file or folder that cannot be read.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>, CameraError> {
    let candidate = Candidate::read(path)?;
    let format = FORMATS.iter().find(|format| (format.recognises)(&candidate));
    format.map_or(itself as fn(&Path) -> _, |format| format.files)(path)
}

/// Whether a recording is one that a [`VisionLibrary`] must decode, and the program has brought none. What cannot be read needs
/// none: opening it says why.
pub fn needs_opencv(path: &Path, options: &OpenOptions) -> bool {
    let takes_library = |candidate: Candidate<'_>| video::takes_library(&candidate);
    vision_library().is_none() && options.raw.is_none() && Candidate::read(path).is_ok_and(takes_library)
}

fn unknown_format(candidate: &Candidate) -> CameraError {
    let first: Vec<String> = candidate.head.iter().take(8).map(|byte| format!("{byte:02X}")).collect();
    let names: Vec<&str> = FORMATS.iter().map(|format| format.name).collect();
    CameraError::UnknownFormat {
        path: candidate.path.into(),
        found: match (candidate.is_folder, first.is_empty()) {
            (true, _) => match recordings_within(candidate.path) {
                0 => "a folder".into(),
                1 => "a folder that holds a recording: name that".into(),
                n => format!("a folder that holds {n} recordings: name one of them"),
            },
            (false, true) => "an empty file".into(),
            (false, false) => format!("bytes {}", first.join(" ")),
        },
        readable: format!(
            "{}; pixels without a header, where their geometry is stated, such as 1280x800x12le",
            names.join("; ")
        ),
    }
}

/// How many files of a folder one format reads each by itself.
fn recordings_within(folder: &Path) -> usize {
    let is_recording = |path: &PathBuf| {
        Candidate::read(path).is_ok_and(|file| FORMATS.iter().any(|format| (format.recognises)(&file)))
    };
    candidate::files_in(folder).map_or(0, |files| files.iter().filter(|path| is_recording(path)).count())
}
