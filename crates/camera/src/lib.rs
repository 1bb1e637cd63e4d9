//! Foreign recordings -> [`Recording`]: pixels by region, time stamps, and what a careful reader should know of the
//! file.
//!
//! - **One file per format.** [`open`] asks each entry of `FORMATS` whether the file's first bytes are its own; the name of
//!   the file decides nothing. A new format is a module with a `FORMAT` constant and one line in that list.
//! - **Read only what is looked at.** Uncompressed recordings are memory-mapped and opening one reads the header alone,
//!   so that a region costs its rows. Compressed recordings decode a frame once for all its regions.
//! - **Linear counts as recorded.** Companded pixels are linearised, because a tracker needs counts proportional to
//!   light; display settings (gain, gamma, flips, crops) never touch pixels.
//! - **Nothing in a file is believed.** Every offset and size goes through one checked reader before it is used, and
//!   nothing is allocated that the file is too short to fill. What contradicts itself becomes a warning when the
//!   pixels and times are still certain, and otherwise an error that names the place.
//!
//! What is tracked in the pictures is no matter of this crate.

mod bytes;
mod cine;
mod error;
mod linearise;
mod mapping;
mod video;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use chainwave_measurement::Recording;

pub use error::CameraError;

/// Bytes at the start of a file that suffice to recognise every format.
const HEAD_BYTES: u64 = 64;

/// The formats, in the order in which they are asked.
const FORMATS: &[Format] = &[cine::FORMAT, video::FORMAT];

/// A recording format: how to know it, and how to open it.
struct Format {
    name: &'static str,
    recognises: fn(head: &[u8]) -> bool,
    open: fn(&Path) -> Result<Box<dyn Recording>, CameraError>,
}

/// Opens a recording whose format is found from its first bytes.
///
/// # Errors
/// [`CameraError`] when the file cannot be read, is of no known format, is in colour, contradicts itself, or ends
/// before its last frame.
pub fn open(path: &Path) -> Result<Box<dyn Recording>, CameraError> {
    let head = read_head(path)?;
    match FORMATS.iter().find(|format| (format.recognises)(&head)) {
        Some(format) => (format.open)(path),
        None => Err(unknown_format(path, &head)),
    }
}

fn read_head(path: &Path) -> Result<Vec<u8>, CameraError> {
    let io_error = |source| CameraError::Io { path: path.into(), source };
    let mut head = Vec::new();
    File::open(path).map_err(io_error)?.take(HEAD_BYTES).read_to_end(&mut head).map_err(io_error)?;
    Ok(head)
}

fn unknown_format(path: &Path, head: &[u8]) -> CameraError {
    let first: Vec<String> = head.iter().take(8).map(|byte| format!("{byte:02X}")).collect();
    let names: Vec<&str> = FORMATS.iter().map(|format| format.name).collect();
    CameraError::UnknownFormat {
        path: path.into(),
        found: if first.is_empty() { "an empty file".into() } else { format!("bytes {}", first.join(" ")) },
        hint: format!("readable formats: {}", names.join("; ")),
    }
}
