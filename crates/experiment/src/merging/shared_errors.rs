//! What an error of the calibration or of the pitch does to everything that is measured, and reading between frames to the tails.

use std::num::NonZero;
use std::ops::RangeInclusive;

use chainwave_analysis::{
    Measurement, PeakEnergies, PulseSettings, Pulses, Replicas, dominant_frequency, measure_pulses,
};
use chainwave_camera::Source;
use chainwave_inference::{Damping, EnergyFit, FitError};
use chainwave_measurement::{ChainMotion, ErrorModes, ErrorSource, Estimate, Observation, map_in_parallel};
use chainwave_stitching::{Settings, Stitched, merge, power_passed};
use ndarray::Array2;

use crate::chain::measuring::{measure_motion, peak_energies_of};
use crate::configuration::Experiment;
use crate::error::Error;
use crate::input::numbers::NotNegative;
use crate::setup::Setup;
use crate::tracked::TrackedRecording;
use crate::tracks::Coordinate;

/// Errors that all recordings share, which repeating a trial does not reduce.
pub(crate) struct SharedErrors {
    /// Displacement errors of the calibration, of the time between lines, and of what a second striker does to the alignment.
    modes: ErrorModes,
    /// Relative standard uncertainty of the pitch.
    pitch: f64,
    /// Whether the calibration rests on the pitch, so that its length is the pitch's.
    rests_on_pitch: bool,
}

/// Relative scatter of drives that are taken for alike.
const ALIKE: f64 = 1e-3;

impl SharedErrors {
    /// Stitches once more, readings taken `as_merged` the first time, with each error of the calibration, and of the time between lines where the tracks told it; the differences are
    /// their effects, with what they do to the alignment of views and trials. A second striker has drives of its own, which a recording's
    /// one drive cannot follow: what it makes of the motion that all drives are alike is an error as well.
    pub(crate) fn of(
        setup: &Setup,
        recordings: &[TrackedRecording],
        as_merged: &(impl Fn(Vec<Observation>) -> Vec<Observation> + Sync),
        settings: &Settings,
        stitched: &Stitched,
        n_threads: NonZero<usize>,
    ) -> Result<Self, Error> {
        let merged = |observations| Ok(merge(&as_merged(observations), settings)?.motion);
        let along = (Coordinate::Along, recordings);
        let mut modes = calibration_modes(setup, along, &stitched.motion, n_threads, merged)?;
        if recordings.iter().any(|one| one.line_time_s.sigma > 0.0) {
            let moved =
                merged(recordings.iter().map(TrackedRecording::observation_by_later_lines).collect())?;
            modes.push(ErrorSource::LineTime, &difference(&moved, &stitched.motion));
        }
        if setup.experiment.far_striker.is_some() {
            let alike = Settings { drive_prior: ALIKE, drive_scatter: Some(ALIKE), ..settings.clone() };
            let moved = merge(&as_merged(observations(recordings)), &alike)?.motion;
            modes.push(ErrorSource::FarStriker, &difference(&moved, &stitched.motion));
        }
        let chain = &setup.experiment.chain;
        let pitch = chain.pitch_sigma_m.map_or(0.0, NotNegative::get) / chain.mean_pitch_m();
        Ok(Self { modes, pitch, rests_on_pitch: setup.map.rests_on_pitch })
    }

    /// Adds the errors to a motion's own.
    pub(crate) fn add_to(&self, motion: &mut ChainMotion) {
        motion.add_errors(self.modes.clone());
    }

    /// Measures a motion that has the errors.
    ///
    /// Where the calibration rests on the pitch, an error of the pitch changes displacements and energies but not the strain,
    /// which is a ratio of lengths in the picture: so it is left out of all but the energies.
    pub(crate) fn measure(
        &self,
        experiment: &Experiment,
        motion: &ChainMotion,
        velocity_gaps: Option<RangeInclusive<usize>>,
        n_threads: NonZero<usize>,
    ) -> Result<Measurement, Error> {
        let mut measurement = measure_motion(experiment, motion, velocity_gaps.clone(), n_threads)?;
        if self.rests_on_pitch {
            let without = free_of(motion, |source| *source == ErrorSource::CalibrationLength);
            let of_strain = measure_motion(experiment, &without, velocity_gaps, n_threads)?;
            measurement = Measurement { energies: measurement.energies, ..of_strain };
        }
        self.add_pitch(&mut measurement);
        add_interpolation(&mut measurement);
        Ok(measurement)
    }

    /// Follows the pulses of a motion that has the errors; those of the pitch as in [`SharedErrors::measure`].
    pub(crate) fn pulses(
        &self,
        experiment: &Experiment,
        motion: &ChainMotion,
        n_threads: NonZero<usize>,
    ) -> Result<Pulses, Error> {
        let spacing = experiment.chain.spacing()?;
        let analysis = &experiment.analysis;
        let replicas = Replicas { n: analysis.n_replicas, seed: analysis.seed };
        let of = |motion: &ChainMotion| {
            measure_pulses(motion, spacing, &PulseSettings::default(), replicas, n_threads)
        };
        let mut found = match self.rests_on_pitch {
            true => of(&free_of(motion, |source| *source == ErrorSource::CalibrationLength))?,
            false => of(motion)?,
        };
        let relative = |x: &mut Estimate| *x = with_error(*x, self.pitch * x.value);
        for pulse in &mut found.pulses {
            pulse.speed_m_per_s.iter_mut().for_each(relative);
            pulse.hwhm_m.iter_mut().for_each(relative);
            for pass in &mut pulse.passes {
                pass.speed_m_per_s.iter_mut().for_each(relative);
                pass.hwhm_m.iter_mut().for_each(relative);
            }
            if self.rests_on_pitch {
                // Strain times speed has the pitch once, as the speed has.
                pulse.particle_velocity_m_per_s.iter_mut().for_each(relative);
            } else {
                pulse.strain.iter_mut().for_each(relative);
                pulse.passes.iter_mut().for_each(|pass| relative(&mut pass.strain));
            }
        }
        Ok(found)
    }

    /// Fits damping to the peak energies: once as they are, and once with each of the errors, whose effects join the fit's own.
    ///
    /// Were the errors left among those of the energies, all of which they move alike and by much more than noise does, least
    /// squares would trade them against the model's shape (Peelle's puzzle). Where there are none, the energies are those that are `measured`.
    pub(crate) fn fit_energies(
        &self,
        experiment: &Experiment,
        (motion, measured): (&ChainMotion, Option<&PeakEnergies>),
        n_threads: NonZero<usize>,
        fit: impl Fn(&PeakEnergies) -> Result<EnergyFit, FitError>,
    ) -> Result<Result<EnergyFit, FitError>, Error> {
        if let (Some(energies), true) = (measured, self.modes.is_empty()) {
            return Ok(fit(energies));
        }
        let own = free_of(motion, |source| self.modes.sources().any(|own| own == source));
        let fitted = |motion: &ChainMotion| -> Result<Result<EnergyFit, FitError>, Error> {
            Ok(fit(&peak_energies_of(experiment, motion, n_threads)?))
        };
        let mut energy_fit = fitted(&own)?;
        for k in 0..self.modes.len() {
            let moved = fitted(&shifted(&own, &self.modes.displacement_m(k, motion.displacement_m.dim())))?;
            energy_fit = energy_fit.and_then(|mut energy_fit| {
                energy_fit.damping = widened(energy_fit.damping, moved?.damping);
                Ok(energy_fit)
            });
        }
        Ok(energy_fit)
    }

    /// Adds the error of the pitch to what is measured in pitches.
    fn add_pitch(&self, measurement: &mut Measurement) {
        let relative = |x: &mut Estimate| *x = with_error(*x, self.pitch * x.value);
        if let Ok(velocity) = &mut measurement.group_velocity {
            relative(&mut velocity.velocity_m_per_s);
        }
        if self.rests_on_pitch {
            // Bodies' velocities have the length of the calibration once, which the strain has not.
            measurement
                .fronts
                .iter_mut()
                .flatten()
                .filter_map(|front| front.particle_velocity_m_per_s.as_mut())
                .for_each(relative);
            let mean = measurement
                .group_velocity
                .as_mut()
                .ok()
                .and_then(|velocity| velocity.particle_velocity_m_per_s.as_mut());
            mean.into_iter().for_each(relative);
        }
        measurement.half_widths.iter_mut().for_each(|width| relative(&mut width.hwhm_m));
        if !self.rests_on_pitch {
            measurement.strain.strain.iter_mut().flatten().for_each(relative);
            measurement.fronts.iter_mut().flatten().for_each(|front| relative(&mut front.peak_strain));
        }
    }
}

/// Adds what reading between frames does to the tails' frequency: it passes less of what is faster, and so pulls the maximum of their power. By how much
/// tells the spectrum with what is lacking put back.
fn add_interpolation(measurement: &mut Measurement) {
    let frame_interval_s = measurement.strain.interval_s();
    let mut restored = measurement.spectrum.clone();
    let cycles_per_frame: Vec<f64> = restored.frequency_hz.iter().map(|hz| hz * frame_interval_s).collect();
    let gains: Vec<f64> = power_passed(&cycles_per_frame).into_iter().map(f64::sqrt).collect();
    for gap in &mut restored.gaps {
        gap.amplitude.iter_mut().zip(&gains).for_each(|(amplitude, gain)| *amplitude /= gain);
    }
    let [as_read, restored] = [&measurement.spectrum, &restored].map(dominant_frequency);
    if let (Ok(tail), Ok(as_read), Ok(restored)) = (&mut measurement.local_resonance, as_read, restored) {
        tail.frequency_hz = with_error(tail.frequency_hz, restored.frequency_hz - as_read.frequency_hz);
    }
}

fn observations(recordings: &[TrackedRecording]) -> Vec<Observation> {
    recordings.iter().map(TrackedRecording::observation).collect()
}

/// The effects of the calibration's errors on a motion: what `merged` makes of recordings that are mapped with each, less the motion.
pub(crate) fn calibration_modes(
    setup: &Setup,
    (coordinate, recordings): (Coordinate, &[TrackedRecording]),
    motion: &ChainMotion,
    n_threads: NonZero<usize>,
    merged: impl Fn(Vec<Observation>) -> Result<ChainMotion, Error> + Sync,
) -> Result<ErrorModes, Error> {
    let errors = &setup.map.of_chain.errors;
    let effect_m = |index: usize| -> Result<Array2<f64>, Error> {
        let with_error =
            |one: &TrackedRecording| one.observation_of(coordinate, &one.map.of_chain.errors[index].map);
        Ok(difference(&merged(recordings.iter().map(with_error).collect())?, motion))
    };
    let mut modes = ErrorModes::default();
    for (error, effect_m) in errors.iter().zip(map_in_parallel(errors.len(), n_threads, effect_m)) {
        let source = match error.source {
            Source::Length => ErrorSource::CalibrationLength,
            Source::Points => ErrorSource::CalibrationPoints,
        };
        modes.push(source, &effect_m?);
    }
    Ok(modes)
}

fn with_error(x: Estimate, error: f64) -> Estimate {
    Estimate::new(x.value, x.sigma.hypot(error))
}

/// A motion without the errors of some sources.
fn free_of(motion: &ChainMotion, is_left_out: impl Fn(&ErrorSource) -> bool) -> ChainMotion {
    let mut free = motion.clone();
    let left_out = motion.modes.sources().enumerate().filter(|(_, source)| is_left_out(source));
    let left_out: Vec<usize> = left_out.map(|(k, _)| k).collect();
    // The last that was added goes first: differences of squares are taken as the sums were made.
    for k in left_out.into_iter().rev() {
        subtract(&mut free, &motion.modes.displacement_m(k, motion.displacement_m.dim()));
    }
    free.modes.retain(|source| !is_left_out(source));
    free
}

/// Takes an error's share out of a motion's uncertainty.
fn subtract(motion: &mut ChainMotion, error_m: &Array2<f64>) {
    for (x, error_m) in motion.displacement_m.iter_mut().zip(error_m) {
        *x = x.map(|x| Estimate::new(x.value, (x.sigma.powi(2) - error_m.powi(2)).max(0.0).sqrt()));
    }
}

/// A motion with an error of one standard deviation.
fn shifted(motion: &ChainMotion, error_m: &Array2<f64>) -> ChainMotion {
    let mut shifted = motion.clone();
    for (x, error_m) in shifted.displacement_m.iter_mut().zip(error_m) {
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
    let columns = moved.columns_at(&motion.times_s);
    Array2::from_shape_fn(motion.displacement_m.dim(), |(row, i)| {
        let moved = columns[i].and_then(|column| moved.displacement_m[(row, column)]);
        moved.zip(motion.displacement_m[(row, i)]).map_or(0.0, |(moved, x)| moved.value - x.value)
    })
}
