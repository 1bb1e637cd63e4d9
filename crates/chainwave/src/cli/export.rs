//! Arguments of `chainwave export`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(crate) struct Export {
    /// A table (.csv or .parquet), or a folder with tables, as written by `run` and `import`.
    pub(crate) results: PathBuf,
    /// Table to write (.csv, .parquet or .mat). For a folder of tables: one .mat with all of them, or a folder for one .csv each.
    #[arg(long, value_name = "PATH")]
    pub(crate) out: PathBuf,
}
