//! The command line of what puts the program itself to the test.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `prove`.
#[derive(Debug, Args)]
pub(crate) struct Prove {
    /// The experiment; its table `[synthetic]` says what is filmed.
    pub(crate) experiment: PathBuf,
    /// Folder for proof.parquet (every estimate beside its truth), coverage.parquet and its figure.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Number of experiments.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) experiments: u64,
    /// Seed of the first experiment; the others follow from it.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub(crate) first_seed: u64,
    /// Factors on the sensor's read noise, separated by commas and used in turn.
    #[arg(long, value_name = "FACTOR", value_delimiter = ',', default_value = "1")]
    pub(crate) noise: Vec<f64>,
    /// Striker velocities in metres per second, separated by commas and used in turn after the noise; default: the experiment's own.
    #[arg(long, value_name = "VELOCITY", value_delimiter = ',')]
    pub(crate) striker: Vec<f64>,
    /// Make the experiments, in turn, without a fault and with each kind of fault, and count by fault as well.
    #[arg(long)]
    pub(crate) faults: bool,
    /// Make the experiments, in turn, with an ideal camera and with each of these effects of a real one, all with the same seeds, and count
    /// by effect as well; all effects if none is named.
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "EFFECT", conflicts_with = "faults")]
    pub(crate) camera: Option<Vec<String>>,
    /// Make the experiments, in turn, with the stated chain and with each of these, which differ from what is stated, all with the same
    /// seeds, and count by chain as well; all chains if none is named.
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "CHAIN", conflicts_with_all = ["faults", "camera"])]
    pub(crate) models: Option<Vec<String>>,
    /// Make the experiments, in turn, with their own protocol and with each of these, all with the same seeds, and count by protocol as well;
    /// all protocols if none is named.
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "PROTOCOL", conflicts_with_all = ["faults", "camera", "models"])]
    pub(crate) protocols: Option<Vec<String>>,
    /// Make the experiments, in turn, with their own chain and with each of these, with correct stated parameters and suitable camera settings,
    /// all with the same seeds, and count by chain as well; all chains if none is named.
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "CHAIN", conflicts_with_all = ["faults", "camera", "models", "protocols", "striker"])]
    pub(crate) chains: Option<Vec<String>>,
    /// Recordings processed in parallel; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// Arguments of `extremes`.
#[derive(Debug, Args)]
pub(crate) struct Extremes {
    /// Folder for the table and its figure.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Cases run in parallel; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
