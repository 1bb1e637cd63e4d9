//! Why a recording cannot be opened, surveyed or calibrated: file, place, expected, found, hint.

use std::path::PathBuf;

use chainwave_measurement::ReadError;

/// Video that a library has to decode, as [`CameraError::NeedsOpenCv`] names it.
pub(crate) const VIDEO: &str = "video";

/// Why a recording could not be opened, surveyed or calibrated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The recording.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The first bytes belong to no format of the list.
    #[error("{}: byte 0: expected the start of a recording, found {found} (readable formats: {readable})", path.display())]
    UnknownFormat {
        /// The recording.
        path: PathBuf,
        /// The first bytes.
        found: String,
        /// The formats that can be read.
        readable: String,
    },
    /// The file ends inside something that its header announces.
    #[error("{}: {what} at byte {offset}: expected {expected} bytes, found {found}", path.display())]
    Truncated {
        /// The recording.
        path: PathBuf,
        /// What was being read.
        what: String,
        /// Where it starts, in bytes from the start of the file.
        offset: u64,
        /// Its size in bytes.
        expected: u64,
        /// Bytes that the file holds from there on.
        found: u64,
    },
    /// A value that no valid file holds.
    #[error("{}: {what} at byte {offset}: expected {expected}, found {found}", path.display())]
    Malformed {
        /// The recording.
        path: PathBuf,
        /// What was being read.
        what: String,
        /// Where it stands, in bytes from the start of the file.
        offset: u64,
        /// What a valid file holds there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// The pictures are in colour; a filter mosaic read as gray would be wrong by the colours' sensitivities.
    #[error("{}: colour recording: {reason}; expected a monochrome one", path.display())]
    Colour {
        /// The recording.
        path: PathBuf,
        /// How the file says so.
        reason: String,
    },
    /// A valid recording of a kind that this build does not read.
    #[error("{}: {what} cannot be read (hint: {hint})", path.display())]
    Unsupported {
        /// The recording.
        path: PathBuf,
        /// The kind.
        what: String,
        /// What to do instead.
        hint: String,
    },
    /// Something that OpenCV does, in a program that has brought none ([`crate::register_vision`]).
    #[error("{}: {what} takes OpenCV, which this program is without (hint: `cargo build --release -p chainwave-opencv` builds the command with it{})", path.display(), around_opencv(what))]
    NeedsOpenCv {
        /// The recording.
        path: PathBuf,
        /// What takes it.
        what: &'static str,
    },
    /// The caller gave a frame rate that is none.
    #[error("{}: frame rate: expected a finite number of hertz above 0, found {found}", path.display())]
    FrameRate {
        /// The recording.
        path: PathBuf,
        /// What was given, in hertz.
        found: f64,
    },
    /// The stated geometry of a file without header is none.
    #[error("geometry of raw pixels: expected {expected}, found `{found}`")]
    RawGeometry {
        /// What would do.
        expected: String,
        /// What was given.
        found: String,
    },
    /// Dark frames, a flat field or defects that do not belong to a recording, or tell nothing of its sensor.
    #[error("{}: {what}: expected {expected}, found {found}", path.display())]
    Correction {
        /// The recording that does not fit, or that tells nothing.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
        /// What would do.
        expected: String,
        /// What it holds.
        found: String,
    },
    /// A calibration that cannot be.
    #[error("calibration: {what}: expected {expected}, found {found}")]
    Calibration {
        /// What it rests on.
        what: String,
        /// What would do.
        expected: String,
        /// What was given.
        found: f64,
    },
    /// A frame could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The recording holds too little for what is asked of it.
    #[error("{}: {what}: expected {expected}, found {found}", path.display())]
    TooLittle {
        /// The recording.
        path: PathBuf,
        /// What there is too little of, and what for.
        what: String,
        /// How much suffices.
        expected: String,
        /// How much there is.
        found: String,
    },
    /// A decoder of compressed images or video failed.
    #[error("{}: decoder: {reason}", path.display())]
    Decoder {
        /// The recording.
        path: PathBuf,
        /// What it said.
        reason: String,
    },
}

/// How to do without OpenCV, where something else does as well.
fn around_opencv(what: &str) -> &'static str {
    match what == VIDEO {
        true => {
            "; or `ffmpeg -i FILM -pix_fmt gray FOLDER/f_%05d.png` makes a folder of images, for which --rate-hz states the rate"
        }
        false => "",
    }
}
