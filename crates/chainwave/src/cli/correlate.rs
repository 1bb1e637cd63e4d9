//! Arguments of `correlate`.

use std::path::PathBuf;

use clap::Args;

use super::reading::Reading;
use super::sensor::Sensor;
use super::track::Matching;

/// Arguments of `correlate`.
#[derive(Debug, Args)]
pub(crate) struct Correlate {
    /// The reference image.
    pub(crate) reference: PathBuf,
    /// The deformed image.
    pub(crate) deformed: PathBuf,
    /// Pixels from one point to the next; half of the half size when left out.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) step: Option<u16>,
    /// Columns and rows of a subset on each side of its centre. When left out, the smallest that keeps the noise within --accuracy (0.01 px
    /// when left out) and that cannot be taken for another, less where the field bends.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(2..=500))]
    pub(crate) half_size: Option<u16>,
    /// Table to write (.csv, .parquet or .mat); pictures of the field go beside it (.svg and .png).
    #[arg(long)]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) sensor: Sensor,
    #[command(flatten)]
    pub(crate) matching: Matching,
    /// Points along one side of the square that a strain is measured over; an odd number.
    #[arg(long, value_name = "POINTS", default_value_t = 5, value_parser = clap::value_parser!(u16).range(3..=99))]
    pub(crate) strain_window: u16,
    /// Threads; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
