//! Arguments of `review`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `review`.
#[derive(Debug, Args)]
pub(crate) struct Review {
    /// A folder that `run` wrote.
    pub(crate) results: PathBuf,
    /// Table to write (.csv, .parquet or .mat).
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// List at most this many readings; default: 200.
    #[arg(long, value_name = "N")]
    pub(crate) most: Option<usize>,
}
