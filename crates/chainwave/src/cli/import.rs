//! Arguments of `import`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `import`.
#[derive(Debug, Args)]
pub(crate) struct Import {
    /// TOML file that maps the columns of the trial files.
    pub(crate) mapping: PathBuf,
    /// Folder of the files that the mapping names; default: the mapping's own folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Folder for tables, figures and results.json.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Threads; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
