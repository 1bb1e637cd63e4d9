//! Arguments of `correlate`.

use std::path::PathBuf;

use clap::Args;

use super::reading::Reading;
use super::sensor::Sensor;
use super::track::Matching;

/// Arguments of `correlate`.
#[derive(Debug, Args)]
pub(crate) struct Correlate {
    /// The reference image; of a recording, its first frame.
    pub(crate) reference: PathBuf,
    /// The deformed image; of a recording, its first frame (`chainwave inspect` with --frame and --out writes any other).
    pub(crate) deformed: PathBuf,
    /// Pixels from one point to the next; default: half of --half-size.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) step: Option<u16>,
    /// Pixels on each side of a subset's centre. Default: the smallest size that keeps the noise within --accuracy (0.01 px unless given)
    /// and that no other place resembles by chance; smaller where the field bends.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(2..=500))]
    pub(crate) half_size: Option<u16>,
    /// Table to write (.csv, .parquet or .mat); figures of the field are written beside it (.svg and .png, and .cbor, from
    /// which they can be drawn again).
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) sensor: Sensor,
    #[command(flatten)]
    pub(crate) matching: Matching,
    /// Points along one side of the square over which strain is measured; an odd number.
    #[arg(long, value_name = "POINTS", default_value_t = 5, value_parser = clap::value_parser!(u16).range(3..=99))]
    pub(crate) strain_window: u16,
    /// Threads; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}
