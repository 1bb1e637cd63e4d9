//! Arguments of `inspect`.

use std::path::PathBuf;

use clap::Args;

use super::positive::positive;
use super::reading::Reading;

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub(crate) struct Inspect {
    /// The recording.
    pub(crate) recording: PathBuf,
    /// Write this frame (counted from 0) to the file given by --out.
    #[arg(long, value_name = "K", requires = "out")]
    pub(crate) frame: Option<usize>,
    /// A TIFF file for --frame: linear counts, 16-bit gray, top row first.
    #[arg(long, value_name = "FILE", requires = "frame")]
    pub(crate) out: Option<PathBuf>,
    /// Write a contact sheet of frames to this PNG file.
    #[arg(long, value_name = "FILE")]
    pub(crate) sheet: Option<PathBuf>,
    /// Frames per second of a recording that does not state its frame rate, such as a folder of images.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = positive)]
    pub(crate) rate_hz: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
}
