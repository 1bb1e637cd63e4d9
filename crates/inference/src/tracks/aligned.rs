//! The motion as the tracks have it, aligned by the chain model that explains them.

use std::collections::BTreeMap;

use chainwave_measurement::{Estimate, Observation, Trajectory, map_in_parallel};
use nalgebra::DVector;
use ndarray::Array2;

use super::fitted::fitted_motion;
use super::outcome::TrackFit;
use super::residuals::{ErrorOfTrack, Residual, TrackResiduals};
use super::usual_amplitudes::placed_among_ties;
use crate::damping::N_DAMPINGS;
use crate::error::FitError;
use crate::least_squares::{Own, Unknowns, Weights};
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
/// trigger moves its readings by the body's velocity, its drive by the motion's derivative, the mean of all recordings' moves the model's, and
/// the pictures' scale, where the fit found it, all of the motion in proportion. What the fit found of the usual errors of readings is taken from
/// these, and counts by what it leaves open. All of that errs together, by the fit's covariance and by where other hypotheses put it. As a sum of
/// differences from a model known in closed form it is a control variate (R. Y. Rubinstein, Simulation and the Monte Carlo Method (1981), ch. 4.3).
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
    let at = Unknowns { shared: DVector::from_vec(shared), own: fit.own() };
    let solved = problem.solve(&at)?;
    let residuals = problem.residuals(&solved, &at, &fit.usual_amplitudes.among_ties(&problem));
    let scales = Scales::of(fit);
    let seen = Seen::of(observations, &residuals, |view| solved.scale_of(view));
    let shared = SharedByReadings { of_tracks: problem.errors_of_tracks(), fit };
    let mean = fitted_motion(fit, times_s)?;
    let harder = fitted_motion(&struck_harder(fit), times_s)?;
    let inflation = fit.reduced_chi_squared.max(1.0).sqrt();
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
        let of_errors_m = shared.sums_m(&readings);
        let of_noise_m2 = (sum.1 + shared.found_m2(&of_errors_m)) / (n * n);
        // By a striker's velocity that is found too large, and an impact too late.
        let by_own = Own::new(-by_drive / mean_m_per_s, by_trigger);
        let of_each: Vec<(usize, Own)> =
            readings.iter().map(|reading| (reading.recording, by_own / n)).collect();
        let usual_m = shared.of_usual_m(&of_errors_m) / -n;
        let weights = Weights {
            of_all: -by_own / fit.recordings.len() as f64,
            of_each: &of_each,
            amplitudes: &placed_among_ties(&problem, &usual_m),
            shared: scales.of_mean(observations, &readings) * -x_m,
        };
        let of_fit_m2 = inflation * inflation * fit.errors.variance(&weights);
        let of_choice_m2 = fit.between.variance(|shift| {
            let of_own: f64 = of_each.iter().map(|(r, weight)| weight.dot(&shift.about_mean(*r))).sum();
            of_own + shift.of_usual(&usual_m) + shift.of_shared(&weights.shared)
        });
        let sigma_m = (of_noise_m2 + of_fit_m2 + of_choice_m2).sqrt();
        ((!readings.is_empty()).then(|| Estimate::new(x_m, sigma_m)), readings.len() as u32)
    };
    let of_row = |row: usize| (0..times_s.len()).map(|k| at_body(row + 1, k)).collect::<Vec<_>>();
    let shape = (fit.model.chain.n_bodies(), times_s.len());
    let rows = map_in_parallel(shape.0, fit.model.n_threads, of_row);
    Ok(AlignedMotion {
        times_s: times_s.to_vec(),
        displacement_m: Array2::from_shape_fn(shape, |(row, k)| rows[row][k].0),
        n_trials: Array2::from_shape_fn(shape, |(row, k)| rows[row][k].1),
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

    /// Variance of the sum from those that were found, which are of unit variance.
    fn found_m2(&self, sums_m: &DVector<f64>) -> f64 {
        sums_m.rows(0, self.fit.model.reading_errors.len()).norm_squared()
    }
}

/// The scales of the pictures among the shared unknowns: of all views or of one, with their values.
struct Scales {
    n_shared: usize,
    found: Vec<(usize, Quantity, f64)>,
}

impl Scales {
    fn of(fit: &TrackFit) -> Self {
        let moved = || fit.factors.iter().chain(&fit.found).zip(N_DAMPINGS..);
        let is_scale = |quantity: &Quantity| matches!(quantity, Quantity::Scale | Quantity::ScaleOfView(_));
        let found = moved().filter(|((quantity, _), _)| is_scale(quantity));
        let found = found.map(|((quantity, found), unknown)| (unknown, *quantity, found.value)).collect();
        Self { n_shared: N_DAMPINGS + moved().count(), found }
    }

    /// What one unit of each shared unknown that is a scale makes of the mean of some readings, relative to it: all readings of a view have its error
    /// alike.
    fn of_mean(&self, observations: &[Observation], readings: &[Reading]) -> DVector<f64> {
        let mut of_mean = DVector::zeros(self.n_shared);
        for (unknown, quantity, value) in &self.found {
            let is_of = |reading: &&Reading| quantity.scales(observations[reading.recording].view);
            let share = readings.iter().filter(is_of).count() as f64 / readings.len().max(1) as f64;
            of_mean[*unknown] = share / value;
        }
        of_mean
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
