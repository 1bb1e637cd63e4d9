//! Arguments of `samples`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `samples`.
#[derive(Debug, Args)]
pub(crate) struct Samples {
    /// Folder to write to.
    #[arg(long, value_name = "DIR", default_value = "data-samples")]
    pub(crate) out: PathBuf,
}
