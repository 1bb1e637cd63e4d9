//! Arguments of `import`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `import`.
#[derive(Debug, Args)]
pub(crate) struct Import {
    /// What stands where in the files of the trials.
    pub(crate) mapping: PathBuf,
    /// Folder of the files that the mapping names; the mapping's own folder when left out.
    #[arg(long)]
    pub(crate) data: Option<PathBuf>,
    /// Folder for tables, figures and results.json.
    #[arg(long)]
    pub(crate) out: PathBuf,
}
