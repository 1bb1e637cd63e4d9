//! Arguments of `watch`.

use std::path::PathBuf;

use clap::Args;

use super::positive::positive;
use super::reading::{FrameRate, Reading};

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub(crate) struct Watch {
    /// The folder that the camera saves to.
    pub(crate) folder: PathBuf,
    /// The experiment, whose trials table says what each recording shows; without it, markers are detected, and recordings whose names differ
    /// only in the last number are trials of one view.
    #[arg(long, value_name = "FILE")]
    pub(crate) experiment: Option<PathBuf>,
    /// Seconds between checks of the folder; a file whose size has not changed for as long counts as saved.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, allow_negative_numbers = true, value_parser = positive)]
    pub(crate) every: f64,
    #[command(flatten)]
    pub(crate) frame_rate: FrameRate,
    #[command(flatten)]
    pub(crate) reading: Reading,
    /// Threads; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
