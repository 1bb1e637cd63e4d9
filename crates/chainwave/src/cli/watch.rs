//! Arguments of `watch`.

use std::path::PathBuf;

use clap::Args;

use super::reading::Reading;

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub(crate) struct Watch {
    /// The folder that the camera saves to.
    pub(crate) folder: PathBuf,
    /// The experiment, whose trials table says what a recording shows; without it, markers are looked for, and recordings whose names differ in
    /// their last number are trials of one view.
    #[arg(long)]
    pub(crate) experiment: Option<PathBuf>,
    /// Seconds between looks into the folder; a file whose size stands still for as long is taken for saved.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    pub(crate) every: f64,
    /// Frames per second of recordings that do not state them, such as folders of images.
    #[arg(long)]
    pub(crate) rate_hz: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
    /// Threads; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
