//! Bodies that move at an angle to the rows of the pictures: a camera that is rolled about its axis, or a chain that moves so.
//!
//! A camera that is rolled by theta shows a displacement x along the chain as x cos theta along its rows and x sin theta across them. What
//! moves across tells the angle, and not whose it is: where it is the camera's, displacements are too small by theta^2 / 2 of themselves.

use chainwave_measurement::{
    BodyTrack, ChainMotion, ErrorSource, Estimate, Observation, SharedReadingError, TrackDeviation,
};
use ndarray::Array2;

use crate::finding::Finding;
use crate::merging::side_motion::SideMotion;

const INCLINED_MOTION: &str = "inclined_motion";
/// What an error of this kind comes from.
const OWN_DIRECTIONS: &str = "bodies that move in directions of their own";

/// The directions in which bodies move.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Inclination {
    /// All of them in one that is not that of the rows, at this angle in radians.
    Common(Estimate),
    /// Each in its own, as in a chain that is curved: angles in radians, 0 of a body whose direction is not told.
    Own(Vec<f64>),
}

/// Standard deviations by which an angle is told.
const DETECTION_SIGMAS: f64 = 5.0;
/// What an angle would make of the largest displacement, over its uncertainty, at least: less changes no interval.
const LEAST_SIZE_OVER_SIGMA: f64 = 0.1;
/// Share of the squares of displacements that a body has, of that of the body with the most, to tell a direction.
const LEAST_SHARE: f64 = 0.01;
/// Share of the squares of a body's places across the chain that a straight line explains at least, where it moves in a direction of its own.
const LEAST_STRAIGHT: f64 = 0.9;

/// The line through a body's places, from where it rests.
#[derive(Debug, Clone, Copy, Default)]
struct Line {
    /// Sums of y x, x x and y y.
    sums: [f64; 3],
    /// Where the body is farthest from its place: how far, and the uncertainty across.
    farthest_m: f64,
    sigma_m: f64,
}

impl Line {
    fn with(mut self, x: Estimate, y: Estimate) -> Self {
        let products = [x.value * y.value, x.value * x.value, y.value * y.value];
        self.sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
        if x.value.abs() > self.farthest_m {
            (self.farthest_m, self.sigma_m) = (x.value.abs(), y.sigma);
        }
        self
    }

    fn slope(&self) -> f64 {
        self.sums[0] / self.sums[1]
    }

    /// The body's own direction in radians, if it is told.
    fn told_rad(&self) -> Option<f64> {
        let [xy, xx, yy] = self.sums;
        let is_straight = xy * xy > LEAST_STRAIGHT * xx * yy;
        let is_clear = self.slope().abs() * self.farthest_m > DETECTION_SIGMAS * self.sigma_m;
        (is_straight && is_clear).then(|| self.slope().atan())
    }
}

impl Inclination {
    /// The direction that bodies have in common, or else their own ones, where these are not that of the rows and it would matter.
    pub(crate) fn of(motion: &ChainMotion, side: &SideMotion) -> Option<Self> {
        let across = side.across.as_ref()?;
        let columns = across.columns_at(&motion.times_s);
        let (n_bodies, _) = motion.displacement_m.dim();
        let line = |row: usize| {
            let places = motion.displacement_m.row(row);
            let pairs = places.iter().zip(&columns).filter_map(|(x, column)| {
                x.zip(column.and_then(|column| across.displacement_m[(row, column)]))
            });
            pairs.fold(Line::default(), |line, (x, y)| line.with(x, y))
        };
        let lines: Vec<Line> = (0..n_bodies).map(line).collect();
        let most = lines.iter().map(|line| line.sums[1]).fold(0.0, f64::max);
        let has_moved = |line: &Line| line.sums[1] > LEAST_SHARE * most;
        let slopes: Vec<f64> = lines.iter().filter(|line| has_moved(line)).map(Line::slope).collect();
        let n = slopes.len() as f64;
        let mean = slopes.iter().sum::<f64>() / n;
        let scatter = (slopes.iter().map(|slope| (slope - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let angle_rad = Estimate::new(mean.atan(), scatter / n.sqrt());
        let is_common = slopes.len() > 2 && angle_rad.value.abs() > DETECTION_SIGMAS * angle_rad.sigma;
        let own_rad = |line: &Line| if has_moved(line) { line.told_rad().unwrap_or(0.0) } else { 0.0 };
        let found = match is_common {
            true => Self::Common(angle_rad),
            false => Self::Own(lines.iter().map(own_rad).collect()),
        };
        let matters = |((row, _), x): ((usize, usize), &Option<Estimate>)| {
            x.is_some_and(|x| found.shortening_of(row) * x.value.abs() > LEAST_SIZE_OVER_SIGMA * x.sigma)
        };
        motion.displacement_m.indexed_iter().any(matters).then_some(found)
    }

    /// By how much displacements are too small at most, relative to themselves, were it the camera's roll or the chain's curve.
    fn shortening(&self) -> f64 {
        match self {
            Self::Common(_) => self.of_scale(),
            Self::Own(of_bodies) => of_bodies.iter().map(|angle| 0.5 * angle * angle).fold(0.0, f64::max),
        }
    }

    /// By how much the scale would be wrong, relative to itself, were the camera rolled.
    pub(crate) fn of_scale(&self) -> f64 {
        match self {
            Self::Common(angle_rad) => 0.5 * angle_rad.value.powi(2),
            Self::Own(_) => 0.0,
        }
    }

    /// The same of the body in a row.
    fn shortening_of(&self, row: usize) -> f64 {
        match self {
            Self::Common(_) => self.shortening(),
            Self::Own(of_bodies) => 0.5 * of_bodies[row].powi(2),
        }
    }

    /// Adds what that would make of a motion to its errors.
    pub(crate) fn add_to(&self, motion: &mut ChainMotion) {
        let error_m = Array2::from_shape_fn(motion.displacement_m.dim(), |(row, i)| {
            motion.displacement_m[(row, i)].map_or(0.0, |x| self.shortening_of(row) * x.value)
        });
        let source = match self {
            Self::Common(_) => "a camera that is rolled",
            Self::Own(_) => OWN_DIRECTIONS,
        };
        motion.add_error(ErrorSource::Other(source.into()), &error_m);
    }

    /// What directions of bodies' own make of their readings: an error of one size in all of them. That of a common one is one of the scale.
    pub(crate) fn reading_errors(
        &self,
        observations: &[Observation],
        rest_until_s: f64,
    ) -> Vec<SharedReadingError> {
        let Self::Own(of_bodies) = self else { return Vec::new() };
        let of_track = |one: &Observation, track: &BodyTrack| {
            let at_rest_m = one.mean_before_m(track, rest_until_s).unwrap_or(0.0);
            let shortening = self.shortening_of(track.body - 1);
            let error_m = |x: &Option<Estimate>| x.map_or(0.0, |x| shortening * (x.value - at_rest_m));
            TrackDeviation {
                recording: one.recording.clone(),
                body: track.body,
                error_m: track.position_m.iter().map(error_m).collect(),
            }
        };
        let of_tracks = observations.iter().flat_map(|one| {
            let own = one.bodies.iter().filter(|track| of_bodies[track.body - 1] != 0.0);
            own.map(move |track| of_track(one, track))
        });
        vec![SharedReadingError { source: OWN_DIRECTIONS.into(), of_tracks: of_tracks.collect() }]
    }

    /// What the reader should know.
    pub(crate) fn finding(&self) -> Finding {
        let text = match self {
            Self::Common(angle_rad) => {
                let degrees = Estimate::new(angle_rad.value.to_degrees(), angle_rad.sigma.to_degrees());
                format!(
                    "bodies move at {} degrees to the rows of the pictures. Where it is the camera that is rolled so, displacements along the chain are too \
                     small by {:.2e} of themselves, and those across it are the roll's: the first is counted as an uncertainty (hint: level the camera by the \
                     rods, or calibrate with `[camera.marks]`, which follow the chain)",
                    crate::wording::estimate(degrees),
                    self.shortening()
                )
            }
            Self::Own(of_bodies) => {
                let angle_of = |row: &usize| of_bodies[*row].abs();
                let most =
                    (0..of_bodies.len()).max_by(|a, b| angle_of(a).total_cmp(&angle_of(b))).unwrap_or(0);
                format!(
                    "bodies move each in its own direction, as in a chain that is curved: body {} at {:.2} degrees to the rows of the pictures. Along these \
                     directions they move farther than along the rows, by up to {:.2e} of that: it is counted as an uncertainty (hint: straighten the rods)",
                    most + 1,
                    of_bodies.get(most).copied().unwrap_or(0.0).to_degrees(),
                    self.shortening()
                )
            }
        };
        Finding { code: INCLINED_MOTION, subject: "the direction of motion".into(), text }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::ErrorModes;

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
        let Inclination::Common(angle_rad) = found else { panic!("{found:?}") };
        assert!((angle_rad.value - roll_rad).abs() < 1e-3 * roll_rad, "{found:?}");
        // 1 - cos 0.7 degrees
        assert!((found.shortening() / (1.0 - roll_rad.cos()) - 1.0).abs() < 1e-2);
        let mut motion = moving(|_, _| 1e-2);
        found.add_to(&mut motion);
        let sigma_m = motion.displacement_m[(0, 0)].unwrap().sigma;
        assert!((sigma_m - 1e-6_f64.hypot(1e-2 * found.shortening())).abs() < 1e-12);
    }

    #[test]
    fn a_curved_chain_is_told_body_by_body() {
        // From -1.5 to +1.5 degrees along the chain, of which the middle has none.
        let angle_rad = |row: usize| 0.6_f64.to_radians() * (row as f64 - 2.5);
        let across_m =
            |row: usize, i: usize| 1e-2 * (i as f64 / N as f64) / (1.0 + row as f64) * angle_rad(row).sin();
        let Some(Inclination::Own(found)) = told(0.0, across_m) else { panic!("nothing is told") };
        for (row, found) in found.iter().enumerate() {
            assert!((found - angle_rad(row)).abs() < 1e-3, "{row}: {found}");
        }
    }

    #[test]
    fn bodies_that_go_to_and_fro_and_small_angles_say_nothing() {
        let apart = |row: usize, i: usize| 4e-5 * ((0.7 * i as f64 + row as f64).sin());
        assert_eq!(told(0.0, apart), None);
        assert_eq!(told(1e-3, |_, _| 0.0), None, "a millionth of 10 mm is a hundredth of the uncertainty");
    }
}
