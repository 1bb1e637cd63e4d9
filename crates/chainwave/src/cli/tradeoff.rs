//! Arguments of `tradeoff`.

use std::path::PathBuf;

use clap::Args;

use super::reading::{FrameRate, Reading};

/// Arguments of `tradeoff`.
#[derive(Debug, Args)]
pub(crate) struct Tradeoff {
    /// Experiments (experiment.toml: the bodies of its first recording), recordings, or scenes of rings.
    #[arg(required = true)]
    pub(crate) inputs: Vec<PathBuf>,
    /// Folder for tradeoff.parquet and its figures.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Run each experiment as a whole, as stated and with one thing reduced at a time, and show the uncertainties of c_g, HWHM and c_d
    /// against the time of a run; takes about eight runs.
    #[arg(long)]
    pub(crate) results: bool,
    /// Table of points for recordings, as for `track`; default: squares of 33 x 33 px with much texture.
    #[arg(long, value_name = "FILE")]
    pub(crate) points: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) frame_rate: FrameRate,
    #[command(flatten)]
    pub(crate) reading: Reading,
}
