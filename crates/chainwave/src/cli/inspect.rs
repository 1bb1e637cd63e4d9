//! Arguments of `inspect`.

use std::path::PathBuf;

use clap::Args;

use super::reading::Reading;

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub(crate) struct Inspect {
    /// The recording.
    pub(crate) recording: PathBuf,
    /// Write this frame (from 0) to the file of --out.
    #[arg(long, requires = "out")]
    pub(crate) frame: Option<usize>,
    /// A TIFF file for --frame: linear counts, 16-bit gray, top row first.
    #[arg(long, requires = "frame")]
    pub(crate) out: Option<PathBuf>,
    /// Write a contact sheet of frames to this PNG file.
    #[arg(long)]
    pub(crate) sheet: Option<PathBuf>,
    /// Frames per second of a recording that does not state them, such as a folder of images.
    #[arg(long)]
    pub(crate) rate_hz: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
}
