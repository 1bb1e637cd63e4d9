//! Arguments of `run`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `run`.
#[derive(Debug, Args)]
pub(crate) struct Run {
    /// The experiment.
    pub(crate) experiment: PathBuf,
    /// Folder for tables, figures and the report.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Folder of the recordings named in trials.csv; default: the experiment's own folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) recordings: Option<PathBuf>,
    /// Recordings processed in parallel; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
    /// Take the whole frames of recordings that were cut short, and say how many they are.
    #[arg(long)]
    pub(crate) partial: bool,
    /// Print, stage by stage, what is reused from an earlier run, what is made again, and why.
    #[arg(long)]
    pub(crate) explain: bool,
    /// State in the report where the uncertainty of each result comes from, by rehearsals as in `plan`, which take a few times as long as the
    /// evaluation.
    #[arg(long, conflicts_with = "share")]
    pub(crate) budget: bool,
    /// Required uncertainty of a result, such as c_g=0.1% or HWHM=0.2mm (also x_n, c_d, c_s, peak_strain, peak_energy); may be given several
    /// times. Rehearsals then choose the trials, frames, subset size and tracking method that are enough, and the run reads nothing else.
    #[arg(long, value_name = "RESULT=SIGMA", conflicts_with = "share")]
    pub(crate) accuracy: Vec<chainwave_experiment::Aim>,
    /// Only track, and only the K-th of N shares of the recordings: for the tasks of a cluster's array job, which all write into
    /// one folder. A run without --share then evaluates all tracks.
    #[arg(long, value_name = "K/N")]
    pub(crate) share: Option<chainwave_experiment::Share>,
    /// Folder for a second copy of the tracks: a data set of Parquet files, one per recording, by velocity, view and trial (Hive partitions).
    #[arg(long, value_name = "DIR", conflicts_with = "share")]
    pub(crate) dataset: Option<PathBuf>,
}
