use std::num::NonZero;

use chainwave_measurement::{Estimate, Observation, Trajectory};
use chainwave_mechanics::{Chain, Drive, Schedule, ensemble};
use nalgebra::DVector;
use ndarray::Array2;

use super::arrow::{Own, OwnCovariance};
use super::bootstrap::{OverTrials, bootstrap};
use super::family::Family;
use super::profile::{Interval, interval_95};
use super::quantity::{Known, Quantity};
use super::search::{Minimum, search, undetermined};
use super::track_problem::{N_DAMPINGS, Problem, SAMPLES_PER_FRAME, State, range_of, struck};
use super::{Damping, FitError};

/// What is assumed of the experiment behind the tracks, and where the search begins.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackModel {
    /// The chain with its striker; the dampings are the starting values.
    pub chain: Chain,
    /// A striker's velocity as known beforehand, with its scatter from trial to trial, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Quantities that are known only within an uncertainty; the others count as exact.
    pub known: Vec<Known>,
    /// Threads that carry the simulations; the result does not depend on their number.
    pub n_threads: NonZero<usize>,
}

/// Damping fitted to the tracks of all recordings, and what went along.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackFit {
    /// c_d and c_s.
    pub damping: Damping,
    /// 95 % intervals of c_d and c_s by profile likelihood.
    pub intervals_95: [Interval; 2],
    /// How c_d and c_s scatter over recordings drawn anew with replacement, view by view: with the differences between trials in it
    /// that the model leaves out, but known only as well as so few trials tell it. `None` where a view has a single recording.
    pub bootstrap: Option<[OverTrials; 2]>,
    /// Starting points whose search ended at this minimum, and all of them.
    pub starts: (usize, usize),
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
    /// Mean striker velocity of the recordings, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Mean stamp of the impact, in seconds after the trigger.
    pub impact_time_s: Estimate,
    /// Each recording's own striker and impact, in the order given.
    pub recordings: Vec<FittedRecording>,
    /// Sum of squared residuals, priors included.
    pub chi_squared: f64,
    /// Sum of squared residuals over their number less the unknowns; near 1 when model and stated errors explain the tracks.
    pub reduced_chi_squared: f64,
    /// Positions compared.
    pub n_residuals: usize,
    /// Chain simulations carried out.
    pub n_simulations: u64,
}

/// What the fit found of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedRecording {
    /// Name of the recording.
    pub recording: String,
    /// Velocity of its striker, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Stamp of its impact, in seconds after its trigger.
    pub impact_time_s: Estimate,
    /// Velocity of its striker over the mean of all recordings, less one.
    pub drive_deviation: Estimate,
    /// Its trigger's lead over the mean trigger, in seconds: the stamp of its impact less the mean of all.
    pub trigger_offset_s: Estimate,
    /// Residuals' rms over what the tracker's sigma lets expect.
    pub scatter_ratio: f64,
}

/// Fits c_d and c_s to the tracks of all recordings at once.
///
/// Each recording keeps its own striker velocity (with its prior), instant of impact, and place at rest of each body, so
/// nothing has to be averaged before: the model is compared with what the tracker saw, frame by frame, whose errors are
/// independent and stated. The search is Gauss-Newton with Marquardt's damping from several starting points; the recordings'
/// unknowns are eliminated from each step, and a body's place at rest from its residuals. Dampings stay at or above zero.
///
/// `impact_times_s` are first guesses of the recordings' impacts, within about half a pulse.
///
/// # Errors
/// [`FitError`] as its variants say.
pub fn fit_tracks(
    observations: &[Observation],
    impact_times_s: &[f64],
    model: &TrackModel,
) -> Result<TrackFit, FitError> {
    let problem = Problem::new(observations, model, &[])?;
    let mut n_simulations = 0;
    let mut minima = Vec::with_capacity(STARTS.len());
    for factors in STARTS {
        let start = start(&problem, impact_times_s, factors)?;
        minima.push(search(&problem, start, None, &mut n_simulations));
    }
    let least = minima.iter().flatten().map(|minimum| minimum.at.chi_squared).fold(f64::INFINITY, f64::min);
    let n_best = minima.iter().flatten().filter(|one| one.at.chi_squared < least + SAME_CHI_SQUARED).count();
    let by_chi_squared = |a: &Result<Minimum, FitError>, b: &Result<Minimum, FitError>| match (a, b) {
        (Ok(a), Ok(b)) => a.at.chi_squared.total_cmp(&b.at.chi_squared),
        (a, b) => a.is_err().cmp(&b.is_err()),
    };
    let best = minima.into_iter().min_by(by_chi_squared).ok_or_else(undetermined)??;
    finish(&problem, &best, n_best, n_simulations)
}

/// Starting points: factors on the model's c_d and c_s.
const STARTS: [[f64; 2]; 3] = [[1.0, 1.0], [10.0, 0.1], [0.1, 10.0]];
/// Minima whose chi squared differ by less are one.
const SAME_CHI_SQUARED: f64 = 0.1;

fn start(problem: &Problem<'_>, impact_times_s: &[f64], factors: [f64; 2]) -> Result<State, FitError> {
    let model = problem.model;
    let Drive::Striker(striker) = &model.chain.drive else { return Err(FitError::NoStriker) };
    let mean_damping = model.chain.damping_kg_per_s.iter().sum::<f64>() / model.chain.n_bodies() as f64;
    let mut shared = vec![factors[0] * mean_damping, factors[1] * striker.damping_kg_per_s];
    shared.resize(problem.n_shared(), 1.0);
    let velocity_m_per_s = model.striker_velocity_m_per_s.value;
    let impact = |r: usize| impact_times_s.get(r).copied().unwrap_or(0.0);
    let own = (0..problem.observations.len()).map(|r| Own::new(velocity_m_per_s, impact(r))).collect();
    Ok(State { shared: DVector::from_vec(shared), own })
}

fn finish(
    problem: &Problem<'_>,
    best: &Minimum,
    n_best: usize,
    mut n_simulations: u64,
) -> Result<TrackFit, FitError> {
    let Minimum { state, at } = best;
    let recordings = at.eliminated(0.0).ok_or_else(undetermined)?;
    let covariance = at.equations(&recordings, |_| 1.0, 0.0).covariance().ok_or_else(undetermined)?;
    let errors = OwnCovariance::of(&recordings, &covariance);
    let reduced_chi_squared = at.chi_squared / freedom(problem) as f64;
    // Residuals larger than stated widen the intervals; smaller ones do not narrow them.
    let inflation = reduced_chi_squared.max(1.0).sqrt();
    let estimate = |value: f64, variance: f64| Estimate::new(value, inflation * variance.sqrt());
    let of_shared = |i: usize| estimate(state.shared[i], covariance[(i, i)]);
    let mean = state.own.iter().sum::<Own>() / state.own.len() as f64;
    let of_mean = |k: usize| estimate(mean[k], errors.of_mean[(k, k)]);
    let mut interval = |i: usize| {
        let moves = covariance.column(i) / covariance[(i, i)];
        interval_95(problem, best, (i, &moves), of_shared(i), inflation, &mut n_simulations)
    };
    let intervals_95 = [interval(0)?, interval(1)?];
    let factor = |(i, known): (usize, &Known)| (known.quantity, of_shared(N_DAMPINGS + i));
    let recording = |(r, own): (usize, &Own)| {
        let (of_own, about_mean) = (errors.of_each[r], errors.about_mean[r]);
        FittedRecording {
            recording: problem.observations[r].recording.clone(),
            striker_velocity_m_per_s: estimate(own[0], of_own[(0, 0)]),
            impact_time_s: estimate(own[1], of_own[(1, 1)]),
            drive_deviation: estimate(own[0] - mean[0], about_mean[(0, 0)]).scaled(mean[0].recip()),
            trigger_offset_s: estimate(own[1] - mean[1], about_mean[(1, 1)]),
            scatter_ratio: (at.by_recording[r].0 / at.by_recording[r].1.max(1.0)).sqrt(),
        }
    };
    Ok(TrackFit {
        damping: Damping {
            chain_damping_kg_per_s: of_shared(0),
            striker_damping_kg_per_s: of_shared(1),
            correlation: covariance[(0, 1)] / (covariance[(0, 0)] * covariance[(1, 1)]).sqrt(),
        },
        intervals_95,
        bootstrap: bootstrap(problem, at, &recordings),
        starts: (n_best, STARTS.len()),
        factors: problem.model.known.iter().enumerate().map(factor).collect(),
        striker_velocity_m_per_s: of_mean(0),
        impact_time_s: of_mean(1),
        recordings: state.own.iter().enumerate().map(recording).collect(),
        chi_squared: at.chi_squared,
        reduced_chi_squared,
        n_residuals: problem.n_residuals,
        n_simulations,
    })
}

/// Residuals less unknowns, the places at rest among them.
pub(super) fn freedom(problem: &Problem<'_>) -> usize {
    let n_tracks = problem.observations.iter().map(|observation| observation.bodies.len()).sum::<usize>();
    let n_unknowns = N_DAMPINGS + 2 * problem.observations.len() + n_tracks;
    problem.n_residuals.saturating_sub(n_unknowns).max(1)
}

/// The mean motion over the recordings' strikers at their mean impact, which is what stitching estimates.
///
/// # Errors
/// [`FitError::Model`] when the chain model refuses the values.
pub fn fitted_motion(model: &TrackModel, fit: &TrackFit, times_s: &[f64]) -> Result<Trajectory, FitError> {
    let impact_time_s = fit.impact_time_s.value;
    let strikers: Vec<f64> = fit.recordings.iter().map(|one| one.striker_velocity_m_per_s.value).collect();
    let mut shared =
        vec![fit.damping.chain_damping_kg_per_s.value, fit.damping.striker_damping_kg_per_s.value];
    shared.extend(fit.factors.iter().map(|(_, factor)| factor.value));
    let quantities = model.known.iter().map(|known| known.quantity);
    let struck = struck(model, &DVector::from_vec(shared), quantities)?;
    let span_s = (times_s.last().copied().unwrap_or(0.0) - impact_time_s).max(f64::MIN_POSITIVE);
    let interval_s = span_s / (times_s.len().max(2) - 1) as f64 / SAMPLES_PER_FRAME;
    let schedule = Schedule::automatic(span_s + 2.0 * interval_s, interval_s);
    let family = Family::new(range_of(&strikers, model));
    let struck: Vec<Chain> = (0..family.n_nodes()).map(|node| family.struck(node, &struck)).collect();
    // The mean of the strikers' motions is that of their weights.
    let weights: Vec<_> =
        strikers.iter().map(|velocity_m_per_s| family.weights(*velocity_m_per_s).0).collect();
    let of_node =
        |k: usize| weights.iter().map(|of_striker| of_striker[k]).sum::<f64>() / weights.len() as f64;
    let n_bodies = model.chain.n_bodies();
    let mut mean = Trajectory {
        times_s: times_s.to_vec(),
        displacement_m: Array2::zeros((n_bodies, times_s.len())),
        velocity_m_per_s: Array2::zeros((n_bodies, times_s.len())),
    };
    let motions = ensemble(&struck, &schedule, model.n_threads, |_, simulation| simulation.trajectory);
    for (k, motion) in motions.into_iter().enumerate() {
        let (motion, weight) = (motion?, of_node(k));
        for (i, time_s) in times_s.iter().enumerate() {
            let Some(moment) = motion.at(time_s - impact_time_s) else { continue };
            for body in 0..n_bodies {
                mean.displacement_m[(body, i)] += weight * moment.displacement_m(body);
                mean.velocity_m_per_s[(body, i)] += weight * moment.velocity_m_per_s(body);
            }
        }
    }
    Ok(mean)
}
