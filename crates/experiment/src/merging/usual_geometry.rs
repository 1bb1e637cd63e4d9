//! What a camera that nothing calibrated leaves open: a lens that distorts a little, a turn by tenths of a degree.
//!
//! Views that agree exclude what moves a body by more than noise, but far less than that moves a damping: a scale that grows along the picture makes
//! amplitudes grow or fall along the chain, as damping does. So fits of dampings contain it where no geometry was told, though the motion does not.

use std::borrow::Cow;
use std::num::NonZero;

use chainwave_inference::UsualAmplitudes;
use chainwave_measurement::{ChainMotion, Observation, SharedReadingError};
use chainwave_stitching::{Alignment, Assumption, Stitched};
use ndarray::Array2;

use super::joint::Joint;
use super::picture_geometry::{PictureGeometry, Shape};
use crate::finding::Finding;

/// Errors of a usual geometry, each of one standard deviation.
#[derive(Debug, Clone, Default)]
pub(crate) struct UsualGeometry {
    /// Of the readings.
    pub(crate) errors: Vec<SharedReadingError>,
    /// Of the motion that was merged of them, in metres, shape `[body, time]`.
    errors_m: Vec<Array2<f64>>,
    /// Standard deviation of the scale at a picture's edge, relative to that in its middle.
    sigma: f64,
}

impl UsualGeometry {
    /// Of recordings that were merged; nothing where pictures were calibrated, or bodies told a geometry.
    pub(crate) fn of(joint: &Joint<'_>, n_threads: NonZero<usize>) -> Self {
        let sigma = joint.setup.experiment.camera.geometry_sigma();
        if sigma == 0.0 || joint.geometry.is_some() {
            return Self::default();
        }
        let Stitched { motion, alignments, .. } = &joint.stitched;
        let kept = joint.observations.as_slice();
        let errors = PictureGeometry::open_errors(sigma, &joint.recordings, kept, n_threads);
        let errors_m = errors.iter().map(|error| of_motion(error, kept, motion, alignments)).collect();
        Self { errors, errors_m, sigma }
    }

    /// A motion with these errors among its own.
    pub(crate) fn added_to<'a>(&self, motion: &'a ChainMotion) -> Cow<'a, ChainMotion> {
        let mut motion = Cow::Borrowed(motion);
        for (error, error_m) in self.errors.iter().zip(&self.errors_m) {
            motion.to_mut().add_error(error.source.clone(), error_m);
        }
        motion
    }

    /// The shapes that the chain model tells, of these amplitudes, that views do not, and the motion is off by.
    pub(crate) fn told(&self, amplitudes: &UsualAmplitudes, motion: &ChainMotion) -> Vec<ToldByModel<'_>> {
        let shapes = Shape::ALL.into_iter().zip(amplitudes.estimates()).zip(&self.errors_m);
        let told = shapes.filter(|((_, amplitude), error_m)| {
            UsualAmplitudes::is_told(*amplitude)
                && amplitude.value.abs() * largest_share(error_m, motion) > NOTICED
        });
        let told = told.map(|((shape, amplitude), error_m)| ToldByModel {
            shape,
            size: amplitude.value.abs(),
            at_edges: self.sigma * amplitude.value.abs(),
            error_m,
        });
        told.collect()
    }

    /// What is taken to be so, where anything is.
    pub(crate) fn assumption(&self) -> Option<Assumption> {
        (!self.errors.is_empty()).then(|| Assumption {
            of: "assumed: lens and turn of a camera that was not calibrated",
            value: self.sigma,
            in_words: format!(
                "{} of the scale at a picture's edge, relative to its middle (standard deviation)",
                self.sigma
            ),
            decides: "the uncertainty of dampings, which amplitudes along the chain tell",
            reason: "camera.geometry_sigma, or a usual lens and a camera that is set up by eye",
        })
    }
}

/// A shape of error of a camera that nothing calibrated, as the chain model tells it.
pub(crate) struct ToldByModel<'a> {
    shape: Shape,
    /// In standard deviations of what is usual.
    size: f64,
    /// Of the scale at a picture's edge, relative to its middle.
    at_edges: f64,
    /// What one standard deviation makes of the motion, in metres, shape `[body, time]`.
    error_m: &'a Array2<f64>,
}

impl ToldByModel<'_> {
    /// A motion, which no model has put right, with the whole of what is told among its errors.
    pub(crate) fn counted_in(told: &[Self], motion: &ChainMotion) -> ChainMotion {
        let mut motion = motion.clone();
        for one in told {
            motion.add_error(
                format!("{}, by the chain model", one.shape.name()).into(),
                &(one.error_m * one.size),
            );
        }
        motion
    }

    /// What the reader should know, where there is any.
    pub(crate) fn finding(told: &[Self]) -> Option<Finding> {
        let in_words =
            |one: &Self| format!("{}, by {:.2} % at the edges", in_words(one.shape), 100.0 * one.at_edges);
        let said: Vec<String> = told.iter().map(in_words).collect();
        (!said.is_empty()).then(|| Finding {
            code: "geometry_by_model",
            subject: "the pictures' geometry".into(),
            text: format!(
                "by the chain model the readings are off as {}. The dampings and motion_by_model contain it; x_n(t), strains and energies do not, as \
                 they are free of any model, and count all of it as an uncertainty (hint: `chainwave calibrate` with pictures of a board tells it)",
                said.join(", and as ")
            ),
        })
    }
}

/// Share of a standard uncertainty by which x_n(t) is off somewhere, at least, where it matters: 95 % intervals hold 92 % then.
const NOTICED: f64 = 0.5;

/// The largest of an error of the motion over the motion's standard uncertainty.
fn largest_share(error_m: &Array2<f64>, motion: &ChainMotion) -> f64 {
    let shares = error_m.iter().zip(&motion.displacement_m);
    shares.filter_map(|(error_m, x_m)| Some(error_m.abs() / x_m.as_ref()?.sigma)).fold(0.0, f64::max)
}

/// What a shape looks like.
fn in_words(shape: Shape) -> &'static str {
    match shape {
        Shape::Tilt => {
            "a camera that is turned about the vertical would do (a scale that grows from one edge of a picture to the other)"
        }
        Shape::Distortion => "a lens that distorts would do (a scale at both edges other than in the middle)",
    }
}

/// An error of readings as one of the motion: the mean over the recordings that show a body at a time.
fn of_motion(
    error: &SharedReadingError,
    observations: &[Observation],
    motion: &ChainMotion,
    alignments: &[Alignment],
) -> Array2<f64> {
    let mut sum_m = Array2::zeros(motion.displacement_m.dim());
    let mut n = Array2::<f64>::zeros(motion.displacement_m.dim());
    for of_track in &error.of_tracks {
        let own = |one: &&Alignment| one.recording == of_track.recording;
        let (Some(observation), Some(alignment)) = (
            observations.iter().find(|one| one.recording == of_track.recording),
            alignments.iter().find(own),
        ) else {
            continue;
        };
        let times_s: Vec<f64> =
            observation.times_s.iter().map(|time_s| time_s - alignment.trigger_offset_s.value).collect();
        for (column, error_m) in motion.columns_at(&times_s).into_iter().zip(&of_track.error_m) {
            if let Some(column) = column {
                sum_m[(of_track.body - 1, column)] += error_m;
                n[(of_track.body - 1, column)] += 1.0;
            }
        }
    }
    sum_m.zip_mut_with(&n, |sum_m, n| *sum_m = if *n > 0.0 { *sum_m / n } else { 0.0 });
    sum_m
}
