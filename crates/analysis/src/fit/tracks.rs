use chainwave_measurement::{BodyTrack, Estimate, Observation, Trajectory};
use chainwave_mechanics::{Chain, Drive, Schedule, Striker};
use nalgebra::{DVector, Matrix2};

use super::arrow::{ArrowEquations, Covariance, Own, Step};
use super::family::Family;
use super::quantity::{Known, Quantity};
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
}

/// Damping fitted to the tracks of all recordings, and what went along.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackFit {
    /// c_d and c_s.
    pub damping: Damping,
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
    /// Mean striker velocity of the recordings, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Mean stamp of the impact, in seconds after the trigger.
    pub impact_time_s: Estimate,
    /// Each recording's own striker and impact, in the order given.
    pub recordings: Vec<FittedRecording>,
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
    /// Residuals' rms over what the tracker's sigma lets expect.
    pub scatter_ratio: f64,
}

/// Fits c_d and c_s to the tracks of all recordings at once.
///
/// Each recording keeps its own striker velocity (with its prior), instant of impact, and place at rest of each body, so
/// nothing has to be averaged before: the model is compared with what the tracker saw, frame by frame, whose errors are
/// independent and stated. The search is Gauss-Newton with Marquardt's damping; the recordings' unknowns are eliminated from
/// each step, and a body's place at rest from its residuals.
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
    let problem = Problem::new(observations, model)?;
    let mut state = problem.start(impact_times_s)?;
    let mut n_simulations = 0;
    let mut damping = FIRST_DAMPING;
    let mut here = problem.linearise(&state, &mut n_simulations)?;
    for _ in 0..MAX_ROUNDS {
        let (step, length2) = here.equations.solve(damping).ok_or_else(undetermined)?;
        let trial = problem.stepped(&state, &step);
        let there = problem.linearise(&trial, &mut n_simulations)?;
        if there.chi_squared > here.chi_squared * (1.0 + 1e-12) {
            damping = (10.0 * damping).max(FIRST_DAMPING);
            continue;
        }
        (state, here) = (trial, there);
        damping = if damping > 1e-9 { 0.1 * damping } else { 0.0 };
        if length2 < CONVERGED_LENGTH2 {
            return problem.finish(&state, &here, n_simulations);
        }
    }
    Err(FitError::NotConverged(format!("{MAX_ROUNDS} rounds did not settle")))
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
    let shared = DVector::from_vec(shared);
    let span_s = (times_s.last().copied().unwrap_or(0.0) - impact_time_s).max(f64::MIN_POSITIVE);
    let interval_s = span_s / (times_s.len().max(2) - 1) as f64 / SAMPLES_PER_FRAME;
    let schedule = Schedule::automatic(span_s + 2.0 * interval_s, interval_s);
    let family = family_of(model, &shared, range_of(&strikers, model), &schedule)?;
    let n_bodies = model.chain.n_bodies();
    let mut mean = Trajectory {
        times_s: times_s.to_vec(),
        displacement_m: ndarray::Array2::zeros((n_bodies, times_s.len())),
        velocity_m_per_s: ndarray::Array2::zeros((n_bodies, times_s.len())),
    };
    for velocity_m_per_s in &strikers {
        let motion = family.at(*velocity_m_per_s);
        for (i, time_s) in times_s.iter().enumerate() {
            let Some(moment) = motion.at(time_s - impact_time_s) else { continue };
            for body in 0..n_bodies {
                mean.displacement_m[(body, i)] += moment.displacement_m(body) / strikers.len() as f64;
                mean.velocity_m_per_s[(body, i)] += moment.velocity_m_per_s(body) / strikers.len() as f64;
            }
        }
    }
    Ok(mean)
}

const MAX_ROUNDS: usize = 60;
const FIRST_DAMPING: f64 = 1e-3;
/// A step shorter than a hundredth of a standard error changes nothing.
const CONVERGED_LENGTH2: f64 = 1e-4;
/// Simulated samples per frame; between them, cubic Hermite interpolation is exact to 1e-11 m on the paper's chain.
const SAMPLES_PER_FRAME: f64 = 4.0;
/// Strikers farther from the mean than this, relative to it, are beyond the family's interpolation.
const WIDEST_DRIVE: f64 = 0.5;

fn undetermined() -> FitError {
    FitError::NotConverged("the tracks do not determine the damping and every recording's striker".into())
}

/// Values of all unknowns.
#[derive(Debug, Clone)]
struct State {
    /// c_d, c_s, and a factor for each quantity known within an uncertainty.
    shared: DVector<f64>,
    /// Striker velocity and impact of each recording.
    own: Vec<Own>,
}

/// The equations at a state, with what they come from.
struct Linearised {
    equations: ArrowEquations,
    chi_squared: f64,
    /// Residuals' sum of squares and number, recording by recording.
    by_recording: Vec<(f64, f64)>,
}

struct Problem<'a> {
    observations: &'a [Observation],
    model: &'a TrackModel,
    /// Steps of the differences in the shared unknowns.
    steps: Vec<f64>,
    schedule: Schedule,
    n_residuals: usize,
}

impl<'a> Problem<'a> {
    fn new(observations: &'a [Observation], model: &'a TrackModel) -> Result<Self, FitError> {
        const LEAST_POSITIONS: usize = 100;
        let n_bodies = model.chain.n_bodies();
        let count = |track: &BodyTrack| track.position_m.iter().flatten().count();
        let tracks = || observations.iter().flat_map(|observation| &observation.bodies);
        let n_residuals = tracks().map(count).sum();
        if n_residuals < LEAST_POSITIONS {
            return Err(FitError::TooFew {
                what: "positions",
                expected: LEAST_POSITIONS,
                found: n_residuals,
            });
        }
        if let Some(track) = tracks().find(|track| !(1..=n_bodies).contains(&track.body)) {
            return Err(FitError::TooFew {
                what: "bodies in the model",
                expected: track.body,
                found: n_bodies,
            });
        }
        if tracks().any(|track| track.position_m.iter().flatten().any(|x| x.sigma.is_nan() || x.sigma <= 0.0))
        {
            return Err(FitError::SingularCovariance { what: "tracks" });
        }
        // One per cent of critical for a HEC on one contact, a tenth of it for the striker's; a thousandth of that is a step whose
        // own error (1e-6 of the curvature) and the simulation's rounding are both far below the noise.
        let critical = 2.0 * (model.chain.contact.k_0_n_per_m() * model.chain.mass_kg[0]).sqrt();
        let mut steps = vec![1e-5 * critical, 1e-4 * critical];
        steps.extend(model.known.iter().map(|_| 1e-4));
        let span = |observation: &Observation| observation.span_s().map_or(0.0, |span| span.1);
        let frame_s = observations.iter().map(Observation::frame_interval_s).fold(f64::INFINITY, f64::min);
        let output_interval_s = frame_s / SAMPLES_PER_FRAME;
        let last_s = observations.iter().map(span).fold(0.0, f64::max);
        let duration_s = last_s + (MARGIN_FRAMES * frame_s).max(0.1 * last_s);
        let schedule = Schedule::automatic(duration_s, output_interval_s);
        Ok(Self { observations, model, steps, schedule, n_residuals })
    }

    fn start(&self, impact_times_s: &[f64]) -> Result<State, FitError> {
        let Drive::Striker(striker) = &self.model.chain.drive else { return Err(FitError::NoStriker) };
        let n_bodies = self.model.chain.n_bodies() as f64;
        let mean_damping = self.model.chain.damping_kg_per_s.iter().sum::<f64>() / n_bodies;
        let mut shared = vec![mean_damping, striker.damping_kg_per_s];
        shared.extend(self.model.known.iter().map(|_| 1.0));
        let velocity_m_per_s = self.model.striker_velocity_m_per_s.value;
        let impact = |r: usize| impact_times_s.get(r).copied().unwrap_or(0.0);
        let own = (0..self.observations.len()).map(|r| Own::new(velocity_m_per_s, impact(r))).collect();
        Ok(State { shared: DVector::from_vec(shared), own })
    }

    /// The state after a step; damping stays at or above zero, factors and strikers within reason.
    fn stepped(&self, state: &State, step: &Step) -> State {
        let mean = self.model.striker_velocity_m_per_s.value;
        let mut shared = &state.shared + &step.shared;
        for (i, value) in shared.iter_mut().enumerate() {
            *value = if i < N_DAMPINGS { value.max(0.0) } else { value.clamp(0.5, 2.0) };
        }
        let own = state.own.iter().zip(&step.own).map(|(own, step)| {
            let velocity = (own[0] + step[0]).clamp((1.0 - WIDEST_DRIVE) * mean, (1.0 + WIDEST_DRIVE) * mean);
            Own::new(velocity, own[1] + step[1])
        });
        State { shared, own: own.collect() }
    }

    /// Solves the chain around a state, and sums up residuals and derivatives.
    fn linearise(&self, state: &State, n_simulations: &mut u64) -> Result<Linearised, FitError> {
        let strikers: Vec<f64> = state.own.iter().map(|own| own[0]).collect();
        let range = range_of(&strikers, self.model);
        let mut solve = |shared: &DVector<f64>| {
            *n_simulations += Family::n_simulations();
            family_of(self.model, shared, range, &self.schedule)
        };
        let base = solve(&state.shared)?;
        let mut by_shared = Vec::with_capacity(self.steps.len());
        for (i, step) in self.steps.iter().enumerate() {
            let (mut lower, mut upper) = (state.shared.clone(), state.shared.clone());
            lower[i] = (lower[i] - step).max(0.0);
            upper[i] += step;
            let width = upper[i] - lower[i];
            by_shared.push((solve(&lower)?, solve(&upper)?, width));
        }
        let mut equations = ArrowEquations::new(self.steps.len(), self.observations.len());
        let mut chi_squared = self.add_priors(state, &mut equations);
        let mut by_recording = Vec::with_capacity(self.observations.len());
        for (r, observation) in self.observations.iter().enumerate() {
            let velocity_m_per_s = state.own[r][0];
            let derivative = |(lower, upper, width): &(Family, Family, f64)| {
                let (mut difference, below) = (upper.at(velocity_m_per_s), lower.at(velocity_m_per_s));
                difference.displacement_m -= &below.displacement_m;
                difference.velocity_m_per_s -= &below.velocity_m_per_s;
                difference.displacement_m /= *width;
                difference.velocity_m_per_s /= *width;
                difference
            };
            let motions = Motions {
                scale: self.scale(&state.shared),
                moved: base.at(velocity_m_per_s),
                by_striker: base.slope_at(velocity_m_per_s),
                by_shared: by_shared.iter().map(derivative).collect(),
                scale_unknown: self.scale_unknown(),
            };
            let (mut squares, mut n) = (0.0, 0.0);
            for track in &observation.bodies {
                let rows = motions.rows(observation, track, state.own[r][1]);
                squares += rows.iter().map(|row| row.residual.powi(2)).sum::<f64>();
                n += (rows.len() as f64 - 1.0).max(0.0);
                rows.iter().for_each(|row| equations.add(r, row.residual, &row.shared, &row.own));
            }
            chi_squared += squares;
            by_recording.push((squares, n));
        }
        Ok(Linearised { equations, chi_squared, by_recording })
    }

    /// Each striker and each uncertain quantity against what is known of it; the sum of squares.
    fn add_priors(&self, state: &State, equations: &mut ArrowEquations) -> f64 {
        let mut squares = 0.0;
        let none = DVector::zeros(self.steps.len());
        let Estimate { value, sigma } = self.model.striker_velocity_m_per_s;
        for (r, own) in state.own.iter().enumerate() {
            let residual = (own[0] - value) / sigma;
            equations.add(r, residual, &none, &Own::new(sigma.recip(), 0.0));
            squares += residual.powi(2);
        }
        for (i, known) in self.model.known.iter().enumerate() {
            let residual = (state.shared[N_DAMPINGS + i] - 1.0) / known.relative_sigma;
            equations.add_prior(N_DAMPINGS + i, residual, known.relative_sigma.recip());
            squares += residual.powi(2);
        }
        squares
    }

    fn scale_unknown(&self) -> Option<usize> {
        let place = self.model.known.iter().position(|known| known.quantity == Quantity::Scale);
        place.map(|i| N_DAMPINGS + i)
    }

    fn scale(&self, shared: &DVector<f64>) -> f64 {
        self.scale_unknown().map_or(1.0, |unknown| shared[unknown])
    }

    fn finish(&self, state: &State, here: &Linearised, n_simulations: u64) -> Result<TrackFit, FitError> {
        let Covariance { shared, own, mean_own } = here.equations.covariance().ok_or_else(undetermined)?;
        let n_tracks = self.observations.iter().map(|observation| observation.bodies.len()).sum::<usize>();
        let n_unknowns = N_DAMPINGS + 2 * self.observations.len() + n_tracks;
        let freedom = self.n_residuals.saturating_sub(n_unknowns).max(1);
        let reduced_chi_squared = here.chi_squared / freedom as f64;
        // Residuals larger than stated widen the intervals; smaller ones do not narrow them.
        let inflation = reduced_chi_squared.max(1.0).sqrt();
        let estimate = |value: f64, variance: f64| Estimate::new(value, inflation * variance.sqrt());
        let of_shared = |i: usize| estimate(state.shared[i], shared[(i, i)]);
        let mean = |k: usize| {
            let values = state.own.iter().map(|own| own[k]);
            estimate(values.sum::<f64>() / state.own.len() as f64, mean_own[(k, k)])
        };
        let factor = |(i, known): (usize, &Known)| (known.quantity, of_shared(N_DAMPINGS + i));
        let recording = |r: usize, own: &Own, variance: &Matrix2<f64>| FittedRecording {
            recording: self.observations[r].recording.clone(),
            striker_velocity_m_per_s: estimate(own[0], variance[(0, 0)]),
            impact_time_s: estimate(own[1], variance[(1, 1)]),
            scatter_ratio: (here.by_recording[r].0 / here.by_recording[r].1.max(1.0)).sqrt(),
        };
        Ok(TrackFit {
            damping: Damping {
                chain_damping_kg_per_s: of_shared(0),
                striker_damping_kg_per_s: of_shared(1),
                correlation: shared[(0, 1)] / (shared[(0, 0)] * shared[(1, 1)]).sqrt(),
            },
            factors: self.model.known.iter().enumerate().map(factor).collect(),
            striker_velocity_m_per_s: mean(0),
            impact_time_s: mean(1),
            recordings: state
                .own
                .iter()
                .zip(&own)
                .enumerate()
                .map(|(r, (x, v))| recording(r, x, v))
                .collect(),
            reduced_chi_squared,
            n_residuals: self.n_residuals,
            n_simulations,
        })
    }
}

/// c_d and c_s stand first among the shared unknowns.
const N_DAMPINGS: usize = 2;
/// Frames by which an impact may precede its trigger.
const MARGIN_FRAMES: f64 = 25.0;

/// The model's motion for one recording's striker, with its derivatives.
struct Motions {
    scale: f64,
    moved: Trajectory,
    by_striker: Trajectory,
    by_shared: Vec<Trajectory>,
    scale_unknown: Option<usize>,
}

/// One residual in units of its sigma, with its derivatives.
struct Row {
    inverse_sigma: f64,
    residual: f64,
    shared: DVector<f64>,
    own: Own,
}

impl Motions {
    /// The residuals of one body's track, less what its place at rest takes up.
    fn rows(&self, observation: &Observation, track: &BodyTrack, impact_time_s: f64) -> Vec<Row> {
        let last_s = observation.span_s().map_or(f64::NEG_INFINITY, |span| span.1);
        let seen = observation.times_s.iter().zip(&track.position_m).filter(|(time_s, _)| **time_s <= last_s);
        let mut rows: Vec<Row> = seen
            .filter_map(|(time_s, position)| {
                Some(self.row(track.body - 1, time_s - impact_time_s, (*position)?))
            })
            .collect();
        let weight: f64 = rows.iter().map(|row| row.inverse_sigma.powi(2)).sum();
        if weight > 0.0 {
            let n_shared = self.by_shared.len();
            let (mut residual, mut shared, mut own) = (0.0, DVector::zeros(n_shared), Own::zeros());
            for row in &rows {
                residual += row.residual * row.inverse_sigma / weight;
                shared.axpy(row.inverse_sigma / weight, &row.shared, 1.0);
                own += row.own * (row.inverse_sigma / weight);
            }
            for row in &mut rows {
                row.residual -= residual * row.inverse_sigma;
                row.shared.axpy(-row.inverse_sigma, &shared, 1.0);
                row.own -= own * row.inverse_sigma;
            }
        }
        rows
    }

    /// The residual: model less measurement.
    fn row(&self, body: usize, since_impact_s: f64, position: Estimate) -> Row {
        let inverse_sigma = position.sigma.recip();
        let read = |motion: &Trajectory| {
            let moment = motion.at(since_impact_s);
            moment.map_or((0.0, 0.0), |moment| (moment.displacement_m(body), moment.velocity_m_per_s(body)))
        };
        let (x_m, v_m_per_s) = read(&self.moved);
        let mut shared = DVector::from_iterator(
            self.by_shared.len(),
            self.by_shared.iter().map(|motion| self.scale * read(motion).0 * inverse_sigma),
        );
        if let Some(unknown) = self.scale_unknown {
            shared[unknown] = x_m * inverse_sigma;
        }
        let by_striker = self.scale * read(&self.by_striker).0;
        let own = Own::new(by_striker, -self.scale * v_m_per_s) * inverse_sigma;
        Row { inverse_sigma, residual: (self.scale * x_m - position.value) * inverse_sigma, shared, own }
    }
}

/// The family of motions at values of the shared unknowns.
fn family_of(
    model: &TrackModel,
    shared: &DVector<f64>,
    range_m_per_s: [f64; 2],
    schedule: &Schedule,
) -> Result<Family, FitError> {
    let Drive::Striker(striker) = &model.chain.drive else { return Err(FitError::NoStriker) };
    let mut chain =
        Chain { damping_kg_per_s: vec![shared[0]; model.chain.n_bodies()], ..model.chain.clone() };
    let mut striker = Striker { damping_kg_per_s: shared[1], ..*striker };
    for (known, factor) in model.known.iter().zip(shared.iter().skip(N_DAMPINGS)) {
        known.quantity.apply(*factor, &mut chain, &mut striker);
    }
    Ok(Family::new(&chain, &striker, range_m_per_s, schedule)?)
}

/// The range of striker velocities that a family must span: those given, and two standard deviations of the prior.
fn range_of(strikers_m_per_s: &[f64], model: &TrackModel) -> [f64; 2] {
    let Estimate { value, sigma } = model.striker_velocity_m_per_s;
    let lowest = strikers_m_per_s.iter().copied().fold(value - 2.0 * sigma, f64::min);
    let highest = strikers_m_per_s.iter().copied().fold(value + 2.0 * sigma, f64::max);
    [lowest.max(1e-3 * value), highest]
}
