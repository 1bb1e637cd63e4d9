//! A lens and a perspective that are known, and what a calibration finds of them.

use chainwave_camera::{Board, Calibration, Lens, PlaneMap};
use chainwave_measurement::Estimate;
use rand::RngExt;
use rand_pcg::Pcg64;

pub(crate) const WIDTH: usize = 1280;
pub(crate) const HEIGHT: usize = 800;
pub(crate) const SQUARE_M: f64 = 5e-3;

/// A board of 13 x 9 squares.
pub(crate) fn board() -> Board {
    Board { columns: 13, rows: 9, square_m: Estimate::new(SQUARE_M, 0.0), markers: None }
}

/// A camera as photographers have it: distortion of up to some ten pixels in the corners, its axis a little off the middle,
/// the board turned and tilted by some degrees; positions in metres of the board from the corner of its first square.
pub(crate) fn truth(random: &mut Pcg64) -> PlaneMap {
    let mut within = |limit: f64| random.random_range(-limit..limit);
    let lens = Lens {
        centre_px: [639.5 + within(30.0), 399.5 + within(30.0)],
        focal_px: 754.0,
        k1: within(0.06),
        k2: within(0.02),
    };
    let (m_per_px, turn) = (SQUARE_M / 85.0, within(0.05));
    let (cosine, sine) = (m_per_px * turn.cos(), m_per_px * turn.sin());
    let middle_m = [6.5 * SQUARE_M + within(0.5 * SQUARE_M), 4.5 * SQUARE_M + within(0.5 * SQUARE_M)];
    let shift = [middle_m[0] - cosine * 639.5 + sine * 399.5, middle_m[1] - sine * 639.5 - cosine * 399.5];
    let tilt = [within(5e-5), within(5e-5)];
    PlaneMap {
        lens,
        plane_from_image: [[cosine, -sine, shift[0]], [sine, cosine, shift[1]], [tilt[0], tilt[1], 1.0]],
    }
}

/// Displacements along the picture's rows that a body may make: from, to, in pixels.
pub(crate) const DISPLACEMENTS_PX: [[[f64; 2]; 2]; 4] = [
    [[60.0, 400.0], [1200.0, 400.0]],
    [[100.0, 80.0], [180.0, 80.0]],
    [[640.0, 700.0], [760.0, 702.0]],
    [[1000.0, 400.0], [1100.0, 400.0]],
];

/// The displacement along the chain between two points of the picture: along the rows at the picture's middle.
pub(crate) fn displacement_m(map: &PlaneMap, [from_px, to_px]: [[f64; 2]; 2]) -> f64 {
    let [[xx, _], [yx, _]] = map.m_per_px([639.5, 399.5]);
    let (from, to) = (map.position_m(from_px), map.position_m(to_px));
    ((to[0] - from[0]) * xx + (to[1] - from[1]) * yx) / xx.hypot(yx)
}

/// The displacement that a calibration finds, with its standard uncertainty.
pub(crate) fn found_m(calibration: &Calibration, of_px: [[f64; 2]; 2]) -> Estimate {
    let along = |map: &PlaneMap| map.position_m(of_px[1])[0] - map.position_m(of_px[0])[0];
    let value = along(&calibration.map);
    let squares: f64 = calibration.errors.iter().map(|error| (along(&error.map) - value).powi(2)).sum();
    Estimate::new(value, squares.sqrt())
}
