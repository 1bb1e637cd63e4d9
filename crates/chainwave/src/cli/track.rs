//! Arguments of `track`.

use std::path::PathBuf;

use clap::Args;

use super::reading::Reading;
use super::sensor::Sensor;

/// Arguments of `track`.
#[derive(Debug, Args)]
pub(crate) struct Track {
    /// The recordings.
    #[arg(required = true)]
    pub(crate) recordings: Vec<PathBuf>,
    /// Table of points: name,x_px,y_px,half_width_px,half_height_px in the reference frame. Where both half sizes are
    /// empty or left out, the smallest subset is taken that keeps the noise within --accuracy (0.01 px when left out) and that cannot be
    /// taken for another; frame and neighbours bound it.
    #[arg(long)]
    pub(crate) points: PathBuf,
    /// Table to write (.csv, .parquet or .mat).
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Picture of how far the points moved over time, without ending: .svg and .png are written.
    #[arg(long, value_name = "STEM")]
    pub(crate) picture: Option<PathBuf>,
    /// Reference frame, from 0.
    #[arg(long, default_value_t = 0)]
    pub(crate) reference: usize,
    /// Frames per second of recordings that do not state them, such as folders of images.
    #[arg(long)]
    pub(crate) rate_hz: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) sensor: Sensor,
    #[command(flatten)]
    pub(crate) matching: Matching,
    /// Recordings processed at a time; all cores when left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// How images are matched.
#[derive(Debug, Args)]
pub(crate) struct Matching {
    /// A rung of the ladder, by name.
    #[arg(long)]
    pub(crate) method: Option<String>,
    /// The cheapest rung whose error on these subsets, shifted by known amounts under the same noise, is at most this, in
    /// pixels.
    #[arg(long, value_name = "PX", conflicts_with_all = ["method", "interpolation"])]
    pub(crate) accuracy: Option<f64>,
    /// Shape function: translation, rigid, affine or quadratic, or auto: the simplest that the matches cannot reject.
    #[arg(long, conflicts_with = "method")]
    pub(crate) shape: Option<String>,
    /// Interpolation of the deformed image: linear, cubic, cubic-moms, quintic or quintic-moms.
    #[arg(long, conflicts_with = "method")]
    pub(crate) interpolation: Option<String>,
}
