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
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Summary to write (JSON).
    #[arg(long, value_name = "FILE", conflicts_with = "scan")]
    pub(crate) summary: Option<PathBuf>,
    /// Striker velocities in m/s, a list V,V,... or a range FROM:TO:COUNT, in place of the scene's own.
    #[arg(long, value_name = "VELOCITIES")]
    pub(crate) scan: Option<Velocities>,
    /// Simulations of a scan run in parallel, or threads for a chain of rings; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
