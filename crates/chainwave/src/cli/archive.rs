//! Arguments of `archive`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `archive`.
#[derive(Debug, Args)]
pub(crate) struct Archive {
    /// Results of a run.
    pub(crate) results: PathBuf,
    /// A new folder for the package.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Folder of the recordings, to pack them too; without it they are identified by their size and a hash of their beginning.
    #[arg(long, value_name = "DIR")]
    pub(crate) recordings: Option<PathBuf>,
    /// Address of the licence under which the package may be used, such as <https://creativecommons.org/licenses/by/4.0/>.
    #[arg(long, value_name = "URL")]
    pub(crate) license: Option<String>,
    /// Who made the experiment: names, ORCIDs.
    #[arg(long, value_name = "NAMES")]
    pub(crate) authors: Option<String>,
}
