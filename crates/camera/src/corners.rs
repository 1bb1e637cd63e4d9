//! The corners of a calibration board in a picture.

use chainwave_measurement::Recording;

use crate::board::{Board, Corner};
use crate::error::CameraError;
use crate::library::needed;

/// The corners of a board in a frame, found by the program's [`crate::VisionLibrary`].
///
/// A checkerboard must be seen as a whole; of a ChArUco board any part will do.
///
/// # Errors
/// [`CameraError`] when no board of this kind is found, or the program has no OpenCV.
pub fn find_corners(
    recording: &dyn Recording,
    frame: usize,
    board: &Board,
) -> Result<Vec<Corner>, CameraError> {
    board.check()?;
    needed(recording.path(), "finding a calibration board")?.find_corners(recording, frame, board)
}
