//! Arguments of `simulate`.

use std::path::PathBuf;

use clap::Args;

use super::velocities::Velocities;

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// The scene.
    pub(crate) scene: PathBuf,
    /// Table to write (.csv, .parquet or .mat): the motion, or with --scan the pulse in each gap.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Summary to write, as JSON.
    #[arg(long, conflicts_with = "scan")]
    pub(crate) summary: Option<PathBuf>,
    /// Striker velocities in m/s, a list V,V,... or a range FROM:TO:COUNT, in place of the scene's own.
    #[arg(long)]
    pub(crate) scan: Option<Velocities>,
    /// Members of a scan simulated at a time, or threads of a chain of rings; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
