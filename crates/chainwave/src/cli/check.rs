//! Arguments of `check`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct Check {
    /// The experiment.
    pub(crate) experiment: PathBuf,
    /// Folder of the recordings that trials.csv names; the experiment's own folder when left out.
    #[arg(long)]
    pub(crate) recordings: Option<PathBuf>,
    /// Views looked at side by side; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
