//! What an error of the calibration or of the pitch does to everything that is measured.

use std::ops::RangeInclusive;

use chainwave_analysis::Measurement;
use chainwave_camera::{MapError, Source};
use chainwave_measurement::{ChainMotion, ErrorMode, Estimate, Observation};
use chainwave_mechanics::PowerLaw;
use chainwave_stitching::{Settings, Stitched, merge};
use ndarray::Array2;

use super::Job;
use super::evaluation::measure_motion;
use super::tracking::{Tracked, observation};
use crate::error::Error;
use crate::experiment::NotNegative;
use crate::parallel::map_in_parallel;

/// Errors that all recordings share, which repeating a trial does not reduce.
pub(crate) struct SharedErrors {
    /// Displacement errors of the calibration.
    modes: Vec<ErrorMode>,
    /// Relative standard uncertainty of the pitch.
    pitch: f64,
    /// Which of the modes is an error of the pitch, where the calibration rests on it.
    of_pitch: Option<usize>,
}

impl SharedErrors {
    /// Stitches once more with each error of the calibration; the differences are its effects, with what they do to the
    /// alignment of views and trials.
    pub(crate) fn of(
        job: &Job,
        tracked: &Tracked,
        settings: &Settings,
        stitched: &Stitched,
    ) -> Result<Self, Error> {
        let errors = &job.calibration.of_chain.errors;
        let mode = |error: &MapError| -> Result<ErrorMode, Error> {
            let pairs = tracked.trials.iter().zip(&tracked.tables);
            let observations: Vec<Observation> = pairs
                .map(|(trial, table)| observation(trial, table, &error.map))
                .collect::<Result<_, _>>()?;
            let moved = merge(&observations, settings)?.motion;
            let source = match error.source {
                Source::Length => "calibration: length",
                Source::Points => "calibration: points",
            };
            Ok(ErrorMode { source: source.into(), displacement_m: difference(&moved, &stitched.motion) })
        };
        let modes = map_in_parallel(job.jobs, errors, mode).into_iter().collect::<Result<_, _>>()?;
        let chain = &job.experiment.chain;
        let pitch = chain.pitch_sigma_m.map_or(0.0, NotNegative::get) / chain.pitch_m.get();
        let is_length = |error: &MapError| error.source == Source::Length;
        let of_pitch = errors.iter().position(is_length).filter(|_| job.calibration.rests_on_pitch);
        Ok(Self { modes, pitch, of_pitch })
    }

    /// Adds the errors to a motion's own.
    pub(crate) fn add_to(&self, motion: &mut ChainMotion) {
        for mode in &self.modes {
            for (x, error_m) in motion.displacement_m.iter_mut().zip(&mode.displacement_m) {
                *x = x.map(|x| with_error(x, *error_m));
            }
        }
        motion.modes.extend(self.modes.iter().cloned());
    }

    /// Measures a motion that has the errors.
    ///
    /// Where the calibration rests on the pitch, an error of the pitch changes displacements and energies but not the strain,
    /// which is a ratio of lengths in the picture: so it is left out of all but the energies.
    pub(crate) fn measure(
        &self,
        job: &Job,
        motion: &ChainMotion,
        law: &PowerLaw,
        velocity_gaps: Option<RangeInclusive<usize>>,
    ) -> Result<Measurement, Error> {
        let mut measurement = measure_motion(job, motion, law, velocity_gaps.clone())?;
        if let Some(of_pitch) = self.of_pitch {
            let mut without = motion.clone();
            let mode = without.modes.remove(motion.modes.len() - self.modes.len() + of_pitch);
            for (x, error_m) in without.displacement_m.iter_mut().zip(&mode.displacement_m) {
                *x = x.map(|x| Estimate::new(x.value, (x.sigma.powi(2) - error_m.powi(2)).max(0.0).sqrt()));
            }
            let of_strain = measure_motion(job, &without, law, velocity_gaps)?;
            measurement = Measurement { energies: measurement.energies, ..of_strain };
        }
        self.add_pitch(&mut measurement);
        Ok(measurement)
    }

    /// Adds the error of the pitch to what is measured in pitches.
    fn add_pitch(&self, measurement: &mut Measurement) {
        let relative = |x: &mut Estimate| *x = with_error(*x, self.pitch * x.value);
        if let Ok(velocity) = &mut measurement.group_velocity {
            relative(&mut velocity.velocity_m_per_s);
        }
        measurement.half_widths.iter_mut().for_each(|width| relative(&mut width.hwhm_m));
        if self.of_pitch.is_none() {
            measurement.strain.strain.iter_mut().flatten().for_each(relative);
            measurement.fronts.iter_mut().flatten().for_each(|front| relative(&mut front.peak_strain));
        }
    }
}

fn with_error(x: Estimate, error: f64) -> Estimate {
    Estimate::new(x.value, x.sigma.hypot(error))
}

/// One motion less the other at the other's times; 0 where either lacks the body. Both have times that are multiples of one
/// interval.
fn difference(moved: &ChainMotion, motion: &ChainMotion) -> Array2<f64> {
    let column = |time_s: f64| {
        let interval_s = motion.times_s.get(1).map_or(1.0, |second| second - motion.times_s[0]);
        let index = moved.times_s.partition_point(|moved_s| *moved_s < time_s - 0.5 * interval_s);
        (index < moved.times_s.len() && moved.times_s[index] < time_s + 0.5 * interval_s).then_some(index)
    };
    let columns: Vec<Option<usize>> = motion.times_s.iter().map(|time_s| column(*time_s)).collect();
    Array2::from_shape_fn(motion.displacement_m.dim(), |(row, i)| {
        let moved = columns[i].and_then(|column| moved.displacement_m[(row, column)]);
        moved.zip(motion.displacement_m[(row, i)]).map_or(0.0, |(moved, x)| moved.value - x.value)
    })
}
