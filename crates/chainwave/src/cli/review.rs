//! Arguments of `review`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `review`.
#[derive(Debug, Args)]
pub(crate) struct Review {
    /// A folder that `run` wrote.
    pub(crate) results: PathBuf,
    /// Table of the queue to write (.csv, .parquet or .mat).
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Readings in it; 200 when left out.
    #[arg(long, value_name = "N")]
    pub(crate) most: Option<usize>,
}
