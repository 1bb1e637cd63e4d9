//! Tracks of all recordings against the chain model, as a least-squares problem.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU64, Ordering},
};

use chainwave_measurement::{BodyTrack, Estimate, Observation, map_in_parallel};
use chainwave_mechanics::{Chain, Drive, Schedule, Striker};
use nalgebra::DVector;

use super::family::{Family, Struck};
use super::model::TrackModel;
use super::response::{Driven, MotionOfTrack, Question, Response, Sides, respond};
use super::shared_errors::SharedErrors;
use crate::damping::{N_DAMPINGS, critical_kg_per_s, damping_like, mean_damping_kg_per_s};
use crate::error::FitError;
use crate::least_squares::{
    Block, Bounds, Failure, LeastSquares, N_OWN, NormalEquations, Own, TrackSums, Unknowns,
};
use crate::quantity::Quantity;
use crate::steps::{DAMPING_STEPS, FACTOR_STEP, FRICTION_STEP_N};

/// Simulated samples per frame; between them, cubic Hermite interpolation is exact to 1e-11 m on the paper's chain.
pub(super) const SAMPLES_PER_FRAME: f64 = 4.0;
/// Frames by which an impact may precede its trigger.
const MARGIN_FRAMES: f64 = 25.0;
/// Strikers farther from the mean than this, relative to it, are beyond the family's interpolation.
const WIDEST_DRIVE: f64 = 0.5;
/// Factors on quantities that are known stay within this of one, up and down.
const LARGEST_FACTOR: f64 = 2.0;
/// The same of factors that are asked for.
const LARGEST_ASKED: f64 = 8.0;

/// The tracks of all recordings against the chain model.
///
/// Sensitivities by the striker's velocity are the derivative of the family's polynomial, those by time the model's velocities, those
/// by shared quantities the solutions of the variational equations.
pub(super) struct TrackResiduals<'a> {
    pub(super) observations: &'a [Observation],
    pub(super) model: &'a TrackModel,
    /// Quantities without a prior, beside those of the model.
    pub(super) asked: &'a [Quantity],
    /// How far the chains on both sides of a shared unknown are from it.
    steps: Vec<f64>,
    schedule: Schedule,
    bounds: Bounds,
    errors: SharedErrors<'a>,
    pub(super) n_residuals: usize,
    n_simulations: AtomicU64,
    /// The model behind the last equations, and where that was: what comes after a search asks for its minimum again.
    last: Mutex<Option<(Unknowns, SolvedModel)>>,
}

/// The model at values of the unknowns.
pub(super) struct SolvedModel {
    response: Response,
    /// Which of the response's derivatives belongs to each shared unknown; none to one that the chain does not feel.
    derivatives: Vec<Option<usize>>,
    /// Lengths in the pictures over true lengths, as factors, each with its place among the shared unknowns.
    scales: Vec<(Quantity, usize, f64)>,
    /// Where dry friction stands among the shared unknowns, and the first of the two columns of the response that tell its effect.
    friction: Option<(usize, usize)>,
}

/// A position less the model's, where it was seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Residual {
    /// Its recording.
    pub(super) recording: usize,
    /// Its body, from 1.
    pub(super) body: usize,
    /// Time after the recording's impact, in seconds.
    pub(super) after_impact_s: f64,
    /// In units of the stated sigma, the place at rest fitted.
    pub(super) value: f64,
}

impl<'a> TrackResiduals<'a> {
    pub(super) fn new(
        observations: &'a [Observation],
        model: &'a TrackModel,
        asked: &'a [Quantity],
    ) -> Result<Self, FitError> {
        let n_residuals = check(observations, model)?;
        let critical = critical_kg_per_s(&model.chain);
        let quantities = || model.known.iter().map(|known| known.quantity).chain(asked.iter().copied());
        let mut steps = DAMPING_STEPS.map(|step| step * critical).to_vec();
        let step = |quantity: Quantity| match quantity.is_factor() {
            true => FACTOR_STEP,
            false => DAMPING_STEPS[0] * critical,
        };
        steps.extend(quantities().map(step));
        let span = |observation: &Observation| observation.span_s().map_or(0.0, |span| span.1);
        let frame_s = observations.iter().map(Observation::frame_interval_s).fold(f64::INFINITY, f64::min);
        let last_s = observations.iter().map(span).fold(0.0, f64::max);
        let duration_s = last_s + (MARGIN_FRAMES * frame_s).max(0.1 * last_s);
        let schedule = Schedule::automatic(duration_s, frame_s / SAMPLES_PER_FRAME);
        let mean = model.striker_velocity_m_per_s.value;
        let mut shared = vec![(0.0, f64::INFINITY); N_DAMPINGS];
        shared.extend(model.known.iter().map(|_| (LARGEST_FACTOR.recip(), LARGEST_FACTOR)));
        shared.extend(asked.iter().map(|quantity| match quantity.is_factor() {
            true => (LARGEST_ASKED.recip(), LARGEST_ASKED),
            false => (0.0, f64::INFINITY),
        }));
        let strikers = ((1.0 - WIDEST_DRIVE) * mean, (1.0 + WIDEST_DRIVE) * mean);
        let bounds = Bounds { shared, own: [strikers, (f64::NEG_INFINITY, f64::INFINITY)] };
        let errors = SharedErrors::of(observations, &model.reading_errors);
        let (n_simulations, last) = (AtomicU64::new(0), Mutex::new(None));
        Ok(Self {
            observations,
            model,
            asked,
            steps,
            schedule,
            bounds,
            errors,
            n_residuals,
            n_simulations,
            last,
        })
    }

    /// Number of shared unknowns.
    pub(super) fn n_shared(&self) -> usize {
        self.steps.len()
    }

    /// The quantities among the shared unknowns, in their order.
    fn quantities(&self) -> impl Iterator<Item = Quantity> {
        self.model.known.iter().map(|known| known.quantity).chain(self.asked.iter().copied())
    }

    /// Where a quantity stands among the shared unknowns.
    fn unknown_of(&self, quantity: Quantity) -> Option<usize> {
        self.quantities().position(|found| found == quantity).map(|i| N_DAMPINGS + i)
    }

    /// Chain simulations carried out.
    pub(super) fn n_simulations(&self) -> u64 {
        self.n_simulations.load(Ordering::Relaxed)
    }

    /// Where a search begins: factors on the model's c_d and c_s, and first guesses of the impacts.
    pub(super) fn start(
        &self,
        impact_times_s: &[f64],
        factors: [f64; N_DAMPINGS],
    ) -> Result<Unknowns, FitError> {
        let Drive::Striker(striker) = &self.model.chain.drive else { return Err(FitError::NoStriker) };
        let mean_damping = mean_damping_kg_per_s(&self.model.chain);
        let mut shared = vec![factors[0] * mean_damping, factors[1] * striker.damping_kg_per_s];
        shared.extend(self.quantities().map(Quantity::usual));
        let velocity_m_per_s = self.model.striker_velocity_m_per_s.value;
        let impact = |r: usize| impact_times_s.get(r).copied().unwrap_or(0.0);
        let own = (0..self.observations.len()).map(|r| Own::new(velocity_m_per_s, impact(r))).collect();
        Ok(Unknowns { shared: DVector::from_vec(shared), own })
    }

    /// A search's failure in words.
    pub(super) fn failure(&self, failure: Failure<FitError>) -> FitError {
        let quantity = |i: usize| self.quantities().nth(i).map_or_else(|| "?".into(), Quantity::name);
        FitError::of(failure, "the tracks", |unknown| match unknown {
            0 => "c_d".into(),
            1 => "c_s".into(),
            factor => quantity(factor - N_DAMPINGS),
        })
    }

    /// Sum of squares of a recording's residuals at a minimum, and their number less the places at rest.
    pub(super) fn of_recording(&self, r: usize, equations: &NormalEquations, at: &Unknowns) -> (f64, f64) {
        let Estimate { value, sigma } = self.model.striker_velocity_m_per_s;
        let prior = ((at.own[r][0] - value) / sigma).powi(2);
        let n_positions = |track: &BodyTrack| track.position_m.iter().flatten().count().saturating_sub(1);
        let freedom: usize = self.observations[r].bodies.iter().map(n_positions).sum();
        (equations.chi_squared_of(r) - prior, freedom as f64)
    }

    /// The model at values of the unknowns, integrated anew unless the last equations were those there.
    pub(super) fn solve(&self, at: &Unknowns) -> Result<SolvedModel, FitError> {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner).take();
        match last.filter(|(there, _)| there == at) {
            Some((_, model)) => Ok(model),
            None => self.integrate(at, true),
        }
    }

    /// The model at values of the unknowns, with its derivatives by those or without.
    pub(super) fn integrate(&self, at: &Unknowns, with_derivatives: bool) -> Result<SolvedModel, FitError> {
        let strikers: Vec<f64> = at.own.iter().map(|own| own[0]).collect();
        let friction_unknown = self.unknown_of(Quantity::Friction);
        let of_pictures =
            self.quantities().zip(N_DAMPINGS..).filter(|(quantity, _)| quantity.is_of_pictures());
        let scales: Vec<(Quantity, usize, f64)> =
            of_pictures.map(|(quantity, unknown)| (quantity, unknown, at.shared[unknown])).collect();
        let mut sides = Vec::with_capacity(self.n_shared());
        let mut derivatives = Vec::with_capacity(self.n_shared());
        for (i, step) in self.steps.iter().enumerate() {
            // The chain does not feel the scale of the pictures, and friction's effect is added to its motion.
            let is_scale = scales.iter().any(|(_, unknown, _)| *unknown == i);
            let is_felt = with_derivatives && !is_scale && Some(i) != friction_unknown;
            derivatives.push(is_felt.then_some(sides.len()));
            if is_felt {
                let (mut lower, mut upper) = (at.shared.clone(), at.shared.clone());
                lower[i] = (lower[i] - step).max(0.0);
                upper[i] += step;
                let width = upper[i] - lower[i];
                sides.push(Sides { below: self.struck(&lower)?, above: self.struck(&upper)?, width });
            }
        }
        let friction = friction_unknown.map(|unknown| (unknown, sides.len()));
        let force_n = friction_unknown.map(|unknown| at.shared[unknown]);
        let frictions_n = force_n.map_or(Vec::new(), |force_n| vec![force_n, force_n + FRICTION_STEP_N]);
        let question = Question { centre: self.struck(&at.shared)?, sides, frictions_n };
        let family = Family::new(range_of(&strikers, self.model));
        let response = respond(&question, family, &self.schedule, self.model.n_threads)?;
        self.n_simulations.fetch_add(response.n_simulations(), Ordering::Relaxed);
        Ok(SolvedModel { response, derivatives, scales, friction })
    }

    fn struck(&self, shared: &DVector<f64>) -> Result<Struck, FitError> {
        struck(self.model, shared, self.quantities())
    }
}

impl SolvedModel {
    /// Length in the pictures of a view over true length.
    pub(super) fn scale_of(&self, view: u32) -> f64 {
        self.scales_of(view).map(|(_, factor)| factor).product()
    }

    /// The factors of that, with their places among the shared unknowns.
    fn scales_of(&self, view: u32) -> impl Iterator<Item = (usize, f64)> {
        let of_view = self.scales.iter().filter(move |(quantity, ..)| quantity.scales(view));
        of_view.map(|(_, unknown, factor)| (*unknown, *factor))
    }
}

impl LeastSquares for TrackResiduals<'_> {
    type Error = FitError;

    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Solves the chain around the values, and sums up residuals and derivatives.
    fn equations(&self, at: &Unknowns) -> Result<NormalEquations, FitError> {
        let model = self.solve(at)?;
        let equations = self.equations_of(&model, at, |_, _, _| true);
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some((at.clone(), model));
        Ok(equations)
    }

    /// The motion says all; its derivatives are not integrated.
    fn chi_squared(&self, at: &Unknowns) -> Result<f64, FitError> {
        Ok(self.equations_of(&self.integrate(at, false)?, at, |_, _, _| true).chi_squared())
    }
}

impl TrackResiduals<'_> {
    /// The equations of the positions that `takes` takes, by their recording, body and time after the impact, and of the priors.
    pub(super) fn equations_of(
        &self,
        model: &SolvedModel,
        at: &Unknowns,
        takes: impl Fn(usize, usize, f64) -> bool + Sync,
    ) -> NormalEquations {
        let recordings = map_in_parallel(self.observations.len(), self.model.n_threads, |r| {
            let own = &at.own[r];
            let mut recording = Block::new(self.n_shared(), self.errors.n_of(r));
            let rows = Rows::new(model, own, &self.observations[r]);
            let takes = |body: usize, after_impact_s: f64| takes(r, body, after_impact_s);
            for (k, track) in self.observations[r].bodies.iter().enumerate() {
                let errors = self.errors.of_track(r, k);
                let which: Vec<usize> = errors.iter().map(|(error, _)| *error).collect();
                recording.add_track(&rows.sums(track, errors, takes), &which);
            }
            let Estimate { value, sigma } = self.model.striker_velocity_m_per_s;
            recording.add_prior(0, (own[0] - value) / sigma, sigma.recip());
            recording
        });
        let mut equations = NormalEquations::new(self.n_shared());
        recordings.into_iter().for_each(|recording| equations.add_recording(recording));
        self.errors.ties.iter().for_each(|(tied, _)| equations.tie(tied));
        for (known, unknown) in self.model.known.iter().zip(N_DAMPINGS..) {
            let residual = (at.shared[unknown] - 1.0) / known.relative_sigma;
            equations.add_prior(unknown, residual, known.relative_sigma.recip());
        }
        equations
    }

    /// Every residual at values of the unknowns, recording after recording, body after body, frame after frame: without the errors that readings
    /// share, of these amplitudes; with them where there are none.
    pub(super) fn residuals(
        &self,
        model: &SolvedModel,
        at: &Unknowns,
        amplitudes: &[DVector<f64>],
    ) -> Vec<Residual> {
        let of_recording = |r: usize| {
            let rows = Rows::new(model, &at.own[r], &self.observations[r]);
            let of_track = |(k, track): (usize, &BodyTrack)| {
                let of_tie = self.errors.tie_of(r).and_then(|tie| amplitudes.get(tie));
                let amplitude = |error: usize| of_tie.map_or(0.0, |amplitudes| amplitudes[error]);
                let errors = self.errors.of_track(r, k).iter();
                let errors: Vec<(f64, &[f64])> =
                    errors.map(|(error, error_m)| (amplitude(*error), *error_m)).collect();
                rows.residuals(r, track, &errors)
            };
            self.observations[r].bodies.iter().enumerate().flat_map(of_track).collect::<Vec<_>>()
        };
        map_in_parallel(self.observations.len(), self.model.n_threads, of_recording).concat()
    }

    /// Standard deviation of the errors that each residual's reading shares with others, in metres, in the order of the residuals.
    pub(super) fn shared_sigmas_m(&self) -> Vec<f64> {
        let of_track = |(r, k): (usize, usize)| {
            let errors = self.errors.of_track(r, k);
            let frames = self.observations[r].bodies[k].position_m.iter().enumerate();
            let sigma_m =
                |frame: usize| errors.iter().map(|(_, error_m)| error_m[frame].powi(2)).sum::<f64>().sqrt();
            frames
                .filter(|(_, position)| position.is_some())
                .map(|(frame, _)| sigma_m(frame))
                .collect::<Vec<_>>()
        };
        let tracks = (0..self.observations.len())
            .flat_map(|r| (0..self.observations[r].bodies.len()).map(move |k| (r, k)));
        tracks.flat_map(of_track).collect()
    }
}

/// The number of positions; refuses tracks that make no sense.
fn check(observations: &[Observation], model: &TrackModel) -> Result<usize, FitError> {
    const LEAST_POSITIONS: usize = 100;
    let n_bodies = model.chain.n_bodies();
    let count = |track: &BodyTrack| track.position_m.iter().flatten().count();
    let tracks = || observations.iter().flat_map(|observation| &observation.bodies);
    let found = tracks().map(count).sum();
    if found < LEAST_POSITIONS {
        return Err(FitError::TooFew { what: "positions", expected: LEAST_POSITIONS, found });
    }
    if let Some(track) = tracks().find(|track| !(1..=n_bodies).contains(&track.body)) {
        return Err(FitError::TooFew { what: "bodies in the model", expected: track.body, found: n_bodies });
    }
    let is_exact = |x: &Estimate| x.sigma.is_nan() || x.sigma <= 0.0;
    match tracks().any(|track| track.position_m.iter().flatten().any(is_exact)) {
        true => Err(FitError::SingularCovariance { what: "tracks" }),
        false => Ok(found),
    }
}

/// The chain and its striker at values of the shared unknowns.
pub(super) fn struck(
    model: &TrackModel,
    shared: &DVector<f64>,
    quantities: impl Iterator<Item = Quantity>,
) -> Result<Struck, FitError> {
    let Drive::Striker(striker) = &model.chain.drive else { return Err(FitError::NoStriker) };
    let mut chain = Chain { damping_kg_per_s: damping_like(&model.chain, shared[0]), ..model.chain.clone() };
    let mut striker = Striker { damping_kg_per_s: shared[1], ..*striker };
    for (quantity, factor) in quantities.zip(shared.iter().skip(N_DAMPINGS)) {
        quantity.apply(*factor, &mut chain, &mut striker);
    }
    Ok(Struck { chain, striker })
}

/// Residuals less unknowns, the places at rest among them.
pub(super) fn freedom(problem: &TrackResiduals<'_>) -> usize {
    let n_tracks = problem.observations.iter().map(|observation| observation.bodies.len()).sum::<usize>();
    let n_unknowns = N_DAMPINGS + 2 * problem.observations.len() + n_tracks;
    problem.n_residuals.saturating_sub(n_unknowns).max(1)
}

/// The range of striker velocities that a family must span: those given, and two standard deviations of the prior.
pub(super) fn range_of(strikers_m_per_s: &[f64], model: &TrackModel) -> [f64; 2] {
    let Estimate { value, sigma } = model.striker_velocity_m_per_s;
    let lowest = strikers_m_per_s.iter().copied().fold(value - 2.0 * sigma, f64::min);
    let highest = strikers_m_per_s.iter().copied().fold(value + 2.0 * sigma, f64::max);
    [lowest.max(1e-3 * value), highest]
}

/// The rows of one recording's equations.
struct Rows<'a> {
    model: &'a SolvedModel,
    driven: Driven<'a>,
    observation: &'a Observation,
    impact_s: f64,
    /// Length in the recording's pictures over true length.
    scale: f64,
}

impl<'a> Rows<'a> {
    fn new(model: &'a SolvedModel, own: &Own, observation: &'a Observation) -> Self {
        let driven = model.response.driven([own[0], own[1]], &observation.times_s);
        Self { model, driven, observation, impact_s: own[1], scale: model.scale_of(observation.view) }
    }

    /// The sums of a track over the positions that `takes` takes, by their body and time after the impact.
    fn sums(
        &self,
        track: &BodyTrack,
        errors: &[(usize, &[f64])],
        takes: impl Fn(usize, f64) -> bool,
    ) -> TrackSums {
        let n_shared = self.model.derivatives.len();
        let mut row = vec![0.0; N_OWN + n_shared + errors.len() + 1];
        let (origin_m, mut sums) = (first_position_m(track), TrackSums::new(n_shared, errors.len()));
        let motion = self.driven.of_track(track);
        for (place, (frame, time_s, position)) in seen(self.observation, track).enumerate() {
            if takes(track.body, time_s - self.impact_s) {
                let from_first = Estimate::new(position.value - origin_m, position.sigma);
                self.fill(&mut row, (&motion, place), from_first);
                for (entry, (_, error_m)) in row[N_OWN + n_shared..].iter_mut().zip(errors) {
                    *entry = error_m[frame] / position.sigma;
                }
                sums.add(&row, position.sigma.recip());
            }
        }
        sums
    }

    /// The residuals of a track of recording number `recording`, with errors of these amplitudes.
    fn residuals(&self, recording: usize, track: &BodyTrack, errors: &[(f64, &[f64])]) -> Vec<Residual> {
        let mut row = vec![0.0; N_OWN + self.model.derivatives.len() + 1];
        let mut all = Vec::new();
        let origin_m = first_position_m(track);
        let motion = self.driven.of_track(track);
        let (mut weighted, mut weight) = (0.0, 0.0);
        for (place, (frame, time_s, position)) in seen(self.observation, track).enumerate() {
            let from_first = Estimate::new(position.value - origin_m, position.sigma);
            self.fill(&mut row, (&motion, place), from_first);
            let (body, after_impact_s) = (track.body, time_s - self.impact_s);
            let error_m: f64 = errors.iter().map(|(amplitude, error_m)| amplitude * error_m[frame]).sum();
            let value = row.last().copied().unwrap_or_default() + error_m / position.sigma;
            all.push(Residual { recording, body, after_impact_s, value });
            weighted += value / position.sigma;
            weight += position.sigma.powi(-2);
        }
        let rest_m = weighted / weight.max(f64::MIN_POSITIVE);
        for (residual, (.., position)) in all.iter_mut().zip(seen(self.observation, track)) {
            residual.value -= rest_m / position.sigma;
        }
        all
    }

    /// A row (own, shared, residual) in units of the position's sigma, with what lies between these two left as it is; the residual is model
    /// less measurement.
    fn fill(&self, row: &mut [f64], (motion, place): (&MotionOfTrack, usize), position: Estimate) {
        let SolvedModel { derivatives, friction, .. } = self.model;
        let scale = self.scale;
        let inverse_sigma = position.sigma.recip();
        let factor = scale * inverse_sigma;
        let last = row.len() - 1;
        let derivative_m = |which: usize| motion.derivatives_m[which][place];
        let x_m = motion.displacement_m[place] + friction.map_or(0.0, |(_, which)| derivative_m(which));
        row[0] = factor * motion.by_striker_s[place];
        row[1] = -factor * motion.velocity_m_per_s[place];
        row[last] = factor * x_m - position.value * inverse_sigma;
        for (entry, which) in row[N_OWN..].iter_mut().zip(derivatives) {
            *entry = factor * which.map_or(0.0, derivative_m);
        }
        for (unknown, factor) in self.model.scales_of(self.observation.view) {
            row[N_OWN + unknown] = x_m * inverse_sigma * (scale / factor);
        }
        if let Some((unknown, which)) = friction {
            let by_force = (derivative_m(which + 1) - derivative_m(*which)) / FRICTION_STEP_N;
            row[N_OWN + unknown] = factor * by_force;
        }
    }
}

/// In which frame, when and where a body was seen.
fn seen<'a>(
    observation: &'a Observation,
    track: &'a BodyTrack,
) -> impl Iterator<Item = (usize, f64, Estimate)> + 'a {
    let places = observation.times_s.iter().zip(&track.position_m).enumerate();
    places.filter_map(|(frame, (time_s, position))| Some((frame, *time_s, (*position)?)))
}

/// Positions count from the first one seen, so that sums of squares keep their digits.
fn first_position_m(track: &BodyTrack) -> f64 {
    track.position_m.iter().flatten().next().map_or(0.0, |position| position.value)
}

#[cfg(test)]
mod tests;
