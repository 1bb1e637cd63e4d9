//! Pictures of boards, rendered here through a lens and a perspective that are known, and calibrated by what OpenCV finds in
//! them.

use chainwave_camera::{Board, Calibration, Markers, PlaneMap, find_corners};
use chainwave_measurement::MemoryRecording;
use opencv::aruco::{self, CharucoBoard};
use opencv::core::{Mat, Size};
use opencv::prelude::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::board_truth::{DISPLACEMENTS_PX, HEIGHT, SQUARE_M, WIDTH, board, displacement_m, found_m, truth};

/// Samples of a pixel in each direction.
const SAMPLES: usize = 4;

/// What a camera sees of a plane of brightness 0 to 1, averaged over each pixel, with normal noise of 1 % of its range.
fn picture_of(brightness: impl Fn([f64; 2]) -> f64, map: &PlaneMap, random: &mut Pcg64) -> MemoryRecording {
    let offset = |index: usize| (index as f64 + 0.5) / SAMPLES as f64 - 0.5;
    let mut pixel = |at: usize| {
        let (x, y) = ((at % WIDTH) as f64, (at / WIDTH) as f64);
        let sample = |k: usize| [x + offset(k % SAMPLES), y + offset(k / SAMPLES)];
        let light: f64 = (0..SAMPLES * SAMPLES).map(|k| brightness(map.position_m(sample(k)))).sum();
        let noise: f64 = StandardNormal.sample(random);
        (300.0 + 3000.0 * light / (SAMPLES * SAMPLES) as f64 + 40.0 * noise).round().clamp(0.0, 4095.0) as f32
    };
    let pixels = (0..WIDTH * HEIGHT).map(&mut pixel).collect();
    MemoryRecording::new(WIDTH, 12, vec![pixels])
}

/// Black and white squares with a white margin, whose edges are ramps of about a pixel: steps would be seen only as finely as a
/// pixel is sampled.
fn checkerboard([x_m, y_m]: [f64; 2]) -> f64 {
    const RAMP: f64 = 0.012;
    let (x, y) = (x_m / SQUARE_M, y_m / SQUARE_M);
    let is_outside = x < 0.0 || y < 0.0 || x >= 13.0 || y >= 9.0;
    let side = |at: f64| {
        let from_edge = at - at.round();
        let sign = if at.round().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
        sign * (from_edge / RAMP).clamp(-1.0, 1.0)
    };
    if is_outside { 1.0 } else { 0.5 - 0.5 * side(x) * side(y) }
}

/// The displacements found, in standard errors from the truth.
fn scores(picture: &MemoryRecording, board: &Board, map: &PlaneMap) -> Vec<f64> {
    chainwave_opencv::register();
    let corners = find_corners(picture, 0, board).unwrap();
    let calibration = Calibration::from_boards(&[corners], board, (WIDTH, HEIGHT)).unwrap();
    // Noise of 1 % over edges of one pixel leaves corners of a few hundredths of a pixel.
    assert!(calibration.residual_px < 0.08, "{} px", calibration.residual_px);
    let score = |of_px: &[[f64; 2]; 2]| {
        let (found, expected) = (found_m(&calibration, *of_px), displacement_m(map, *of_px));
        // Half a thousandth: far above the error, far below what distortion does, up to 4 %.
        assert!((found.value / expected - 1.0).abs() < 1e-3, "{found:?} for {expected}");
        (found.value - expected) / found.sigma
    };
    DISPLACEMENTS_PX.iter().map(score).collect()
}

fn assert_normal(scores: &[f64]) {
    let mean_square = scores.iter().map(|score| score * score).sum::<f64>() / scores.len() as f64;
    // Some ten independent ones: their mean square scatters by 0.4.
    assert!(mean_square < 2.4, "mean square {mean_square}: {scores:.2?}");
}

#[test]
fn a_checkerboard_is_found_and_calibrates() {
    let of_seed = |seed: u64| {
        let mut random = Pcg64::seed_from_u64(seed);
        let map = truth(&mut random);
        // The board with its margin fills the picture; one that is cut off is not found, as OpenCV's detector says.
        let picture = picture_of(checkerboard, &nearer(&map), &mut random);
        scores(&picture, &board(), &nearer(&map))
    };
    assert_normal(&(0..5).flat_map(of_seed).collect::<Vec<f64>>());
}

/// The same view of a board of which more is seen.
fn nearer(map: &PlaneMap) -> PlaneMap {
    let mut seen = *map;
    let middle_m = [6.5 * SQUARE_M, 4.5 * SQUARE_M];
    let at = seen.position_m([639.5, 399.5]);
    for (row, (middle_m, at)) in middle_m.into_iter().zip(at).enumerate() {
        for column in 0..3 {
            let matrix = &map.plane_from_image;
            seen.plane_from_image[row][column] =
                1.12 * matrix[row][column] + (middle_m - 1.12 * at) * matrix[2][column];
        }
    }
    seen
}

#[test]
fn a_part_of_a_charuco_board_calibrates() {
    let dictionary = aruco::get_predefined_dictionary_i32(aruco::DICT_4X4_50 + 1).unwrap();
    let mut drawn = CharucoBoard::create(13, 9, 1.0, 0.7, &dictionary).unwrap();
    let mut sheet = Mat::default();
    const SQUARE: i32 = 60;
    drawn.draw(Size::new(13 * SQUARE, 9 * SQUARE), &mut sheet, 0, 1).unwrap();
    let dots = sheet.data_typed::<u8>().unwrap();
    let (columns, rows) = (13 * SQUARE as usize, 9 * SQUARE as usize);
    let dot = |x: f64, y: f64| {
        let is_inside = x >= 0.0 && y >= 0.0 && x < columns as f64 && y < rows as f64;
        if is_inside { f64::from(dots[y as usize * columns + x as usize]) / 255.0 } else { 1.0 }
    };
    let brightness = |at_m: [f64; 2]| {
        let [x, y] = at_m.map(|m| m / SQUARE_M * f64::from(SQUARE) - 0.5);
        let (u, v) = (x - x.floor(), y - y.floor());
        let along = |y: f64| (1.0 - u) * dot(x.floor(), y) + u * dot(x.floor() + 1.0, y);
        (1.0 - v) * along(y.floor()) + v * along(y.floor() + 1.0)
    };
    let markers = Some(Markers { dictionary: "4X4_100".into(), side_m: 0.7 * SQUARE_M });
    let charuco = Board { markers, ..board() };
    let of_seed = |seed: u64| {
        let mut random = Pcg64::seed_from_u64(seed);
        let map = truth(&mut random);
        scores(&picture_of(brightness, &map, &mut random), &charuco, &map)
    };
    assert_normal(&(20..24).flat_map(of_seed).collect::<Vec<f64>>());
}

#[test]
fn a_picture_without_a_board_is_refused() {
    chainwave_opencv::register();
    let mut random = Pcg64::seed_from_u64(1);
    let picture = picture_of(|_| 0.5, &truth(&mut random), &mut random);
    let message = find_corners(&picture, 0, &board()).unwrap_err().to_string();
    assert!(message.contains("memory: ") && message.contains("13 x 9 squares"), "{message}");
    let markers = Some(Markers { dictionary: "4X4_99".into(), side_m: 0.7 * SQUARE_M });
    let message = find_corners(&picture, 0, &Board { markers, ..board() }).unwrap_err().to_string();
    assert!(message.contains("4X4_100"), "{message}");
}
