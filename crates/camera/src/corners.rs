//! The corners of a calibration board in a picture, found by OpenCV (feature `opencv`).

#[cfg(opencv_before_4_7)]
mod charuco;
#[cfg(feature = "opencv")]
mod finder;

use chainwave_measurement::Recording;

use crate::board::{Board, Corner};
use crate::error::CameraError;

/// The corners of a board in a frame.
///
/// A checkerboard must be seen as a whole; of a ChArUco board any part will do.
///
/// # Errors
/// [`CameraError`] when no board of this kind is found, or the build has no OpenCV.
pub fn find_corners(
    recording: &dyn Recording,
    frame: usize,
    board: &Board,
) -> Result<Vec<Corner>, CameraError> {
    board.check()?;
    find(recording, frame, board)
}

#[cfg(feature = "opencv")]
use finder::find;

#[cfg(not(feature = "opencv"))]
fn find(recording: &dyn Recording, _frame: usize, _board: &Board) -> Result<Vec<Corner>, CameraError> {
    Err(CameraError::Unsupported {
        path: recording.path().into(),
        what: "a calibration board".into(),
        hint: "build with the feature `opencv`".into(),
    })
}
