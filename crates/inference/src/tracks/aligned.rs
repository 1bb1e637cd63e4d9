//! The motion as the tracks have it, aligned by the chain model that explains them.

use std::collections::BTreeMap;

use chainwave_measurement::{Estimate, Observation, Trajectory};
use nalgebra::DVector;
use ndarray::Array2;

use super::fitted::fitted_motion;
use super::outcome::{FittedRecording, TrackFit};
use super::residuals::{ErrorOfTrack, Residual, TrackResiduals};
use crate::error::FitError;
use crate::least_squares::{Own, Unknowns};
use crate::quantity::Quantity;

/// Displacements from rest of all bodies, as the mean striker moves them at the mean trigger.
#[derive(Debug, Clone, PartialEq)]
pub struct AlignedMotion {
    /// Sample times in seconds, after the mean trigger.
    pub times_s: Vec<f64>,
    /// Displacement in metres, shape `[body, time]`; `None` where no recording saw the body.
    pub displacement_m: Array2<Option<Estimate>>,
    /// Recordings behind each, in the same shape.
    pub n_trials: Array2<u32>,
}

/// A relative step in the strikers' velocity, for the motion's derivative by it: rounding and curvature are both below 1e-6 of it.
const DRIVE_STEP: f64 = 1e-3;

/// What the recordings saw of each body over the model's motion of their own striker at their own impact, averaged over them, on top of the
/// model's mean motion.
///
/// Nothing of the model's shape remains in it: what its motion of one recording misses, this recording's readings bring back. The model
/// serves to know the triggers and drives, far better than a body's own readings do, and its uncertainty counts through these: a recording's
/// trigger moves its readings by the body's velocity, its drive by the motion's derivative, the mean of all recordings' moves the model's, and the pictures' scale, where the fit found it,
/// all of the motion in proportion. What the fit found of the usual errors of readings is taken from these, and counts by what it leaves open. As a sum of differences from a model known in
/// closed form it is a control variate (R. Y. Rubinstein, Simulation and the Monte Carlo Method (1981), ch. 4.3).
///
/// # Errors
/// [`FitError::Model`] when the chain model refuses the fitted values, [`FitError::TooFew`] for observations that are not those of the fit.
pub fn aligned_motion(
    observations: &[Observation],
    fit: &TrackFit,
    times_s: &[f64],
) -> Result<AlignedMotion, FitError> {
    if observations.len() != fit.recordings.len() {
        let (expected, found) = (fit.recordings.len(), observations.len());
        return Err(FitError::TooFew { what: "recordings of the fit", expected, found });
    }
    let asked: Vec<Quantity> = fit.found.iter().map(|(quantity, _)| *quantity).collect();
    let problem = TrackResiduals::new(observations, &fit.model, &asked)?;
    let dampings = [fit.damping.chain_damping_kg_per_s, fit.damping.striker_damping_kg_per_s];
    let moved = fit.factors.iter().chain(&fit.found).map(|(_, found)| *found);
    let shared: Vec<f64> = dampings.into_iter().chain(moved).map(|found| found.value).collect();
    let own = fit
        .recordings
        .iter()
        .map(|one| Own::new(one.striker_velocity_m_per_s.value, one.impact_time_s.value));
    let at = Unknowns { shared: DVector::from_vec(shared), own: own.collect() };
    let solved = problem.solve(&at)?;
    let residuals = problem.residuals(&solved, &at, &fit.usual_amplitudes.among_ties(&problem));
    let scale = fit.factors.iter().chain(&fit.found).find(|(quantity, _)| *quantity == Quantity::Scale);
    let scale = scale.map_or(Estimate::new(1.0, 0.0), |(_, found)| *found);
    let view_scales = ViewScales::of(fit);
    let seen = Seen::of(observations, &residuals, |view| solved.scale_of(view));
    let shared = SharedByReadings { of_tracks: problem.errors_of_tracks(), fit };
    let mean = fitted_motion(fit, times_s)?;
    let harder = fitted_motion(&struck_harder(fit), times_s)?;
    let inflation = fit.reduced_chi_squared.max(1.0).sqrt();
    // Of noise alone, as that of each recording is its own: what the choice between hypotheses does to them is shared.
    let sigmas = |of: fn(&FittedRecording) -> Estimate| -> Vec<f64> {
        (0..fit.recordings.len()).map(|r| of(&fit.recording_by_noise(r)).sigma).collect()
    };
    let triggers = OfRecordings::about_their_mean(&sigmas(|one| one.trigger_offset_s));
    let drives = OfRecordings::about_their_mean(&sigmas(|one| one.drive_deviation));
    let mean_m_per_s = fit.striker_velocity_m_per_s.value;
    let at_body = |body: usize, k: usize| {
        let after_impact_s = times_s[k] - fit.impact_time_s.value;
        let readings = seen.at(body, after_impact_s);
        let n = readings.len() as f64;
        let by_trigger = mean.velocity_m_per_s[(body - 1, k)];
        let by_drive = slope(&harder, &mean, body, k);
        let sum = readings.iter().fold((0.0, 0.0), |(value, variance), reading| {
            (value + reading.off_m.value, variance + (inflation * reading.off_m.sigma).powi(2))
        });
        let x_m = mean.displacement_m[(body - 1, k)] + sum.0 / n;
        let shared_m = shared.sums_m(&readings);
        let of_noise_m2 = (sum.1 + shared.variance_m2(&shared_m)) / (n * n);
        let of_triggers_m2 = by_trigger.powi(2) * triggers.variance(&readings);
        let of_drives_m2 = by_drive.powi(2) * drives.variance(&readings);
        // The impact being later, a reading is one of an earlier time.
        let of_choice_m2 = fit.between.variance(|shift| {
            let moved = |reading: &Reading| {
                let own = shift.about_mean(reading.recording);
                by_drive * own[0] / mean_m_per_s - by_trigger * own[1]
            };
            (readings.iter().map(moved).sum::<f64>() + shift.of_usual(&shared.of_usual_m(&shared_m))) / n
        });
        let of_scales = (scale.sigma / scale.value).hypot(view_scales.of_mean(observations, &readings));
        let of_all_m2 = of_noise_m2 + of_triggers_m2 + of_drives_m2 + of_choice_m2;
        let sigma_m = of_all_m2.sqrt().hypot(x_m * of_scales);
        ((!readings.is_empty()).then(|| Estimate::new(x_m, sigma_m)), readings.len() as u32)
    };
    let shape = (fit.model.chain.n_bodies(), times_s.len());
    let all = Array2::from_shape_fn(shape, |(row, k)| at_body(row + 1, k));
    Ok(AlignedMotion {
        times_s: times_s.to_vec(),
        displacement_m: all.mapv(|(x, _)| x),
        n_trials: all.mapv(|(_, n)| n),
    })
}

/// The errors that readings share.
struct SharedByReadings<'a> {
    of_tracks: Vec<Vec<ErrorOfTrack>>,
    fit: &'a TrackFit,
}

impl SharedByReadings<'_> {
    /// What one standard deviation of each makes of a sum of readings.
    fn sums_m(&self, readings: &[Reading]) -> DVector<f64> {
        let n = self.fit.model.reading_errors.len() + self.fit.model.usual_errors.len();
        let mut sums_m = DVector::zeros(n);
        for reading in readings {
            for error in &self.of_tracks[reading.track] {
                sums_m[error.error] += error.of_residuals_m[reading.position] / reading.scale;
            }
        }
        sums_m
    }

    /// The part of that which usual errors have.
    fn of_usual_m(&self, sums_m: &DVector<f64>) -> DVector<f64> {
        let n_found = self.fit.model.reading_errors.len();
        sums_m.rows(n_found, sums_m.len() - n_found).into_owned()
    }

    /// Variance of the sum from them. Those that were found are of unit variance; of the usual ones the fit tells more.
    fn variance_m2(&self, sums_m: &DVector<f64>) -> f64 {
        let n_found = self.fit.model.reading_errors.len();
        sums_m.rows(0, n_found).norm_squared() + self.fit.usual_amplitudes.variance(&self.of_usual_m(sums_m))
    }
}

/// Relative standard uncertainty of the scale of each view that has one of its own.
struct ViewScales(BTreeMap<u32, f64>);

impl ViewScales {
    fn of(fit: &TrackFit) -> Self {
        let of_view = |(quantity, found): &(Quantity, Estimate)| match quantity {
            Quantity::ScaleOfView(view) => Some((*view, found.sigma / found.value)),
            _ => None,
        };
        Self(fit.factors.iter().chain(&fit.found).filter_map(of_view).collect())
    }

    /// What they make of the mean of some readings, relative to it: all readings of a view have its error alike.
    fn of_mean(&self, observations: &[Observation], readings: &[Reading]) -> f64 {
        let share_of = |view: u32| {
            let n = readings.iter().filter(|reading| observations[reading.recording].view == view).count();
            n as f64 / readings.len() as f64
        };
        self.0.iter().map(|(view, sigma)| (share_of(*view) * sigma).powi(2)).sum::<f64>().sqrt()
    }
}

/// Variances of what the fit found of each recording, without what all share.
struct OfRecordings {
    variances: Vec<f64>,
}

impl OfRecordings {
    /// From the standard uncertainties of differences from the mean of all: of N independent errors of variances s, the differences' are `(1 - 2 / N) s`
    /// and the sum of all s over the square of N. Two of them do not tell whose each part is.
    fn about_their_mean(sigmas: &[f64]) -> Self {
        let n = sigmas.len() as f64;
        let squares = || sigmas.iter().map(|sigma| sigma * sigma);
        let of_all = squares().sum::<f64>() / (1.0 - 1.0 / n);
        let own = |square: f64| match n > 2.0 {
            true => ((square - of_all / (n * n)) / (1.0 - 2.0 / n)).max(0.0),
            false => of_all / n,
        };
        let variances = if n > 1.0 { squares().map(own).collect() } else { vec![0.0; sigmas.len()] };
        Self { variances }
    }

    /// Variance of the mean over all recordings, which the model's motion has, less that over those of some readings, which was taken from them.
    fn variance(&self, readings: &[Reading]) -> f64 {
        let [of_all, of_seen] = [self.variances.len(), readings.len()].map(|n| (n as f64).recip());
        let all = self.variances.iter().sum::<f64>() * of_all * of_all;
        let seen: f64 = readings.iter().map(|reading| self.variances[reading.recording]).sum();
        (all + seen * (of_seen * of_seen - 2.0 * of_all * of_seen)).max(0.0)
    }
}

/// Derivative of a displacement by the relative velocity of the strikers.
fn slope(harder: &Trajectory, mean: &Trajectory, body: usize, k: usize) -> f64 {
    (harder.displacement_m[(body - 1, k)] - mean.displacement_m[(body - 1, k)]) / DRIVE_STEP
}

fn struck_harder(fit: &TrackFit) -> TrackFit {
    let mut harder = fit.clone();
    for one in &mut harder.recordings {
        one.striker_velocity_m_per_s.value *= 1.0 + DRIVE_STEP;
    }
    harder
}

/// What a recording saw of a body, over the model.
#[derive(Debug, Clone, Copy)]
struct Reading {
    recording: usize,
    after_impact_s: f64,
    off_m: Estimate,
    /// Its track among all of them, and its place among the track's readings.
    track: usize,
    position: usize,
    /// Length in its picture over true length.
    scale: f64,
}

/// The readings of each body and recording, in the order of their times.
struct Seen {
    tracks: BTreeMap<(usize, usize), Vec<Reading>>,
    /// Half the interval between frames, for each recording.
    reach_s: Vec<f64>,
}

impl Seen {
    /// `scale_of` is length in the pictures of a view over true length.
    fn of(observations: &[Observation], residuals: &[Residual], scale_of: impl Fn(u32) -> f64) -> Self {
        let of_tracks = observations.iter().flat_map(|observation| &observation.bodies).enumerate();
        let places = of_tracks.flat_map(|(track, of_track)| {
            let sigmas_m = of_track.position_m.iter().flatten().map(|x| x.sigma);
            sigmas_m.enumerate().map(move |(position, sigma_m)| (track, position, sigma_m))
        });
        let mut tracks: BTreeMap<(usize, usize), Vec<Reading>> = BTreeMap::new();
        for (residual, (track, position, sigma_m)) in residuals.iter().zip(places) {
            let scale = scale_of(observations[residual.recording].view);
            // Residuals are model less measurement.
            let off_m = Estimate::new(-residual.value * sigma_m / scale, sigma_m / scale);
            let Residual { recording, body, after_impact_s, .. } = *residual;
            let reading = Reading { recording, after_impact_s, off_m, track, position, scale };
            tracks.entry((body, recording)).or_default().push(reading);
        }
        let reach_s = observations.iter().map(|observation| 0.5 * observation.frame_interval_s()).collect();
        Self { tracks, reach_s }
    }

    /// The reading of each recording that is nearest to a time, no farther than half a frame.
    fn at(&self, body: usize, after_impact_s: f64) -> Vec<Reading> {
        let nearest = |(&(_, recording), track): (&(usize, usize), &Vec<Reading>)| {
            let behind = track.partition_point(|reading| reading.after_impact_s < after_impact_s);
            let away = |reading: &Reading| (reading.after_impact_s - after_impact_s).abs();
            let candidates = track[behind.saturating_sub(1)..].iter().take(2);
            let best = candidates.min_by(|a, b| away(a).total_cmp(&away(b)))?;
            // Rounding of frame times.
            (away(best) <= 1.001 * self.reach_s[recording]).then_some(*best)
        };
        self.tracks.range((body, 0)..(body + 1, 0)).filter_map(nearest).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn readings(of: &[usize]) -> Vec<Reading> {
        let of = of.iter().map(|&recording| Reading {
            recording,
            after_impact_s: 0.0,
            off_m: Estimate::new(0.0, 0.0),
            track: 0,
            position: 0,
            scale: 1.0,
        });
        of.collect()
    }

    #[test]
    fn errors_of_recordings_that_did_not_see_a_body_reach_it_through_the_mean() {
        // Four are known exactly, one badly: its error moves the mean by a fifth, and by that each difference from it.
        let differences = [0.2, 0.2, 0.2, 0.2, 0.8];
        let found = OfRecordings::about_their_mean(&differences);
        for (variance, truth) in found.variances.iter().zip([0.0, 0.0, 0.0, 0.0, 1.0]) {
            assert!((variance - truth).abs() < 1e-12, "{:?}", found.variances);
        }
        // Four that saw it cannot average it out; where all saw it, what the mean has is what the readings took.
        assert!((found.variance(&readings(&[0, 1, 2, 3])) - 0.04).abs() < 1e-12);
        assert!(found.variance(&readings(&[0, 1, 2, 3, 4])).abs() < 1e-12);
        assert!((found.variance(&readings(&[4])) - 0.64).abs() < 1e-12);
        assert!(OfRecordings::about_their_mean(&[0.0]).variance(&readings(&[0])).abs() < 1e-15);
        assert!((OfRecordings::about_their_mean(&[0.5, 0.5]).variance(&readings(&[0])) - 0.25).abs() < 1e-12);
    }
}
