//! Arguments of `plan`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub(crate) struct Plan {
    /// The experiment.
    pub(crate) experiment: PathBuf,
    /// Folder of the recordings named in trials.csv, if some exist already; default: the experiment's own folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) recordings: Option<PathBuf>,
    /// Threads; default: all cores. The time of a run is predicted for this number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
