//! Arguments of `chainwave compare`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// The study: which results, motions and summaries belong together, and what was published, as TOML.
    pub(crate) study: PathBuf,
    /// Folder that the study's paths are relative to.
    #[arg(long)]
    pub(crate) from: PathBuf,
    /// Folder for figures, comparison.csv and comparison.md.
    #[arg(long)]
    pub(crate) out: PathBuf,
}
