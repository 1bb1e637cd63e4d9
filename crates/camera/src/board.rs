//! Boards for calibration: checkerboards and ChArUco boards, and the corners that are seen of them.

use chainwave_measurement::Estimate;

use crate::error::CameraError;

/// A flat board of equal squares, black and white in turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    /// Squares in a row.
    pub columns: usize,
    /// Squares in a column.
    pub rows: usize,
    /// Side of a square, in metres. Its error is common to all squares.
    pub square_m: Estimate,
    /// The markers in the white squares, if there are any.
    pub markers: Option<Markers>,
}

/// ArUco markers that make a checkerboard a ChArUco board: its corners are known even where only a part of it is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Markers {
    /// Name of the set of markers as in OpenCV, such as `4X4_50`.
    pub dictionary: String,
    /// Side of a marker, in metres.
    pub side_m: f64,
}

/// An inner corner of a board, where four squares meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Number of the corner in its row, from 0.
    pub column: usize,
    /// Number of its row, from 0.
    pub row: usize,
    /// Column in the picture, in pixels.
    pub x_px: f64,
    /// Row in the picture, in pixels.
    pub y_px: f64,
}

impl Board {
    /// Refuses a board that is none, or that tells too little.
    pub(crate) fn check(&self) -> Result<(), CameraError> {
        let refusal = |what: &str, expected: &str, found: f64| {
            Err(CameraError::Calibration { what: what.into(), expected: expected.into(), found })
        };
        if !(self.square_m.value.is_finite() && self.square_m.value > 0.0) {
            return refusal("side of a square in metres", "a finite number above 0", self.square_m.value);
        }
        let side_m = self.markers.as_ref().map(|markers| markers.side_m);
        if let Some(side_m) = side_m.filter(|side_m| !(*side_m > 0.0 && *side_m < self.square_m.value)) {
            return refusal("side of a marker in metres", "above 0 and below a square's", side_m);
        }
        match (self.columns, self.rows) {
            (4..=1000, 4..=1000) => Ok(()),
            (columns, rows) => {
                refusal("squares in a row or column", "4 to 1000 of each", columns.min(rows) as f64)
            }
        }
    }
}
