//! Arguments of `tradeoff`.

use std::path::PathBuf;

use clap::Args;

use super::reading::Reading;

/// Arguments of `tradeoff`.
#[derive(Debug, Args)]
pub(crate) struct Tradeoff {
    /// Experiments (experiment.toml: the bodies of its first recording) or recordings.
    #[arg(required = true)]
    pub(crate) inputs: Vec<PathBuf>,
    /// Folder for tradeoff.parquet and its figures.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Run each experiment as a whole, as it is stated and with less of one thing at a time, and show the certainty of c_g, HWHM and c_d
    /// against the time of a run; takes some eight runs.
    #[arg(long)]
    pub(crate) results: bool,
    /// Table of points for recordings, as for `track`; when left out, squares of 33 x 33 px with much texture.
    #[arg(long)]
    pub(crate) points: Option<PathBuf>,
    /// Frames per second of recordings that do not state them, such as folders of images.
    #[arg(long)]
    pub(crate) rate_hz: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
}
