//! Arguments of `archive`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `archive`.
#[derive(Debug, Args)]
pub(crate) struct Archive {
    /// Results of a run.
    pub(crate) results: PathBuf,
    /// A new folder for the package.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// The folder of the recordings, to pack them too; without it they are named by size and hash of their beginning.
    #[arg(long)]
    pub(crate) recordings: Option<PathBuf>,
    /// Address of the licence under which the package may be used, such as <https://creativecommons.org/licenses/by/4.0/>.
    #[arg(long)]
    pub(crate) license: Option<String>,
    /// Who made the experiment: names, ORCIDs.
    #[arg(long)]
    pub(crate) authors: Option<String>,
}
