//! Bodies that move at an angle to the rows of the pictures: a camera that is rolled about its axis, or a chain that moves so.
//!
//! A camera that is rolled by theta shows a displacement x along the chain as x cos theta along its rows and x sin theta across them. What
//! moves across tells the angle, and not whose it is: where it is the camera's, displacements are too small by theta^2 / 2 of themselves.

use chainwave_measurement::{ChainMotion, ErrorSource, Estimate};

use crate::finding::Finding;
use crate::merging::side_motion::SideMotion;

const INCLINED_MOTION: &str = "inclined_motion";

/// The direction in which all bodies move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inclination {
    angle_rad: Estimate,
}

/// Standard deviations by which the angle is told.
const DETECTION_SIGMAS: f64 = 5.0;
/// What a camera's roll would make of the largest displacement, over its uncertainty, at least: less changes no interval.
const LEAST_SIZE_OVER_SIGMA: f64 = 0.1;
/// Share of the squares of displacements that a body has, of that of the body with the most, to tell a direction.
const LEAST_SHARE: f64 = 0.01;

impl Inclination {
    /// The direction that bodies have in common, where it is not that of the rows and a camera that is rolled so would matter.
    pub(crate) fn of(motion: &ChainMotion, side: &SideMotion) -> Option<Self> {
        let across = side.across.as_ref()?;
        let columns = across.columns_at(&motion.times_s);
        let (n_bodies, _) = motion.displacement_m.dim();
        // Sums of y x and of x x of each body: its slope is that of the line through its places, from where it rests.
        let sums = |row: usize| {
            let places = motion.displacement_m.row(row);
            let pairs = places.iter().zip(&columns).filter_map(|(x, column)| {
                x.zip(column.and_then(|column| across.displacement_m[(row, column)]))
            });
            pairs.fold([0.0; 2], |[xy, xx], (x, y)| [xy + x.value * y.value, xx + x.value * x.value])
        };
        let of_bodies: Vec<[f64; 2]> = (0..n_bodies).map(sums).collect();
        let most = of_bodies.iter().map(|[_, xx]| *xx).fold(0.0, f64::max);
        let slopes: Vec<f64> =
            of_bodies.iter().filter(|[_, xx]| *xx > LEAST_SHARE * most).map(|[xy, xx]| xy / xx).collect();
        let n = slopes.len() as f64;
        let mean = slopes.iter().sum::<f64>() / n;
        let scatter = (slopes.iter().map(|slope| (slope - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let found = Self { angle_rad: Estimate::new(mean.atan(), scatter / n.sqrt()) };
        let is_told =
            slopes.len() > 2 && found.angle_rad.value.abs() > DETECTION_SIGMAS * found.angle_rad.sigma;
        let matters = |x: &Estimate| found.shortening() * x.value.abs() > LEAST_SIZE_OVER_SIGMA * x.sigma;
        (is_told && motion.displacement_m.iter().flatten().any(matters)).then_some(found)
    }

    /// By how much displacements are too small, relative to themselves, were the camera rolled.
    pub(crate) fn shortening(&self) -> f64 {
        0.5 * self.angle_rad.value.powi(2)
    }

    /// Adds what the camera's roll would make of a motion to its errors.
    pub(crate) fn add_to(&self, motion: &mut ChainMotion) {
        let error_m = motion.displacement_m.mapv(|x| x.map_or(0.0, |x| self.shortening() * x.value));
        motion.add_error(ErrorSource::Other("a camera that is rolled".into()), &error_m);
    }

    /// What the reader should know.
    pub(crate) fn finding(&self) -> Finding {
        let degrees = Estimate::new(self.angle_rad.value.to_degrees(), self.angle_rad.sigma.to_degrees());
        Finding {
            code: INCLINED_MOTION,
            subject: "the direction of motion".into(),
            text: format!(
                "bodies move at {} degrees to the rows of the pictures. Where it is the camera that is rolled so, displacements along the chain are too \
                 small by {:.2e} of themselves, and those across it are the roll's: the first is counted as an uncertainty (hint: level the camera by the \
                 rods, or calibrate with `[camera.marks]`, which follow the chain)",
                crate::wording::estimate(degrees),
                self.shortening()
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::ErrorModes;
    use ndarray::Array2;

    use super::*;

    const N: usize = 50;

    fn moving(place_m: impl Fn(usize, usize) -> f64) -> ChainMotion {
        let place = |(row, i): (usize, usize)| Some(Estimate::new(place_m(row, i), 1e-6));
        ChainMotion {
            times_s: (0..N).map(|i| i as f64 * 4e-5).collect(),
            displacement_m: Array2::from_shape_fn((6, N), place),
            independent_sigma_m: Array2::from_elem((6, N), 1e-6),
            n_trials: Array2::from_elem((6, N), 3),
            modes: ErrorModes::default(),
        }
    }

    fn told(angle_rad: f64, own_m: impl Fn(usize, usize) -> f64) -> Option<Inclination> {
        let along_m = |row: usize, i: usize| 1e-2 * (i as f64 / N as f64) / (1.0 + row as f64);
        let across = moving(|row, i| angle_rad.sin() * along_m(row, i) + own_m(row, i));
        let side = SideMotion { across: Some(across), rotation: None, findings: Vec::new() };
        Inclination::of(&moving(|row, i| angle_rad.cos() * along_m(row, i)), &side)
    }

    #[test]
    fn a_rolled_camera_is_told_and_counts_as_half_the_square_of_its_angle() {
        let roll_rad = 0.7_f64.to_radians();
        let found = told(roll_rad, |row, i| 1e-7 * (((row * 31 + i) % 3) as f64 - 1.0)).unwrap();
        assert!((found.angle_rad.value - roll_rad).abs() < 1e-3 * roll_rad, "{found:?}");
        // 1 - cos 0.7 degrees
        assert!((found.shortening() / (1.0 - roll_rad.cos()) - 1.0).abs() < 1e-2);
        let mut motion = moving(|_, _| 1e-2);
        found.add_to(&mut motion);
        let sigma_m = motion.displacement_m[(0, 0)].unwrap().sigma;
        assert!((sigma_m - 1e-6_f64.hypot(1e-2 * found.shortening())).abs() < 1e-12);
    }

    #[test]
    fn bodies_that_go_each_its_own_way_and_small_angles_say_nothing() {
        let apart =
            |row: usize, i: usize| if row.is_multiple_of(2) { 2e-6 * i as f64 } else { -2e-6 * i as f64 };
        assert_eq!(told(0.0, apart), None);
        assert_eq!(told(1e-3, |_, _| 0.0), None, "a millionth of 10 mm is a hundredth of the uncertainty");
    }
}
