//! Arguments of `plan`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub(crate) struct Plan {
    /// The experiment.
    pub(crate) experiment: PathBuf,
    /// Folder of the recordings that trials.csv names, where some are filmed; the experiment's own folder when left out.
    #[arg(long)]
    pub(crate) recordings: Option<PathBuf>,
    /// Threads; all cores when left out. The time of a run is predicted for as many.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
