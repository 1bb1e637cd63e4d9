//! Arguments of `run`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `run`.
#[derive(Debug, Args)]
pub(crate) struct Run {
    /// The experiment.
    pub(crate) experiment: PathBuf,
    /// Folder for tables, figures and the report.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Folder of the recordings that trials.csv names; the experiment's own folder when left out.
    #[arg(long)]
    pub(crate) recordings: Option<PathBuf>,
    /// Recordings processed at a time; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
    /// Take the whole frames of recordings that were cut short, and say how many they are.
    #[arg(long)]
    pub(crate) partial: bool,
    /// Say, stage by stage, what is kept of an earlier run, what is made anew, and why.
    #[arg(long)]
    pub(crate) explain: bool,
    /// Say in the report what the uncertainty of each result comes from, by rehearsals as of `plan`, which take a few times as long as the
    /// evaluation.
    #[arg(long, conflicts_with = "share")]
    pub(crate) budget: bool,
    /// How well a result must be known, such as c_g=0.1% or HWHM=0.2mm (also x_n, c_d, c_s, peak_strain, peak_energy); may be given for several.
    /// Rehearsals then choose the trials, frames, size of subsets and tracking method that are enough, and the run looks at nothing else.
    #[arg(long, value_name = "RESULT=SIGMA", conflicts_with = "share")]
    pub(crate) accuracy: Vec<chainwave_experiment::Aim>,
    /// Only track, and only the K-th of N shares of the recordings: for the tasks of a cluster's array job, which all write into
    /// one folder. A run without it then evaluates what they tracked.
    #[arg(long, value_name = "K/N")]
    pub(crate) share: Option<chainwave_experiment::Share>,
    /// Folder for the tracks once more as a data set of Parquet files, one a recording, by velocity, view and trial (Hive partitions).
    #[arg(long, value_name = "FOLDER", conflicts_with = "share")]
    pub(crate) dataset: Option<PathBuf>,
}
