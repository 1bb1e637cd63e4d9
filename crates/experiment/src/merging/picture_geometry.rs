//! A camera that does not look squarely at the chain, or whose lens distorts: told by bodies that several views show.
//!
//! A camera that is turned about the vertical shows the one end of a picture larger than the other, and a lens its ends otherwise than its
//! middle. So a body's motion looks larger in one view than in the next, by what depends on where in each picture it stands. Two shapes of error
//! are asked for when recordings are merged, of which drives, triggers and the motion are free: a scale that grows evenly along the picture, and
//! one that grows with the square of the distance from its middle. Where bodies show one or both, the pictures are mapped anew.

use std::num::NonZero;

use chainwave_camera::{Calibration, Lens, MapError, PlaneMap};
use chainwave_measurement::{
    BodyTrack, Estimate, Observation, SharedReadingError, TrackDeviation, map_in_parallel,
};
use chainwave_stitching::ShownByBody;
use nalgebra::{Matrix2, Vector2};

use super::by_neighbours::by_neighbours;
use crate::camera::calibration::ChainMap;
use crate::configuration::middle_px;
use crate::finding::Finding;
use crate::geometry::geometry_at_rest::Bent;
use crate::tracked::TrackedRecording;
use crate::tracks::Coordinate;

/// The kind of the finding that says what was told.
const PICTURE_GEOMETRY: &str = "picture_geometry";

/// What the geometry of pictures adds to the scale at their edges, relative to that in their middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PictureGeometry {
    /// By a camera that is turned about the vertical: at the right edge, and its opposite at the left one.
    tilt: f64,
    /// By the lens, at both.
    distortion: f64,
    /// Covariance of both.
    covariance: Matrix2<f64>,
}

/// Standard deviations by which a shape is told.
const DETECTION_SIGMAS: f64 = 5.0;
/// Standard deviations by which a geometry that was told changes for the last time.
const REFINED: f64 = 0.2;
/// Bodies beyond the number of shapes, at least, that tell these by their motion: fewer do not tell their own errors from them.
const LEAST_FREEDOM: f64 = 1.5;
/// What a second shape takes from chi squared, at least, where one is told: four standard deviations.
const SECOND: f64 = 16.0;
/// Amplitude by which readings are asked for a shape: far below what bends, and above rounding.
const ASKED: f64 = 1e-3;
/// How far from the chain a camera stands, in widths of its picture there: what lenses between wide and long have in common.
const WIDTHS_AWAY: f64 = 6.0;
/// No camera that still shows a chain from one end to the other is turned farther, and no lens as strong goes unseen.
const LARGEST: f64 = 0.2;

impl PictureGeometry {
    /// A camera that looks squarely through an ideal lens.
    pub(crate) const PLAIN: Self =
        Self { tilt: 0.0, distortion: 0.0, covariance: Matrix2::new(0.0, 0.0, 0.0, 0.0) };

    /// What a shape of this amplitude makes of a plain camera.
    fn by(shape: Shape, amplitude: f64) -> Self {
        match shape {
            Shape::Tilt => Self { tilt: amplitude, ..Self::PLAIN },
            Shape::Distortion => Self { distortion: amplitude, ..Self::PLAIN },
        }
    }

    /// The shapes in proportion to which recordings are asked for errors, each by itself, where their calibration leaves them open.
    pub(crate) fn asked(
        &self,
        recordings: &[TrackedRecording],
        kept: &[Observation],
        n_threads: NonZero<usize>,
    ) -> Vec<SharedReadingError> {
        let has_own = |one: &TrackedRecording| one.map.has_geometry();
        if recordings.iter().any(has_own) {
            return Vec::new();
        }
        let asked = |shape: Shape| {
            let off = self.plus(&Self::by(shape, ASKED));
            let there = |map: &PlaneMap, picture_px| off.of(map, picture_px);
            self.error_by("geometry", there, (recordings, kept), n_threads)
        };
        Shape::ALL.map(asked).into()
    }

    /// What shapes of this amplitude do to readings by plain maps; nothing where pictures were calibrated.
    pub(crate) fn open_errors(
        amplitude: f64,
        recordings: &[TrackedRecording],
        kept: &[Observation],
        n_threads: NonZero<usize>,
    ) -> Vec<SharedReadingError> {
        let mut errors = Self::PLAIN.asked(recordings, kept, n_threads);
        let of_tracks = errors.iter_mut().flat_map(|error| &mut error.of_tracks);
        of_tracks.flat_map(|track| &mut track.error_m).for_each(|error_m| *error_m *= amplitude / ASKED);
        errors
    }

    /// What readings by this geometry are off by where pictures are to be mapped otherwise, given plain maps.
    fn error_by(
        &self,
        name: &str,
        there: impl Fn(&PlaneMap, (usize, usize)) -> PlaneMap + Sync,
        (recordings, kept): (&[TrackedRecording], &[Observation]),
        n_threads: NonZero<usize>,
    ) -> SharedReadingError {
        let of_recording = |one: &TrackedRecording| -> Vec<TrackDeviation> {
            if !kept.iter().any(|seen| seen.recording == one.trial.recording) {
                return Vec::new();
            }
            let plain = &one.map.of_chain.map;
            let [here, there] = [self.of(plain, one.picture_px), there(plain, one.picture_px)]
                .map(|map| one.observation_of(Coordinate::Along, &map));
            let bodies = here.bodies.iter().zip(&there.bodies);
            bodies.map(|(here, there)| error(one, here, there)).collect()
        };
        let of_recording = |r: usize| of_recording(&recordings[r]);
        let of_tracks =
            map_in_parallel(recordings.len(), n_threads, of_recording).into_iter().flatten().collect();
        SharedReadingError { source: name.to_owned().into(), of_tracks }
    }

    /// By what bodies at rest say, of pictures that a map without geometry would show plainly.
    pub(crate) fn at_rest(bent: &Bent, map: &ChainMap, (width_px, _): (usize, usize)) -> Self {
        let half_m = 0.5 * width_px as f64 * map.m_per_px().value;
        let at_edge = [2.0 * half_m * map.side(), 3.0 * half_m.powi(2)];
        Self {
            tilt: at_edge[0] * bent.values[0],
            distortion: at_edge[1] * bent.values[1],
            covariance: Matrix2::from_fn(|k, l| at_edge[k] * at_edge[l] * bent.covariance[k][l]),
        }
    }

    /// What bodies show beyond this geometry, by the shapes of [`PictureGeometry::asked`], and of which of these; `None` where that is no more than
    /// chance.
    pub(crate) fn told(&self, shown: &[ShownByBody]) -> Option<(Self, Shapes)> {
        let alone = Shape::ALL.map(|shape| Amplitudes::of(shown, Shapes::One(shape)));
        let better = alone.into_iter().flatten().max_by(|a, b| a.gain.total_cmp(&b.gain));
        let both = Amplitudes::of(shown, Shapes::Both);
        let needs_both = |both: &Amplitudes| {
            both.gain - better.map_or(0.0, |one| one.gain) > SECOND && both.is_beyond(DETECTION_SIGMAS)
        };
        let found = both.filter(needs_both).or(better.filter(|one| one.is_beyond(DETECTION_SIGMAS)))?;
        Some((self.with(&found)?, found.shapes))
    }

    /// The same once a geometry of these shapes was told, and led to another alignment; `None` where nothing changes any more.
    pub(crate) fn refined(&self, shown: &[ShownByBody], shapes: Shapes) -> Option<Self> {
        let found = Amplitudes::of(shown, shapes)?;
        if found.is_beyond(REFINED) { self.with(&found) } else { None }
    }

    fn with(&self, found: &Amplitudes) -> Option<Self> {
        let own = |k: usize| if found.covariance[(k, k)] > 0.0 { 0.0 } else { 1.0 };
        let told = Self {
            tilt: self.tilt + ASKED * found.values[0],
            distortion: self.distortion + ASKED * found.values[1],
            covariance: Matrix2::from_fn(|k, l| {
                own(k) * own(l) * self.covariance[(k, l)] + ASKED.powi(2) * found.covariance[(k, l)]
            }),
        };
        (told.tilt.abs().max(told.distortion.abs()) < LARGEST).then_some(told)
    }

    fn plus(&self, other: &Self) -> Self {
        Self { tilt: self.tilt + other.tilt, distortion: self.distortion + other.distortion, ..*self }
    }

    /// The map of pictures of this geometry, by that of plain ones with the same scale in their middle.
    fn of(&self, plain: &PlaneMap, (width_px, height_px): (usize, usize)) -> PlaneMap {
        let (centre_px, half_px) = (middle_px(width_px, height_px), 0.5 * width_px as f64);
        // x = q / (1 + h q) with the slope 1 - 2 h q, and q = d - k1 d^3 with 1 - 3 k1 d^2, both in half widths.
        let lens = Lens { centre_px, focal_px: half_px, k1: -self.distortion / 3.0, k2: 0.0 };
        plain.seen_through(lens, -0.5 * self.tilt / half_px)
    }

    /// The map of the chain by pictures of this geometry.
    pub(crate) fn map(&self, plain: &ChainMap, picture_px: (usize, usize)) -> ChainMap {
        let bent = |map: &PlaneMap| self.of(map, picture_px);
        let errors =
            plain.of_chain.errors.iter().map(|error| MapError { map: bent(&error.map), ..error.clone() });
        plain.by(Calibration {
            map: bent(&plain.of_chain.map),
            errors: errors.collect(),
            ..plain.of_chain.clone()
        })
    }

    /// What is not known of it, as errors of the readings of recordings that were kept, each of one standard deviation.
    pub(crate) fn errors(
        &self,
        recordings: &[TrackedRecording],
        kept: &[Observation],
        n_threads: NonZero<usize>,
    ) -> Vec<SharedReadingError> {
        let eigen = self.covariance.symmetric_eigen();
        let mut errors = Vec::new();
        for k in (0..2).filter(|k| eigen.eigenvalues[*k] > 0.0) {
            let [tilt, distortion]: [f64; 2] =
                (eigen.eigenvectors.column(k) * eigen.eigenvalues[k].sqrt()).into();
            let off = self.plus(&Self { tilt, distortion, ..Self::PLAIN });
            let there = |map: &PlaneMap, picture_px| off.of(map, picture_px);
            errors.push(self.error_by(
                &format!("geometry of the pictures, {}", k + 1),
                there,
                (recordings, kept),
                n_threads,
            ));
        }
        if self.tilt != 0.0 {
            // A plane that is turned by theta looks shorter by cos theta, and tilt is theta times the distance in widths of the picture.
            let shorter = 0.5 * (WIDTHS_AWAY * self.tilt).powi(2);
            let there = |map: &PlaneMap, (width_px, height_px): (usize, usize)| {
                self.of(map, (width_px, height_px)).magnified(1.0 + shorter, middle_px(width_px, height_px))
            };
            errors.push(self.error_by("scale of a turned camera", there, (recordings, kept), n_threads));
        }
        errors
    }

    /// What the reader should know.
    pub(crate) fn finding(&self) -> Finding {
        let percent =
            |value: f64, sigma: f64| crate::wording::estimate(Estimate::new(100.0 * value, 100.0 * sigma));
        let of_shape = |k: usize, text: (&str, &str)| {
            // where a pixel is more of the chain, the picture is smaller
            let (value, sigma) = (-[self.tilt, self.distortion][k], self.covariance[(k, k)].sqrt());
            let text = if value < 0.0 { text.1 } else { text.0 };
            (sigma > 0.0).then(|| format!("{text} by {} %", percent(value.abs(), sigma)))
        };
        let shapes = [
            of_shape(
                0,
                (
                    "the right edge of the pictures is larger than their middle, and the left one smaller, as of a camera that is turned about the vertical (perspective),",
                    "the left edge of the pictures is larger than their middle, and the right one smaller, as of a camera that is turned about the vertical (perspective),",
                ),
            ),
            of_shape(
                1,
                (
                    "both edges of the pictures are larger than their middle, as of a lens that distorts,",
                    "both edges of the pictures are smaller than their middle, as of a lens that distorts,",
                ),
            ),
        ];
        let said: Vec<String> = shapes.into_iter().flatten().collect();
        Finding {
            code: PICTURE_GEOMETRY,
            subject: "the pictures' geometry".into(),
            text: format!(
                "by the places and the motion of bodies that several views show, {}. Places were mapped so, with the uncertainty of that; the scale in the middle \
                 is taken for the stated one (hint: `chainwave calibrate` with pictures of a board tells it better)",
                said.join("; ")
            ),
        }
    }
}

/// What a reading of a body by a plain map is too large by, once it has moved, where a bent one is right.
fn error(one: &TrackedRecording, plain: &BodyTrack, bent: &BodyTrack) -> TrackDeviation {
    let places = plain.position_m.iter().zip(&bent.position_m);
    let places: Vec<Option<f64>> =
        places.map(|(plain, bent)| Some(plain.as_ref()?.value - bent.as_ref()?.value)).collect();
    // The place of a reading has the reading's own noise, with which the error is compared.
    let places = by_neighbours(&places);
    // Displacements count from rest, which the first frames show.
    let at_rest_m = places.iter().flatten().next().copied().unwrap_or(0.0);
    TrackDeviation {
        recording: one.trial.recording.clone(),
        body: plain.body,
        error_m: places.iter().map(|off_m| off_m.map_or(0.0, |off_m| off_m - at_rest_m)).collect(),
    }
}

/// How the scale differs along a picture from that in its middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// It grows from one edge to the other.
    Tilt,
    /// It is another one at both edges.
    Distortion,
}

impl Shape {
    /// In the order of [`PictureGeometry::asked`].
    pub(crate) const ALL: [Self; 2] = [Self::Tilt, Self::Distortion];

    /// What an error of it is called.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Tilt => "perspective of the pictures",
            Self::Distortion => "distortion of the pictures",
        }
    }
}

/// Which of the shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shapes {
    One(Shape),
    Both,
}

/// How much of the shapes bodies show.
#[derive(Debug, Clone, Copy)]
struct Amplitudes {
    shapes: Shapes,
    values: Vector2<f64>,
    covariance: Matrix2<f64>,
    /// What they take from chi squared.
    gain: f64,
}

impl Amplitudes {
    /// `None` where bodies do not tell them apart.
    fn of(shown: &[ShownByBody], shapes: Shapes) -> Option<Self> {
        let keep = match shapes {
            Shapes::One(Shape::Tilt) => Matrix2::new(1.0, 0.0, 0.0, 0.0),
            Shapes::One(Shape::Distortion) => Matrix2::new(0.0, 0.0, 0.0, 1.0),
            Shapes::Both => Matrix2::identity(),
        };
        let of_body = |one: &ShownByBody| {
            let matrix = Matrix2::from_fn(|row, column| one.matrix[(row, column)]);
            let right_side = Vector2::from_fn(|row, _| one.right_side[row]);
            (keep * matrix * keep, keep * right_side)
        };
        let bodies: Vec<(Matrix2<f64>, Vector2<f64>)> = shown.iter().map(of_body).collect();
        let matrix: Matrix2<f64> = bodies.iter().map(|(matrix, _)| matrix).sum();
        let right_side: Vector2<f64> = bodies.iter().map(|(_, right_side)| right_side).sum();
        let others = Matrix2::identity() - keep;
        let inverse = (matrix + others).cholesky()?.inverse() - others;
        let values = inverse * right_side;
        // A body's own errors, which all its readings share, are no noise of single readings: bodies scatter by them (H. White, Econometrica 48
        // (1980) 817, by groups).
        let n_shapes = keep.trace();
        let weights = || bodies.iter().map(|(matrix, _)| matrix.trace());
        let n_bodies = weights().sum::<f64>().powi(2) / weights().map(|weight| weight * weight).sum::<f64>();
        if n_bodies.is_nan() || n_bodies < n_shapes + LEAST_FREEDOM {
            return None;
        }
        let left = |(matrix, right_side): &(Matrix2<f64>, Vector2<f64>)| right_side - matrix * values;
        let scatter: Matrix2<f64> = bodies.iter().map(left).map(|left| left * left.transpose()).sum();
        let by_bodies = inverse * scatter * inverse * (n_bodies / (n_bodies - n_shapes));
        let enlarged = (0..2)
            .map(|k| by_bodies[(k, k)] / inverse[(k, k)])
            .filter(|ratio| ratio.is_finite())
            .fold(1.0, f64::max);
        Some(Self {
            shapes,
            values,
            covariance: inverse * enlarged,
            gain: right_side.dot(&values) / enlarged,
        })
    }

    /// Whether each of the shapes is larger than so many standard deviations.
    fn is_beyond(&self, sigmas: f64) -> bool {
        let is_beyond = |k: usize| self.values[k].abs() > sigmas * self.covariance[(k, k)].sqrt();
        match self.shapes {
            Shapes::One(Shape::Tilt) => is_beyond(0),
            Shapes::One(Shape::Distortion) => is_beyond(1),
            Shapes::Both => is_beyond(0) || is_beyond(1),
        }
    }
}
