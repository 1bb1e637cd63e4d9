//! Arguments of `chainwave compare`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// The study (TOML): which results, motions and summaries belong together, and what was published.
    pub(crate) study: PathBuf,
    /// Folder that the study's paths are relative to.
    #[arg(long, value_name = "DIR")]
    pub(crate) from: PathBuf,
    /// Folder for figures, comparison.csv and comparison.md.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}
