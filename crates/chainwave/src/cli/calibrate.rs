//! Arguments of `calibrate`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::positive::positive;

/// Arguments of `calibrate`.
#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    /// Images of the board. In the first it lies in the plane in which the chain moves.
    #[arg(required = true)]
    pub(crate) pictures: Vec<PathBuf>,
    /// What the board shows.
    #[arg(long, value_enum)]
    pub(crate) board: Board,
    /// Squares in a row.
    #[arg(long, value_name = "N")]
    pub(crate) columns: usize,
    /// Squares in a column.
    #[arg(long, value_name = "N")]
    pub(crate) rows: usize,
    /// Side of a square, in metres.
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = positive)]
    pub(crate) square_m: f64,
    /// Standard uncertainty of that side; it is common to all squares.
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    pub(crate) square_sigma_m: f64,
    /// Side of a marker, in metres.
    #[arg(long, value_name = "M", required_if_eq("board", "charuco"), allow_negative_numbers = true, value_parser = positive)]
    pub(crate) marker_m: Option<f64>,
    /// ArUco dictionary of the markers, by its OpenCV name.
    #[arg(long, value_name = "NAME", default_value = "4X4_50")]
    pub(crate) dictionary: String,
    /// Calibration file to write (TOML).
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

/// What a board for calibration shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Board {
    /// Squares.
    Checkerboard,
    /// Squares with ArUco markers in the white ones.
    Charuco,
}
