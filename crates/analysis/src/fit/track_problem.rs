use chainwave_measurement::{BodyTrack, Estimate, Observation, map_in_parallel};
use chainwave_mechanics::{Chain, Drive, Schedule, Striker};
use nalgebra::DVector;

use super::FitError;
use super::arrow::{Eliminated, N_OWN, Own, SharedEquations, Sums, TrackSums};
use super::family::{Family, N_NODES, Weights};
use super::quantity::Quantity;
use super::response::{Response, Variant, respond};
use super::tracks::TrackModel;

/// c_d and c_s stand first among the shared unknowns.
pub(super) const N_DAMPINGS: usize = 2;
/// Simulated samples per frame; between them, cubic Hermite interpolation is exact to 1e-11 m on the paper's chain.
pub(super) const SAMPLES_PER_FRAME: f64 = 4.0;
/// Frames by which an impact may precede its trigger.
const MARGIN_FRAMES: f64 = 25.0;
/// Strikers farther from the mean than this, relative to it, are beyond the family's interpolation.
const WIDEST_DRIVE: f64 = 0.5;
/// Factors on quantities stay within this of one, up and down.
const LARGEST_FACTOR: f64 = 2.0;
/// Nodes in the striker's velocity for quantities that are only asked about: the derivative is then good to the square of the strikers'
/// scatter.
const N_NODES_ASKED: usize = 2;

/// The tracks of all recordings against the chain model.
///
/// Sensitivities by the striker's velocity are the derivative of the family's polynomial, those by time the model's velocities, those
/// by shared quantities central differences of simulations whose error (the third derivative times the square of a step of a
/// thousandth of the quantity's natural scale) a test holds below a thousandth.
pub(super) struct Problem<'a> {
    pub(super) observations: &'a [Observation],
    pub(super) model: &'a TrackModel,
    /// Quantities without a prior, beside those of the model.
    asked: &'a [Quantity],
    /// Steps of the differences in the shared unknowns.
    steps: Vec<f64>,
    schedule: Schedule,
    pub(super) n_residuals: usize,
}

/// Values of all unknowns.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// c_d, c_s, and a factor for each quantity.
    pub(super) shared: DVector<f64>,
    /// Striker velocity and impact of each recording.
    pub(super) own: Vec<Own>,
}

/// A residual that depends on one unknown alone.
struct Prior {
    unknown: usize,
    residual: f64,
    slope: f64,
}

/// The equations at a state.
pub(super) struct Linearised {
    recordings: Vec<Sums>,
    priors: Vec<Prior>,
    /// Residuals' sum of squares, priors included.
    pub(super) chi_squared: f64,
    /// Residuals' sum of squares and number, recording by recording.
    pub(super) by_recording: Vec<(f64, f64)>,
    n_shared: usize,
}

impl Linearised {
    /// The recordings without their own unknowns, every diagonal entry raised by the share `damping`.
    pub(super) fn eliminated(&self, damping: f64) -> Option<Vec<Eliminated>> {
        self.recordings.iter().map(|recording| recording.eliminated(damping)).collect()
    }

    /// The equations of the shared unknowns, each recording with its weight.
    pub(super) fn equations(
        &self,
        recordings: &[Eliminated],
        weight: impl Fn(usize) -> f64,
        damping: f64,
    ) -> SharedEquations {
        let mut equations = SharedEquations::new(self.n_shared);
        recordings.iter().enumerate().for_each(|(r, recording)| equations.add(recording, weight(r)));
        for prior in &self.priors {
            equations.add_prior(prior.unknown, prior.residual, prior.slope, damping);
        }
        equations
    }
}

/// The model at a state, and on both sides of it in each shared unknown that the chain feels.
struct Model {
    base: Response,
    beside: Vec<Option<Beside>>,
    /// Length in the pictures over true length, and its place among the shared unknowns.
    scale: f64,
    scale_unknown: Option<usize>,
}

/// A step down and a step up from the state in one unknown.
struct Beside {
    pair: [Response; 2],
    width: f64,
}

impl<'a> Problem<'a> {
    pub(super) fn new(
        observations: &'a [Observation],
        model: &'a TrackModel,
        asked: &'a [Quantity],
    ) -> Result<Self, FitError> {
        let n_residuals = check(observations, model)?;
        // One per cent of critical for a HEC on one contact, a tenth of it for the striker's; a thousandth of that is a step whose
        // own error (1e-6 of the curvature) and the simulation's rounding are both far below the noise.
        let critical = 2.0 * (model.chain.contact.k_0_n_per_m() * model.chain.mass_kg[0]).sqrt();
        let mut steps = vec![1e-5 * critical, 1e-4 * critical];
        steps.extend((0..model.known.len() + asked.len()).map(|_| 1e-4));
        let span = |observation: &Observation| observation.span_s().map_or(0.0, |span| span.1);
        let frame_s = observations.iter().map(Observation::frame_interval_s).fold(f64::INFINITY, f64::min);
        let last_s = observations.iter().map(span).fold(0.0, f64::max);
        let duration_s = last_s + (MARGIN_FRAMES * frame_s).max(0.1 * last_s);
        let schedule = Schedule::automatic(duration_s, frame_s / SAMPLES_PER_FRAME);
        Ok(Self { observations, model, asked, steps, schedule, n_residuals })
    }

    /// Number of shared unknowns.
    pub(super) fn n_shared(&self) -> usize {
        self.steps.len()
    }

    /// The state after a step; damping stays at or above zero, factors and strikers within reason.
    pub(super) fn stepped(&self, state: &State, shared: &DVector<f64>, own: &[Own]) -> State {
        let mean = self.model.striker_velocity_m_per_s.value;
        let mut shared = &state.shared + shared;
        for (i, value) in shared.iter_mut().enumerate() {
            *value = match i < N_DAMPINGS {
                true => value.max(0.0),
                false => value.clamp(LARGEST_FACTOR.recip(), LARGEST_FACTOR),
            };
        }
        let own = state.own.iter().zip(own).map(|(own, step)| {
            let velocity = (own[0] + step[0]).clamp((1.0 - WIDEST_DRIVE) * mean, (1.0 + WIDEST_DRIVE) * mean);
            Own::new(velocity, own[1] + step[1])
        });
        State { shared, own: own.collect() }
    }

    /// Solves the chain around a state, and sums up residuals and derivatives.
    pub(super) fn linearise(&self, state: &State, n_simulations: &mut u64) -> Result<Linearised, FitError> {
        let model = self.solve(state, n_simulations)?;
        let n_positions = |observation: &Observation| -> usize {
            observation.bodies.iter().map(|track| track.position_m.iter().flatten().count()).sum()
        };
        let first_places: Vec<usize> = self
            .observations
            .iter()
            .scan(0, |sum, observation| Some(std::mem::replace(sum, *sum + n_positions(observation))))
            .collect();
        let sums = map_in_parallel(self.observations.len(), self.model.n_threads, |r| {
            let own = &state.own[r];
            let tracks = Mixture::new(&model, own[0]).tracks(&self.observations[r], first_places[r]);
            let (mut sums, mut freedom) = (Sums::new(self.n_shared()), 0.0);
            for track in tracks {
                sums.add_track(&track);
                freedom += track.freedom();
            }
            let of_tracks = (sums.chi_squared(), freedom);
            let Estimate { value, sigma } = self.model.striker_velocity_m_per_s;
            sums.add_prior(0, (own[0] - value) / sigma, sigma.recip());
            (sums, of_tracks)
        });
        let (recordings, by_recording): (Vec<Sums>, Vec<(f64, f64)>) = sums.into_iter().unzip();
        let priors = self.priors(state);
        let chi_squared = recordings.iter().map(Sums::chi_squared).sum::<f64>()
            + priors.iter().map(|prior| prior.residual.powi(2)).sum::<f64>();
        Ok(Linearised { recordings, priors, chi_squared, by_recording, n_shared: self.n_shared() })
    }

    fn priors(&self, state: &State) -> Vec<Prior> {
        let known = self.model.known.iter().zip(N_DAMPINGS..);
        let prior = |(known, unknown): (&super::Known, usize)| Prior {
            unknown,
            residual: (state.shared[unknown] - 1.0) / known.relative_sigma,
            slope: known.relative_sigma.recip(),
        };
        known.map(prior).collect()
    }

    /// The model at a state, all its simulations side by side.
    fn solve(&self, state: &State, n_simulations: &mut u64) -> Result<Model, FitError> {
        let strikers: Vec<f64> = state.own.iter().map(|own| own[0]).collect();
        let range = range_of(&strikers, self.model);
        let scale_unknown = scale_unknown(self.model);
        let mut variants = vec![self.variant(&state.shared, Family::new(range, N_NODES))?];
        let mut widths = Vec::with_capacity(self.n_shared());
        for (i, step) in self.steps.iter().enumerate() {
            let (mut lower, mut upper) = (state.shared.clone(), state.shared.clone());
            lower[i] = (lower[i] - step).max(0.0);
            upper[i] += step;
            // The chain does not feel the scale of the pictures.
            let is_felt = Some(i) != scale_unknown;
            widths.push(is_felt.then(|| upper[i] - lower[i]));
            if is_felt {
                let is_asked = i >= N_DAMPINGS + self.model.known.len();
                let family = Family::new(range, if is_asked { N_NODES_ASKED } else { N_NODES });
                variants.push(self.variant(&lower, family.clone())?);
                variants.push(self.variant(&upper, family)?);
            }
        }
        let places = (self.observations, state.own.as_slice());
        let responses = respond(variants, &self.schedule, places, self.model.n_threads)?;
        *n_simulations += responses.iter().map(Response::n_simulations).sum::<u64>();
        let mut responses = responses.into_iter();
        let mut next = || responses.next().ok_or_else(super::search::undetermined);
        let base = next()?;
        let mut pair = |width: Option<f64>| -> Result<Option<Beside>, FitError> {
            width.map(|width| Ok(Beside { pair: [next()?, next()?], width })).transpose()
        };
        let beside = widths.into_iter().map(&mut pair).collect::<Result<_, _>>()?;
        let scale = scale_unknown.map_or(1.0, |unknown| state.shared[unknown]);
        Ok(Model { base, beside, scale, scale_unknown })
    }

    fn variant(&self, shared: &DVector<f64>, family: Family) -> Result<Variant, FitError> {
        let quantities =
            self.model.known.iter().map(|known| known.quantity).chain(self.asked.iter().copied());
        let (chain, striker) = chain_of(self.model, shared, quantities)?;
        Ok(Variant { chain, striker, family })
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
pub(super) fn chain_of(
    model: &TrackModel,
    shared: &DVector<f64>,
    quantities: impl Iterator<Item = Quantity>,
) -> Result<(Chain, Striker), FitError> {
    let Drive::Striker(striker) = &model.chain.drive else { return Err(FitError::NoStriker) };
    let mut chain =
        Chain { damping_kg_per_s: vec![shared[0]; model.chain.n_bodies()], ..model.chain.clone() };
    let mut striker = Striker { damping_kg_per_s: shared[1], ..*striker };
    for (quantity, factor) in quantities.zip(shared.iter().skip(N_DAMPINGS)) {
        quantity.apply(*factor, &mut chain, &mut striker);
    }
    Ok((chain, striker))
}

/// The range of striker velocities that a family must span: those given, and two standard deviations of the prior.
pub(super) fn range_of(strikers_m_per_s: &[f64], model: &TrackModel) -> [f64; 2] {
    let Estimate { value, sigma } = model.striker_velocity_m_per_s;
    let lowest = strikers_m_per_s.iter().copied().fold(value - 2.0 * sigma, f64::min);
    let highest = strikers_m_per_s.iter().copied().fold(value + 2.0 * sigma, f64::max);
    [lowest.max(1e-3 * value), highest]
}

fn scale_unknown(model: &TrackModel) -> Option<usize> {
    let place = model.known.iter().position(|known| known.quantity == Quantity::Scale);
    place.map(|i| N_DAMPINGS + i)
}

/// How the model's simulations add up for one recording's striker.
struct Mixture<'a> {
    model: &'a Model,
    value: Weights,
    slope: Weights,
    beside: Vec<[Weights; 2]>,
}

impl<'a> Mixture<'a> {
    fn new(model: &'a Model, striker_m_per_s: f64) -> Self {
        let (value, slope) = model.base.weights(striker_m_per_s);
        let of_pair = |beside: &Beside| [0, 1].map(|side| beside.pair[side].weights(striker_m_per_s).0);
        let beside = model.beside.iter().map(|beside| beside.as_ref().map_or_else(Default::default, of_pair));
        Self { model, value, slope, beside: beside.collect() }
    }

    /// The sums of each track of a recording, whose positions begin at `place` among all.
    fn tracks(&self, observation: &Observation, mut place: usize) -> Vec<TrackSums> {
        let n_shared = self.beside.len();
        let mut row = vec![0.0; N_OWN + n_shared + 1];
        let sums_of = |track: &BodyTrack| {
            let (origin_m, mut sums) = (first_position_m(track), TrackSums::new(n_shared));
            for position in track.position_m.iter().flatten() {
                let from_first = Estimate::new(position.value - origin_m, position.sigma);
                self.fill(&mut row, place, from_first);
                sums.add(&row, position.sigma.recip());
                place += 1;
            }
            sums
        };
        observation.bodies.iter().map(sums_of).collect()
    }

    /// A row (own, shared, residual) in units of the position's sigma; the residual is model less measurement.
    fn fill(&self, row: &mut [f64], place: usize, position: Estimate) {
        let Model { base, beside, scale, scale_unknown } = self.model;
        let inverse_sigma = position.sigma.recip();
        let factor = scale * inverse_sigma;
        let last = row.len() - 1;
        let x_m = base.displacement_m(&self.value, place);
        row[0] = factor * base.displacement_m(&self.slope, place);
        row[1] = -factor * base.velocity_m_per_s(&self.value, place);
        row[last] = factor * x_m - position.value * inverse_sigma;
        for (entry, (beside, weights)) in row[N_OWN..last].iter_mut().zip(beside.iter().zip(&self.beside)) {
            let difference_m = |Beside { pair: [lower, upper], width }: &Beside| {
                (upper.displacement_m(&weights[1], place) - lower.displacement_m(&weights[0], place)) / width
            };
            *entry = factor * beside.as_ref().map_or(0.0, difference_m);
        }
        if let Some(unknown) = scale_unknown {
            row[N_OWN + unknown] = x_m * inverse_sigma;
        }
    }
}

/// Positions count from the first one seen, so that sums of squares keep their digits.
fn first_position_m(track: &BodyTrack) -> f64 {
    track.position_m.iter().flatten().next().map_or(0.0, |position| position.value)
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::{FarEnd, PowerLaw, simulate};

    use super::super::Known;
    use super::*;

    /// One trial that sees eight bodies, without noise.
    fn observed(chain: &Chain) -> Observation {
        let moved = simulate(chain, &Schedule::automatic(0.008, 1e-5)).unwrap().trajectory;
        let times_s: Vec<f64> = (0..150).map(|k| 4e-5 * f64::from(k)).collect();
        let track = |body: usize| {
            let place = |t_s: &f64| Some(Estimate::new(moved.at(*t_s)?.displacement_m(body - 1), 0.4e-6));
            BodyTrack { body, position_m: times_s.iter().map(place).collect() }
        };
        let bodies = (1..=8).map(track).collect();
        Observation { recording: "one".into(), view: 0, trial: 0, times_s, bodies }
    }

    #[test]
    fn sensitivities_hardly_depend_on_the_step() {
        let chain = Chain {
            mass_kg: vec![0.455e-3; 8],
            damping_kg_per_s: vec![0.003; 8],
            contact: PowerLaw::new(60.1, 2.27e-3, 0.114).unwrap().into(),
            drive: Drive::Striker(Striker { mass_kg: 4.3e-3, velocity_m_per_s: 2.73, damping_kg_per_s: 0.2 }),
            far_end: FarEnd::Free,
        };
        let quantities = [
            Quantity::BodyMass,
            Quantity::Prefactor,
            Quantity::Offset,
            Quantity::Exponent,
            Quantity::Softening,
        ];
        let known = quantities.map(|quantity| Known { quantity, relative_sigma: 0.01 }).into();
        let observations = [observed(&chain)];
        let velocity = Estimate::new(2.73, 0.05);
        let n_threads = std::num::NonZero::<usize>::MIN;
        let model = TrackModel { chain, striker_velocity_m_per_s: velocity, known, n_threads };
        let mut problem = Problem::new(&observations, &model, &[]).unwrap();
        let shared = DVector::from_vec([vec![0.003, 0.2], vec![1.0; 5]].concat());
        let state = State { shared, own: vec![Own::new(2.73, 0.0)] };
        let mut squares = || {
            let model = problem.solve(&state, &mut 0).unwrap();
            let tracks = Mixture::new(&model, 2.73).tracks(&observations[0], 0);
            problem.steps.iter_mut().for_each(|step| *step *= 4.0);
            (0..7)
                .map(|i| tracks.iter().map(|track| track.square(N_OWN + i)).sum::<f64>())
                .collect::<Vec<_>>()
        };
        for (i, (fine, coarse)) in squares().into_iter().zip(squares()).enumerate() {
            // The error grows with the square of the step, so that of the finer one is a fifteenth of the difference.
            assert!((coarse / fine - 1.0).abs() < 2e-3, "unknown {i}: {fine} {coarse}");
        }
    }
}
