//! Arguments of `synthesize`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `synthesize`.
#[derive(Debug, Args)]
pub(crate) struct Synthesize {
    /// The experiment; its table `[synthetic]` says what is filmed.
    pub(crate) experiment: PathBuf,
    /// Folder for the recordings, trials.csv, truth.parquet, truth.json and a copy of the experiment.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Seed to use instead of the experiment's own.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Recordings made in parallel; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
