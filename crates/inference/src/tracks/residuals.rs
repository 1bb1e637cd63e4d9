//! Tracks of all recordings against the chain model, as a least-squares problem.

mod rows;
mod starts;

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU64, Ordering},
};

use chainwave_measurement::{BodyTrack, Estimate, Observation, map_in_parallel};
use chainwave_mechanics::{Chain, Kept, ReferenceMotion, Schedule, Striker};
use nalgebra::DVector;

use super::family::{Family, Struck};
use super::model::TrackModel;
use super::resistances::SharedResistances;
use super::response::{Response, solve};
use super::shared_errors::SharedErrors;
use super::windows::{Sides, Windows, changes_of, kept_of_node, n_outputs};
use crate::damping::{N_DAMPINGS, critical_kg_per_s, damping_like, most_striker_damping_kg_per_s};
use crate::error::FitError;
use crate::excess;
use crate::least_squares::{
    Block, Bounds, Failure, LeastSquares, NormalEquations, RestSums, Row, SharedProducts, Unknowns,
};
use crate::priors::PriorFactors;
use crate::quantity::Quantity;
use crate::steps::DAMPING_STEPS;
use rows::{Rows, Seen};

/// Simulated samples per frame; between them, cubic Hermite interpolation is exact to 1e-11 m on the paper's chain.
pub(super) const SAMPLES_PER_FRAME: f64 = 4.0;
/// Frames by which an impact may precede its trigger.
const MARGIN_FRAMES: f64 = 25.0;
/// Strikers farther from the mean than this, relative to it, are beyond the family's interpolation.
const WIDEST_DRIVE: f64 = 0.5;
/// The damping of a striker's contact, over critical damping, that stands for none: where there is no striker it is as good as any, and one that the
/// search keeps away from its bound.
pub(super) const NO_STRIKER_DAMPING: f64 = 1.0;
/// Factors that are asked for stay within this of one, up and down.
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
    /// Of a chain that is struck when the triggers say so.
    schedule: Schedule,
    bounds: Bounds,
    errors: SharedErrors<'a>,
    pub(super) n_residuals: usize,
    n_simulations: AtomicU64,
    /// The model behind the last equations, and where that was: what comes after a search asks for its minimum again. Searches beside each
    /// other overwrite it in any order, and nobody asks for theirs.
    last: Mutex<Option<(Unknowns, SolvedModel)>>,
}

/// The model at values of the unknowns.
pub(super) struct SolvedModel {
    response: Response,
    /// Lengths in the pictures over true lengths, as factors, each with its place among the shared unknowns.
    scales: Vec<(Quantity, usize, f64)>,
    /// What resists the bodies, whose lanes the response has.
    resistances: SharedResistances,
}

/// What takes some positions, by their recording, body and time after the impact in seconds, and leaves others.
pub(super) type Takes<'a> = dyn Fn(usize, usize, f64) -> bool + Sync + 'a;

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

/// What an error that readings share makes of the residuals of one track.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ErrorOfTrack {
    /// Its number among the model's: those that were found, and behind them the usual ones.
    pub(super) error: usize,
    /// By one standard deviation of it, in metres, one for each reading.
    pub(super) of_residuals_m: Vec<f64>,
}

impl<'a> TrackResiduals<'a> {
    pub(super) fn new(
        observations: &'a [Observation],
        model: &'a TrackModel,
        asked: &'a [Quantity],
    ) -> Result<Self, FitError> {
        let n_residuals = check(observations, model)?;
        let critical = critical_kg_per_s(&model.chain);
        let quantities = || model.priors.iter().map(|prior| prior.quantity).chain(asked.iter().copied());
        let mut steps = DAMPING_STEPS.map(|step| step * critical).to_vec();
        let striker_m_per_s = model.striker_velocity_m_per_s.value;
        steps.extend(quantities().map(|quantity| quantity.step(&model.chain, striker_m_per_s, critical)));
        let span = |observation: &Observation| observation.span_s().map_or(0.0, |span| span.1);
        let frame_s = observations.iter().map(Observation::frame_interval_s).fold(f64::INFINITY, f64::min);
        let last_s = observations.iter().map(span).fold(0.0, f64::max);
        let duration_s = last_s + (MARGIN_FRAMES * frame_s).max(0.1 * last_s);
        let schedule = Schedule::automatic(duration_s, frame_s / SAMPLES_PER_FRAME);
        let mut shared =
            vec![(0.0, f64::INFINITY), (0.0, most_striker_damping_kg_per_s(&model.chain, frame_s))];
        shared.extend(PriorFactors::new(&model.priors, N_DAMPINGS).bounds());
        shared.extend(asked.iter().map(|quantity| match quantity.is_factor() {
            true => (LARGEST_ASKED.recip(), LARGEST_ASKED),
            false => (0.0, f64::INFINITY),
        }));
        let strikers = ((1.0 - WIDEST_DRIVE) * striker_m_per_s, (1.0 + WIDEST_DRIVE) * striker_m_per_s);
        let bounds = Bounds { shared, own: [strikers, (f64::NEG_INFINITY, f64::INFINITY)] };
        let errors = SharedErrors::of(observations, model.reading_errors.iter().chain(&model.usual_errors));
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

    /// Where the model's usual errors stand: the tie, and the number there.
    pub(super) fn usual_errors(&self) -> &[Option<(usize, usize)>] {
        &self.errors.of_errors[self.model.reading_errors.len()..]
    }

    /// How many errors the recordings of each tie share.
    pub(super) fn ties(&self) -> impl Iterator<Item = usize> {
        self.errors.ties.iter().map(|(_, n_errors)| *n_errors)
    }

    /// Number of shared unknowns.
    pub(super) fn n_shared(&self) -> usize {
        self.steps.len()
    }

    /// The quantities among the shared unknowns, in their order.
    fn quantities(&self) -> impl Iterator<Item = Quantity> {
        self.model.priors.iter().map(|prior| prior.quantity).chain(self.asked.iter().copied())
    }

    /// Chain simulations carried out.
    pub(super) fn n_simulations(&self) -> u64 {
        self.n_simulations.load(Ordering::Relaxed)
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
        let degrees_of_freedom: usize = self.observations[r].bodies.iter().map(n_positions).sum();
        (equations.chi_squared_of(r) - prior, degrees_of_freedom as f64)
    }

    /// The model at values of the unknowns, integrated anew unless the last equations were those there.
    pub(super) fn solve(&self, at: &Unknowns) -> Result<SolvedModel, FitError> {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner).take();
        match last.filter(|(there, _)| there == at) {
            Some((_, model)) => Ok(model),
            None => {
                let chains = self.chains(at)?;
                let motions = solve(&chains, &self.schedule_of(at), |_| Kept::Outputs, self.model.n_threads)?;
                self.model_of(at, &motions)
            }
        }
    }

    /// Until the last frame of each recording by its own impact, which may come long before its trigger; but no longer than twice as long as usual, as
    /// a search may put an impact anywhere on its way.
    fn schedule_of(&self, at: &Unknowns) -> Schedule {
        let frames = self.observations.iter().zip(&at.own);
        let last = frames.filter_map(|(one, own)| Some(one.span_s()?.1 - own[1]));
        let needed_s = last.fold(0.0, f64::max) + self.schedule.output_interval_s;
        let usual_s = self.schedule.duration_s;
        Schedule { duration_s: usual_s.max(needed_s.min(2.0 * usual_s)), ..self.schedule }
    }

    fn family(&self, at: &Unknowns) -> Family {
        let strikers: Vec<f64> = at.own.iter().map(|own| own[0]).collect();
        Family::new(range_of(&strikers, self.model))
    }

    /// The chain at values of the unknowns, struck at each node of the family.
    fn chains(&self, at: &Unknowns) -> Result<Vec<Chain>, FitError> {
        let (family, struck) = (self.family(at), self.struck(&at.shared)?);
        Ok((0..family.n_nodes()).map(|node| family.struck(node, &struck)).collect())
    }

    /// The model at values of the unknowns, whose chains move so.
    fn model_of(&self, at: &Unknowns, motions: &[ReferenceMotion<'_>]) -> Result<SolvedModel, FitError> {
        self.n_simulations.fetch_add(motions.len() as u64, Ordering::Relaxed);
        let resistances = SharedResistances::of(self.quantities().zip(N_DAMPINGS..), &at.shared, &self.steps);
        let lanes = resistances.lanes();
        let response = Response::new(self.family(at), motions, &lanes, self.model.n_threads)?;
        let of_pictures =
            self.quantities().zip(N_DAMPINGS..).filter(|(quantity, _)| quantity.is_of_pictures());
        let scales = of_pictures.map(|(quantity, unknown)| (quantity, unknown, at.shared[unknown])).collect();
        Ok(SolvedModel { response, scales, resistances })
    }

    /// The chain on both sides of each shared unknown that it feels; and which of them belongs to each shared unknown.
    fn sides(&self, at: &Unknowns) -> Result<(Vec<Sides>, Vec<Option<usize>>), FitError> {
        // It does not feel the scale of the pictures, and the effect of friction and drag is added to its motion.
        let is_felt = |quantity: Quantity| !quantity.is_of_pictures() && !quantity.is_resistance();
        let all = [true; N_DAMPINGS].into_iter().chain(self.quantities().map(is_felt));
        let (mut sides, mut places) = (Vec::new(), Vec::new());
        for (i, (step, is_felt)) in self.steps.iter().zip(all).enumerate() {
            places.push(is_felt.then_some(sides.len()));
            if is_felt {
                let (mut lower, mut upper) = (at.shared.clone(), at.shared.clone());
                lower[i] = (lower[i] - step).max(0.0);
                upper[i] += step;
                let width = upper[i] - lower[i];
                sides.push(Sides { below: self.struck(&lower)?, above: self.struck(&upper)?, width });
            }
        }
        Ok((sides, places))
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
        let (model, [equations]) = self.equations_of(at, true, [&|_, _, _| true])?;
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some((at.clone(), model));
        Ok(equations)
    }
}

impl TrackResiduals<'_> {
    /// The equations of the positions that each of some parts takes, and of the priors, with the derivatives by the shared unknowns or without;
    /// and the model behind them.
    pub(super) fn equations_of<const N: usize>(
        &self,
        at: &Unknowns,
        with_derivatives: bool,
        parts: [&Takes<'_>; N],
    ) -> Result<(SolvedModel, [NormalEquations; N]), FitError> {
        let (n_threads, n_shared) = (self.model.n_threads, self.n_shared());
        let chains = self.chains(at)?;
        let kept = |node| kept_of_node(node, with_derivatives);
        let motions = solve(&chains, &self.schedule_of(at), kept, n_threads)?;
        let model = self.model_of(at, &motions)?;
        let (sides, places) =
            if with_derivatives { self.sides(at)? } else { (Vec::new(), vec![None; n_shared]) };
        let changes = changes_of(&sides, &self.family(at));
        let recordings = || self.observations.iter().zip(&at.own);
        let rows: Vec<Rows<'_>> =
            recordings().map(|(observation, own)| Rows::new(&model, own, observation, &places)).collect();
        let of_recording = |(r, observation): (usize, &Observation)| {
            Mutex::new(std::array::from_fn(|_| Sums::new(n_shared, self.errors.of_recording(r), observation)))
        };
        let sums: Vec<Mutex<[Sums; N]>> = self.observations.iter().enumerate().map(of_recording).collect();
        let mut shared: [_; N] = std::array::from_fn(|_| SharedProducts::new(n_shared));
        let length = n_outputs(n_shared, self.model.chain.n_bodies());
        for window in Windows::new(&motions, &changes, length, n_threads)? {
            let window = window?;
            let of_tracks = map_in_parallel(rows.len(), n_threads, |r| {
                let mut sums = sums[r].lock().unwrap_or_else(PoisonError::into_inner);
                let of_track = |(place, track): (usize, &BodyTrack)| {
                    let rows = rows[r].of_track(track, &window);
                    let errors = self.errors.of_track(r, place);
                    for (takes, sums) in parts.iter().zip(sums.iter_mut()) {
                        let takes = |after_impact_s| takes(r, track.body, after_impact_s);
                        sums.add(place, rows.iter(errors).filter(|(_, seen)| takes(seen.after_impact_s)));
                    }
                    (track.body, rows)
                };
                self.observations[r].bodies.iter().enumerate().map(of_track).collect::<Vec<_>>()
            });
            for (takes, shared) in parts.iter().zip(&mut shared) {
                let mut rows: Vec<&[f64]> = Vec::new();
                for (r, tracks) in of_tracks.iter().enumerate() {
                    for (body, of_track) in tracks {
                        let is_taken = |(_, seen): &(&[f64], &Seen)| takes(r, *body, seen.after_impact_s);
                        rows.extend(of_track.shared().filter(is_taken).map(|(row, _)| row));
                    }
                }
                shared.add_rows(&rows, n_threads);
            }
        }
        let sums = sums.into_iter().map(|sums| sums.into_inner().unwrap_or_else(PoisonError::into_inner));
        let mut sums: Vec<_> = sums.map(IntoIterator::into_iter).collect();
        let equations = shared.map(|shared| {
            let of_part = sums.iter_mut().filter_map(Iterator::next);
            self.with_priors(at, shared, of_part)
        });
        Ok((model, equations))
    }

    /// The equations of all recordings, and of the priors.
    fn with_priors(
        &self,
        at: &Unknowns,
        shared: SharedProducts,
        recordings: impl Iterator<Item = Sums>,
    ) -> NormalEquations {
        let mut equations = NormalEquations::of(shared);
        let Estimate { value, sigma } = self.model.striker_velocity_m_per_s;
        for (r, (Sums { block, rests }, own)) in recordings.zip(&at.own).enumerate() {
            equations.add_recording(block, &rests);
            equations.add_own_prior(r, 0, (own[0] - value) / sigma, sigma.recip());
        }
        self.errors.ties.iter().for_each(|(tied, n_errors)| equations.tie(tied, *n_errors));
        PriorFactors::new(&self.model.priors, N_DAMPINGS).add_priors(&mut equations, &at.shared);
        if self.model.is_let_go() {
            // Nothing tells the damping of a contact that there is not.
            let critical = critical_kg_per_s(&self.model.chain);
            equations.add_prior(1, at.shared[1] / critical - NO_STRIKER_DAMPING, critical.recip());
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
        let places = vec![None; self.n_shared()];
        let of_recording = |r: usize| {
            let rows = Rows::new(model, &at.own[r], &self.observations[r], &places);
            let of_track = |(k, track): (usize, &BodyTrack)| {
                let of_tie = self.errors.tie_of(r).and_then(|tie| amplitudes.get(tie));
                let of_recording = self.errors.of_recording(r);
                let amplitude = |place: usize| of_tie.map_or(0.0, |of_tie| of_tie[of_recording[place]]);
                let errors = self.errors.of_track(r, k).iter();
                let errors: Vec<(f64, &[f64])> =
                    errors.map(|(error, error_m)| (amplitude(*error), *error_m)).collect();
                rows.residuals(r, track, &errors)
            };
            self.observations[r].bodies.iter().enumerate().flat_map(of_track).collect::<Vec<_>>()
        };
        map_in_parallel(self.observations.len(), self.model.n_threads, of_recording).concat()
    }

    /// What one standard deviation of each of the model's errors that readings share makes of the residuals of each track, in metres, track by track:
    /// a residual is a reading less its track's place at rest, and that has the weighted mean of each error over the track.
    pub(super) fn errors_of_tracks(&self) -> Vec<Vec<ErrorOfTrack>> {
        let error_of = |r: usize, place: usize| {
            let of_tie = self.errors.tie_of(r).map(|tie| (tie, self.errors.of_recording(r)[place]));
            self.errors.of_errors.iter().position(|of_error| *of_error == of_tie)
        };
        let of_track = |(r, k): (usize, usize)| {
            let frames = self.observations[r].bodies[k].position_m.iter().enumerate();
            let read: Vec<(usize, f64)> = frames
                .filter_map(|(frame, position)| Some((frame, position.as_ref()?.sigma.powi(-2))))
                .collect();
            let weights: f64 = read.iter().map(|(_, weight)| weight).sum();
            let of_error = |(place, error_m): &(usize, &[f64])| {
                let place_m =
                    read.iter().map(|(frame, weight)| weight * error_m[*frame]).sum::<f64>() / weights;
                let of_residuals_m = read.iter().map(|(frame, _)| error_m[*frame] - place_m).collect();
                Some(ErrorOfTrack { error: error_of(r, *place)?, of_residuals_m })
            };
            self.errors.of_track(r, k).iter().filter_map(of_error).collect()
        };
        let tracks = (0..self.observations.len())
            .flat_map(|r| (0..self.observations[r].bodies.len()).map(move |k| (r, k)));
        tracks.map(of_track).collect()
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
    let striker = model.striker()?;
    let mut chain = Chain { damping_kg_per_s: damping_like(&model.chain, shared[0]), ..model.chain.clone() };
    let mut striker = Striker { damping_kg_per_s: shared[1], ..striker };
    for (quantity, factor) in quantities.zip(shared.iter().skip(N_DAMPINGS)) {
        quantity.apply(*factor, &mut chain, &mut striker);
    }
    Ok(Struck { chain, striker })
}

/// Residuals less unknowns, the places at rest among them.
pub(super) fn degrees_of_freedom(problem: &TrackResiduals<'_>) -> usize {
    let n_tracks = problem.observations.iter().map(|observation| observation.bodies.len()).sum::<usize>();
    let n_unknowns = N_DAMPINGS + 2 * problem.observations.len() + n_tracks;
    excess::degrees_of_freedom(problem.n_residuals, n_unknowns)
}

/// The range of striker velocities that a family must span: those given, and two standard deviations of the prior.
pub(super) fn range_of(strikers_m_per_s: &[f64], model: &TrackModel) -> [f64; 2] {
    let Estimate { value, sigma } = model.striker_velocity_m_per_s;
    let lowest = strikers_m_per_s.iter().copied().fold(value - 2.0 * sigma, f64::min);
    let highest = strikers_m_per_s.iter().copied().fold(value + 2.0 * sigma, f64::max);
    [lowest.max(1e-3 * value), highest]
}

/// What one recording has of its own in the equations of a part of the positions.
struct Sums {
    block: Block,
    /// Of each track.
    rests: Vec<RestSums>,
}

impl Sums {
    fn new(n_shared: usize, errors: &[usize], observation: &Observation) -> Self {
        let rests = vec![RestSums::new(n_shared, errors.len()); observation.bodies.len()];
        Self { block: Block::new(n_shared, errors), rests }
    }

    /// Adds rows of a track.
    fn add<'a>(&mut self, track: usize, rows: impl Iterator<Item = (Row<'a>, &'a Seen)>) {
        if let Some(rest) = self.rests.get_mut(track) {
            self.block.add_rows(rows.map(|(row, _)| row), rest);
        }
    }
}

#[cfg(test)]
mod tests;
