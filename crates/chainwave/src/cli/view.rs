//! Arguments of `view`.

use std::path::PathBuf;

use clap::Args;

use super::reading::{FrameRate, Reading};

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(crate) struct View {
    /// A recording, a folder of recordings, an experiment (its recordings with the subsets that are followed), or a folder that `run`
    /// wrote (recordings with what was tracked).
    pub(crate) path: PathBuf,
    /// Port to listen on at 127.0.0.1; default: any free port.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) port: Option<u16>,
    /// Print the address, and open no browser.
    #[arg(long)]
    pub(crate) no_browser: bool,
    /// Table of points to show on recordings, as for `track`.
    #[arg(long, value_name = "FILE")]
    pub(crate) points: Option<PathBuf>,
    /// Folder of the recordings named in trials.csv or in the tracks; default: the experiment's own folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) recordings: Option<PathBuf>,
    /// File of corrections that the review of results writes and `run` reads; default: `corrections.csv` in the folder of the recordings.
    #[arg(long, value_name = "FILE")]
    pub(crate) corrections: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) frame_rate: FrameRate,
    #[command(flatten)]
    pub(crate) reading: Reading,
}
