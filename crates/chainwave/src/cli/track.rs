//! Arguments of `track`.

use std::path::PathBuf;

use chainwave_correlation::{Interpolation, Method, ShapeChoice};
use clap::Args;

use super::positive::positive;
use super::reading::{FrameRate, Reading};
use super::sensor::Sensor;

/// Arguments of `track`.
#[derive(Debug, Args)]
pub(crate) struct Track {
    /// The recordings.
    #[arg(required = true)]
    pub(crate) recordings: Vec<PathBuf>,
    /// Table of points: name,x_px,y_px,half_width_px,half_height_px in the reference frame. If both half sizes are empty or left out, the
    /// smallest subset is chosen that keeps the noise within --accuracy (0.01 px unless given) and that no other place resembles by chance;
    /// the frame and neighbouring points limit it. If one is empty or left out, the subset is a square.
    #[arg(long, value_name = "FILE")]
    pub(crate) points: PathBuf,
    /// Table to write (.csv, .parquet or .mat).
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Figure of displacement over time, by its file name: .svg, .png, its numbers as .csv, and .cbor, from which it can be drawn again, are
    /// written, whichever of these endings is given or none.
    #[arg(long, value_name = "STEM")]
    pub(crate) picture: Option<PathBuf>,
    /// Reference frame, from 0.
    #[arg(long, default_value_t = 0)]
    pub(crate) reference: usize,
    #[command(flatten)]
    pub(crate) frame_rate: FrameRate,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) sensor: Sensor,
    #[command(flatten)]
    pub(crate) matching: Matching,
    /// Recordings processed in parallel; default: all cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
}

/// How images are matched.
#[derive(Debug, Args)]
pub(crate) struct Matching {
    /// Tracking method: icgn-INTERPOLATION-SHAPE with one of those below, template-parabola, opencv-lk, opencv-ecc or opencv-phase; default:
    /// icgn-cubic-affine.
    #[arg(long, value_name = "NAME")]
    pub(crate) method: Option<Method>,
    /// Fastest method with an error of at most PX, tested on these subsets shifted by known amounts.
    #[arg(long, value_name = "PX", conflicts_with_all = ["method", "interpolation"], allow_negative_numbers = true, value_parser = positive)]
    pub(crate) accuracy: Option<f64>,
    /// Shape function: translation, rigid, affine or quadratic, or auto: the simplest that the matches do not reject; default: affine.
    #[arg(long, value_name = "NAME", conflicts_with = "method")]
    pub(crate) shape: Option<ShapeChoice>,
    /// Interpolation of the deformed image: linear, cubic, cubic-moms, quintic or quintic-moms; default: cubic.
    #[arg(long, value_name = "NAME", conflicts_with = "method")]
    pub(crate) interpolation: Option<Interpolation>,
}
