//! Corners of checkerboards and ChArUco boards by OpenCV's detectors, refined to a part of a pixel.

#[cfg(opencv_before_4_7)]
mod charuco;

use chainwave_camera::{Board, CameraError, Corner, Markers};
use chainwave_measurement::{Recording, Region};
use opencv::core::{DataType, Mat, Point2f, Size, TermCriteria, TermCriteria_EPS, TermCriteria_Type, Vector};
use opencv::prelude::*;
use opencv::{calib3d, imgproc};

/// The names of OpenCV's sets of markers, in the order of their numbers.
const DICTIONARIES: [&str; 17] = [
    "4X4_50",
    "4X4_100",
    "4X4_250",
    "4X4_1000",
    "5X5_50",
    "5X5_100",
    "5X5_250",
    "5X5_1000",
    "6X6_50",
    "6X6_100",
    "6X6_250",
    "6X6_1000",
    "7X7_50",
    "7X7_100",
    "7X7_250",
    "7X7_1000",
    "ARUCO_ORIGINAL",
];

/// The part of a square's side within which a corner is refined on each side: it must not reach the next square's edges, nor a
/// marker's.
const REFINED_PART: f64 = 0.2;

/// Finds the corners in 8-bit gray, for OpenCV's detectors take no other, and refines them in the counts as recorded.
pub(crate) fn find(
    recording: &dyn Recording,
    frame: usize,
    board: &Board,
) -> Result<Vec<Corner>, CameraError> {
    let picture = BoardPicture::read(recording, frame)?;
    let failed =
        |error: opencv::Error| CameraError::Decoder { path: recording.path().into(), reason: error.message };
    let mut corners = match &board.markers {
        None => checkerboard(&picture, board).map_err(failed)?,
        Some(markers) => charuco(recording, &picture, board, markers)?,
    };
    if corners.is_empty() {
        let (columns, rows) = (board.columns, board.rows);
        return Err(CameraError::TooLittle {
            path: recording.path().into(),
            what: "corners of the board".into(),
            expected: format!("a board of {columns} x {rows} squares, evenly lit, with a white margin"),
            found: "none".into(),
        });
    }
    picture.refine(&mut corners).map_err(failed)?;
    Ok(corners)
}

fn dictionary(markers: &Markers) -> Result<i32, CameraError> {
    let wanted = markers.dictionary.trim_start_matches("DICT_");
    let found = DICTIONARIES.iter().position(|name| name.eq_ignore_ascii_case(wanted));
    found.map(|index| index as i32).ok_or_else(|| CameraError::Calibration {
        what: format!("dictionary {} of markers", markers.dictionary),
        expected: format!("one of {}", DICTIONARIES.join(", ")),
        found: f64::NAN,
    })
}

fn checkerboard(picture: &BoardPicture, board: &Board) -> opencv::Result<Vec<Corner>> {
    let (columns, rows) = (board.columns - 1, board.rows - 1);
    let flags = calib3d::CALIB_CB_EXHAUSTIVE | calib3d::CALIB_CB_ACCURACY;
    let mut places = Vector::<Point2f>::new();
    let size = Size::new(columns as i32, rows as i32);
    if !calib3d::find_chessboard_corners_sb(&picture.gray, size, &mut places, flags)? {
        return Ok(Vec::new());
    }
    let corner = |(index, place)| corner(index, columns, place);
    Ok(places.iter().enumerate().map(corner).collect())
}

#[cfg(opencv_before_4_7)]
fn charuco(
    recording: &dyn Recording,
    picture: &BoardPicture,
    board: &Board,
    markers: &Markers,
) -> Result<Vec<Corner>, CameraError> {
    let found = charuco::corners(&picture.gray, board, markers.side_m, dictionary(markers)?);
    let found = found
        .map_err(|error| CameraError::Decoder { path: recording.path().into(), reason: error.message })?;
    Ok(found.into_iter().map(|(index, place)| corner(index, board.columns - 1, place)).collect())
}

#[cfg(not(opencv_before_4_7))]
fn charuco(
    recording: &dyn Recording,
    _picture: &BoardPicture,
    _board: &Board,
    markers: &Markers,
) -> Result<Vec<Corner>, CameraError> {
    dictionary(markers)?;
    Err(CameraError::Unsupported {
        path: recording.path().into(),
        what: "a ChArUco board with OpenCV 4.7 or newer".into(),
        hint: "a checkerboard, or a build with OpenCV 4.6".into(),
    })
}

fn corner(index: usize, columns: usize, place: Point2f) -> Corner {
    Corner { column: index % columns, row: index / columns, x_px: place.x.into(), y_px: place.y.into() }
}

struct BoardPicture {
    /// Counts as recorded.
    counts: Mat,
    /// The same, stretched from the darkest to the brightest per cent.
    gray: Mat,
}

impl BoardPicture {
    fn read(recording: &dyn Recording, frame: usize) -> Result<Self, CameraError> {
        let info = recording.info();
        let region = Region::whole(info.width_px, info.height_px);
        let mut pixels = vec![0.0_f32; region.n_pixels()];
        recording.read_region(frame, region, &mut pixels)?;
        let mut sorted = pixels.clone();
        sorted.sort_by(f32::total_cmp);
        let quantile = |percent: usize| sorted[(sorted.len() - 1) * percent / 100];
        let (dark, bright) = (quantile(1), quantile(99));
        let span = (bright - dark).max(1.0);
        let gray: Vec<u8> =
            pixels.iter().map(|count| ((count - dark) / span * 255.0).round() as u8).collect();
        let failed = |error: opencv::Error| CameraError::Decoder {
            path: recording.path().into(),
            reason: error.message,
        };
        Ok(Self {
            counts: as_mat(&pixels, info.width_px).map_err(failed)?,
            gray: as_mat(&gray, info.width_px).map_err(failed)?,
        })
    }

    /// Moves each corner to where the gradients around it point past it (Förstner and Gülch, 1987).
    fn refine(&self, corners: &mut [Corner]) -> opencv::Result<()> {
        let mut places: Vector<Point2f> =
            corners.iter().map(|corner| Point2f::new(corner.x_px as f32, corner.y_px as f32)).collect();
        let half = (REFINED_PART * spacing_px(corners)).floor().clamp(2.0, 15.0) as i32;
        let criteria = TermCriteria::new(TermCriteria_EPS | TermCriteria_Type::COUNT as i32, 100, 1e-4)?;
        let no_zone = Size::new(-1, -1);
        imgproc::corner_sub_pix(&self.counts, &mut places, Size::new(half, half), no_zone, criteria)?;
        for (corner, place) in corners.iter_mut().zip(places) {
            (corner.x_px, corner.y_px) = (place.x.into(), place.y.into());
        }
        Ok(())
    }
}

/// The smallest distance of neighbouring corners.
fn spacing_px(corners: &[Corner]) -> f64 {
    let neighbours = |a: &Corner, b: &Corner| a.column.abs_diff(b.column) + a.row.abs_diff(b.row) == 1;
    let pairs =
        corners.iter().enumerate().flat_map(|(index, a)| corners[..index].iter().map(move |b| (a, b)));
    pairs
        .filter(|(a, b)| neighbours(a, b))
        .map(|(a, b)| (a.x_px - b.x_px).hypot(a.y_px - b.y_px))
        .fold(f64::INFINITY, f64::min)
}

fn as_mat<T: DataType>(pixels: &[T], width_px: usize) -> opencv::Result<Mat> {
    let flat = Mat::from_slice(pixels)?;
    let rows = (pixels.len() / width_px) as i32;
    flat.reshape(1, rows)?.try_clone()
}
