//! `chainwave calibrate`: lens distortion and scale from pictures of a board.

use std::path::{Path, PathBuf};

use chainwave_camera::{Board, Calibration, Corner, Markers, find_corners, open};
use chainwave_experiment::CalibrationFile;
use chainwave_measurement::Estimate;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::{expect_apart, expect_folder_of, write_text};
use crate::terminal::{say, tell};

/// Calibrates, and says on one screen how well. A picture in which no board is found is named and left out, unless it is the
/// first, which shows the plane of the chain.
pub(crate) fn calibrate(arguments: &cli::Calibrate) -> Result<Outcome, Error> {
    let mut outcome = Outcome::default();
    expect_folder_of(&arguments.out)?;
    let pictures_read: Vec<&Path> = arguments.pictures.iter().map(PathBuf::as_path).collect();
    expect_apart(&pictures_read, &[("the calibration", arguments.out.clone())])?;
    let board = board(arguments);
    let mut pictures: Vec<Vec<Corner>> = Vec::new();
    let mut size_px = None;
    for (index, path) in arguments.pictures.iter().enumerate() {
        match corners(path, &board, &mut size_px) {
            Ok(corners) => pictures.push(corners),
            Err(error) if index == 0 => return Err(error),
            Err(error) => outcome.fail(error),
        }
    }
    let size_px = size_px.unwrap_or_default();
    let calibration = Calibration::from_boards(&pictures, &board, size_px)?;
    let counts = (pictures.len(), pictures.iter().map(Vec::len).sum());
    let file = CalibrationFile::new(&calibration, size_px, counts);
    let text = toml::to_string(&file).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    write_text(&arguments.out, &text)?;
    say!("{}", summary(&file, &calibration).trim_end());
    tell("calibration", serde_json::json!(file));
    Ok(outcome)
}

fn board(arguments: &cli::Calibrate) -> Board {
    let side_m = arguments.marker_m.filter(|_| arguments.board == cli::Board::Charuco);
    let markers = side_m.map(|side_m| Markers { dictionary: arguments.dictionary.clone(), side_m });
    let square_m = Estimate::new(arguments.square_m, arguments.square_sigma_m);
    Board { columns: arguments.columns, rows: arguments.rows, square_m, markers }
}

/// The board's corners in the first frame of a picture, which is as large as those before.
fn corners(path: &Path, board: &Board, size_px: &mut Option<(usize, usize)>) -> Result<Vec<Corner>, Error> {
    let picture = open(path)?;
    let found = (picture.info().width_px, picture.info().height_px);
    let expected = *size_px.get_or_insert(found);
    if found != expected {
        return Err(Error::Argument(format!(
            "{}: expected a picture of {} x {} px, as the first, found {} x {}",
            path.display(),
            expected.0,
            expected.1,
            found.0,
            found.1
        )));
    }
    Ok(find_corners(picture.as_ref(), 0, board)?)
}

fn summary(file: &CalibrationFile, calibration: &Calibration) -> String {
    let lens = calibration.map.lens;
    let corner_px = lens.undistorted_px([0.0, 0.0]);
    format!(
        "{} corners in {} pictures; they lie {:.3} px (1 sigma) from where the calibration has them\n\
         scale      {:.4} px/mm, known to {:.2e} of itself\n\
         distortion k1 = {:.5} +- {:.5}, k2 = {:.5} +- {:.5} (in {:.1} px): {:.2} px in the top left corner\n",
        file.n_corners,
        file.n_pictures,
        file.residual_px,
        1e-3 / file.m_per_px,
        file.m_per_px_sigma / file.m_per_px,
        lens.k1,
        file.k1_sigma,
        lens.k2,
        file.k2_sigma,
        lens.focal_px,
        corner_px[0].hypot(corner_px[1]),
    )
}
