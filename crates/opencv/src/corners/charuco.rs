//! ChArUco corners through the interface that OpenCV had until 4.6.

use chainwave_camera::Board;
use opencv::aruco::{self, CharucoBoard};
use opencv::core::{Mat, Point2f, Vector};

/// Number and place of each corner of a ChArUco board in 8-bit gray.
///
/// In OpenCV up to 4.6, ChArUco boards belong to the module `aruco` of its contributed modules.
pub(super) fn corners(
    gray: &Mat,
    board: &Board,
    marker_side_m: f64,
    dictionary: i32,
) -> opencv::Result<Vec<(usize, Point2f)>> {
    let dictionary = aruco::get_predefined_dictionary_i32(dictionary)?;
    let (square, side) = (1.0, (marker_side_m / board.square_m.value) as f32);
    let known = CharucoBoard::create(board.columns as i32, board.rows as i32, square, side, &dictionary)?;
    let mut outlines = Vector::<Vector<Point2f>>::new();
    let mut numbers = Vector::<i32>::new();
    aruco::detect_markers_def(gray, &dictionary, &mut outlines, &mut numbers)?;
    if numbers.is_empty() {
        return Ok(Vec::new());
    }
    let (mut places, mut corners) = (Vector::<Point2f>::new(), Vector::<i32>::new());
    aruco::interpolate_corners_charuco_def(&outlines, &numbers, gray, &known, &mut places, &mut corners)?;
    Ok(corners.iter().map(|number| number as usize).zip(places.iter()).collect())
}
