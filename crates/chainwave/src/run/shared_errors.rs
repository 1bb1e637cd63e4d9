//! What an error of the calibration or of the pitch does to everything that is measured.

use std::ops::RangeInclusive;

use chainwave_analysis::fit::{Damping, EnergyFit, FitError};
use chainwave_analysis::{Measurement, PeakEnergies};
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
            subtract(&mut without, &mode);
            let of_strain = measure_motion(job, &without, law, velocity_gaps)?;
            measurement = Measurement { energies: measurement.energies, ..of_strain };
        }
        self.add_pitch(&mut measurement);
        Ok(measurement)
    }

    /// Fits damping to the peak energies: once as they are, and once with each of the errors, whose effects join the fit's own.
    ///
    /// Were the errors left among those of the energies, all of which they move alike and by much more than noise does, least
    /// squares would trade them against the model's shape (Peelle's puzzle).
    pub(crate) fn fit_energies(
        &self,
        job: &Job,
        motion: &ChainMotion,
        law: &PowerLaw,
        fit: impl Fn(Option<&PeakEnergies>, &[f64]) -> Result<EnergyFit, FitError>,
    ) -> Result<Result<EnergyFit, FitError>, Error> {
        let own = self.without_errors(motion);
        let fitted = |motion: &ChainMotion| -> Result<Result<EnergyFit, FitError>, Error> {
            let measurement = measure_motion(job, motion, law, None)?;
            Ok(fit(measurement.energies.as_ref(), &motion.times_s))
        };
        let mut energy_fit = fitted(&own)?;
        for mode in &self.modes {
            let moved = fitted(&shifted(&own, mode))?;
            energy_fit = energy_fit.and_then(|mut energy_fit| {
                energy_fit.damping = widened(energy_fit.damping, moved?.damping);
                Ok(energy_fit)
            });
        }
        Ok(energy_fit)
    }

    /// A motion as it was before the errors were added.
    fn without_errors(&self, motion: &ChainMotion) -> ChainMotion {
        let mut own = motion.clone();
        for _ in &self.modes {
            if let Some(mode) = own.modes.pop() {
                subtract(&mut own, &mode);
            }
        }
        own
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

/// Takes a mode's share out of a motion's uncertainty.
fn subtract(motion: &mut ChainMotion, mode: &ErrorMode) {
    for (x, error_m) in motion.displacement_m.iter_mut().zip(&mode.displacement_m) {
        *x = x.map(|x| Estimate::new(x.value, (x.sigma.powi(2) - error_m.powi(2)).max(0.0).sqrt()));
    }
}

/// A motion with an error of one standard deviation.
fn shifted(motion: &ChainMotion, mode: &ErrorMode) -> ChainMotion {
    let mut shifted = motion.clone();
    for (x, error_m) in shifted.displacement_m.iter_mut().zip(&mode.displacement_m) {
        *x = x.map(|x| Estimate::new(x.value + error_m, x.sigma));
    }
    shifted
}

/// Damping with one more error, of which `moved` is what one standard deviation makes of it.
fn widened(damping: Damping, moved: Damping) -> Damping {
    let (c_d, c_s) = (damping.chain_damping_kg_per_s, damping.striker_damping_kg_per_s);
    let by =
        [moved.chain_damping_kg_per_s.value - c_d.value, moved.striker_damping_kg_per_s.value - c_s.value];
    let covariance = damping.correlation * c_d.sigma * c_s.sigma + by[0] * by[1];
    let (c_d, c_s) = (with_error(c_d, by[0]), with_error(c_s, by[1]));
    Damping {
        chain_damping_kg_per_s: c_d,
        striker_damping_kg_per_s: c_s,
        correlation: covariance / (c_d.sigma * c_s.sigma),
    }
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
