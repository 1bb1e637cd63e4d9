//! The command line of what puts the program itself to the test.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `prove`.
#[derive(Debug, Args)]
pub(crate) struct Prove {
    /// The experiment; its part `synthetic` says what is filmed.
    pub(crate) experiment: PathBuf,
    /// Folder for proof.parquet (every estimate beside its truth), coverage.parquet and its figure.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Number of experiments.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) experiments: u64,
    /// Seed of the first; the others follow.
    #[arg(long, default_value_t = 1)]
    pub(crate) first_seed: u64,
    /// Factors on the sensor's read noise, taken in turn.
    #[arg(long, value_delimiter = ',', default_value = "1")]
    pub(crate) noise: Vec<f64>,
    /// Striker velocities in metres per second, taken in turn after the noise; the experiment's own when left out.
    #[arg(long, value_delimiter = ',')]
    pub(crate) striker: Vec<f64>,
    /// Give the experiments, in turn, no fault and each kind of fault, and count by fault as well.
    #[arg(long)]
    pub(crate) faults: bool,
    /// Give the experiments, in turn, an ideal camera and each of these effects of a real one, all with the same seeds, and count by
    /// effect as well; all effects when none is named.
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "EFFECT", conflicts_with = "faults")]
    pub(crate) camera: Option<Vec<String>>,
    /// Give the experiments, in turn, a chain that is what is stated and each of these that are not, all with the same seeds, and count
    /// by chain as well; all chains when none is named.
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "CHAIN", conflicts_with_all = ["faults", "camera"])]
    pub(crate) models: Option<Vec<String>>,
    /// Give the experiments, in turn, their own protocol and each of these, all with the same seeds, and count by protocol as well; all
    /// protocols when none is named.
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "PROTOCOL", conflicts_with_all = ["faults", "camera", "models"])]
    pub(crate) protocols: Option<Vec<String>>,
    /// Give the experiments, in turn, their own chain and each of these, stated as it is and filmed as it asks for, all with the same seeds,
    /// and count by chain as well; all chains when none is named.
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "CHAIN", conflicts_with_all = ["faults", "camera", "models", "protocols", "striker"])]
    pub(crate) chains: Option<Vec<String>>,
    /// Recordings processed at a time; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// Arguments of `extremes`.
#[derive(Debug, Args)]
pub(crate) struct Extremes {
    /// Folder for the table and its figure.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Cases tried at a time; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
