//! Arguments of `chainwave export`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(crate) struct Export {
    /// A table (.csv or .parquet), or a folder with tables, such as `run` and `import` write.
    pub(crate) results: PathBuf,
    /// Table to write (.csv, .parquet or .mat). Of a folder: one .mat for all its tables, or a folder for a .csv of each.
    #[arg(long)]
    pub(crate) out: PathBuf,
}
