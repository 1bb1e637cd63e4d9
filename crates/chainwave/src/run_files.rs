//! Names of files that `run` writes into its folder and other commands read there.

/// The tracks.
pub(crate) const TRACKS: &str = "tracks.parquet";
/// The displacement of each body over time.
pub(crate) const MOTION: &str = "motion.parquet";
/// The strain of each gap over time.
pub(crate) const STRAIN: &str = "strain.parquet";
/// Numbers with their uncertainties, warnings and recordings.
pub(crate) const RESULTS: &str = "results.json";
