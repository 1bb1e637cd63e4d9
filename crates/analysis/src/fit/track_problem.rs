use chainwave_measurement::{BodyTrack, Estimate, Observation};
use chainwave_mechanics::{Chain, Drive, Schedule, Striker};
use nalgebra::DVector;

use super::FitError;
use super::arrow::{Eliminated, N_OWN, Own, SharedEquations, Sums, TrackSums};
use super::family::{Family, N_NODES, Weights};
use super::quantity::Quantity;
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
/// by shared quantities central differences of families whose error (the third derivative times the square of a step of a
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

/// A family with its steps on both sides of the state in each shared unknown.
struct Families {
    base: Family,
    beside: Vec<[Family; 2]>,
    widths: Vec<f64>,
}

/// How the families add up for one recording's striker.
struct Mixture<'a> {
    families: &'a Families,
    value: Weights,
    slope: Weights,
    beside: Vec<[Weights; 2]>,
    scale: f64,
    scale_unknown: Option<usize>,
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
        let families = self.families(state, n_simulations)?;
        let scale_unknown = scale_unknown(self.model);
        let scale = scale_unknown.map_or(1.0, |unknown| state.shared[unknown]);
        let mut recordings = Vec::with_capacity(self.observations.len());
        let mut by_recording = Vec::with_capacity(self.observations.len());
        let mut chi_squared = 0.0;
        for (observation, own) in self.observations.iter().zip(&state.own) {
            let mixture = Mixture::new(&families, own[0], scale, scale_unknown);
            let (mut sums, mut freedom) = (Sums::new(self.n_shared()), 0.0);
            for track in mixture.tracks(observation, own[1]) {
                sums.add_track(&track);
                freedom += track.freedom();
            }
            by_recording.push((sums.chi_squared(), freedom));
            let Estimate { value, sigma } = self.model.striker_velocity_m_per_s;
            sums.add_prior(0, (own[0] - value) / sigma, sigma.recip());
            chi_squared += sums.chi_squared();
            recordings.push(sums);
        }
        let priors = self.priors(state);
        chi_squared += priors.iter().map(|prior| prior.residual.powi(2)).sum::<f64>();
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

    fn families(&self, state: &State, n_simulations: &mut u64) -> Result<Families, FitError> {
        let strikers: Vec<f64> = state.own.iter().map(|own| own[0]).collect();
        let range = range_of(&strikers, self.model);
        let mut solve = |shared: &DVector<f64>, n_nodes: usize| {
            let family = self.family_of(shared, range, n_nodes)?;
            *n_simulations += family.n_simulations();
            Ok::<Family, FitError>(family)
        };
        let base = solve(&state.shared, N_NODES)?;
        let (mut beside, mut widths) = (Vec::new(), Vec::new());
        for (i, step) in self.steps.iter().enumerate() {
            let (mut lower, mut upper) = (state.shared.clone(), state.shared.clone());
            lower[i] = (lower[i] - step).max(0.0);
            upper[i] += step;
            let is_asked = i >= N_DAMPINGS + self.model.known.len();
            let n_nodes = if is_asked { N_NODES_ASKED } else { N_NODES };
            beside.push([solve(&lower, n_nodes)?, solve(&upper, n_nodes)?]);
            widths.push(upper[i] - lower[i]);
        }
        Ok(Families { base, beside, widths })
    }

    fn family_of(&self, shared: &DVector<f64>, range: [f64; 2], n_nodes: usize) -> Result<Family, FitError> {
        let quantities =
            self.model.known.iter().map(|known| known.quantity).chain(self.asked.iter().copied());
        let (chain, striker) = chain_of(self.model, shared, quantities)?;
        Ok(Family::new(&chain, &striker, range, &self.schedule, n_nodes)?)
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

impl<'a> Mixture<'a> {
    fn new(families: &'a Families, striker_m_per_s: f64, scale: f64, scale_unknown: Option<usize>) -> Self {
        let (value, slope) = families.base.weights(striker_m_per_s);
        let at = |pair: &[Family; 2]| [0, 1].map(|side| pair[side].weights(striker_m_per_s).0);
        let beside = families.beside.iter().map(at).collect();
        Self { families, value, slope, beside, scale, scale_unknown }
    }

    /// The sums of each track of a recording whose impact has the given stamp, frame by frame.
    fn tracks(&self, observation: &Observation, impact_time_s: f64) -> Vec<TrackSums> {
        let n_shared = self.beside.len();
        let mut sums: Vec<TrackSums> = observation.bodies.iter().map(|_| TrackSums::new(n_shared)).collect();
        let origins: Vec<f64> = observation.bodies.iter().map(first_position_m).collect();
        let last_s = observation.span_s().map_or(f64::NEG_INFINITY, |span| span.1);
        let mut row = vec![0.0; N_OWN + n_shared + 1];
        for (k, time_s) in observation.times_s.iter().enumerate().take_while(|(_, time_s)| **time_s <= last_s)
        {
            for (track, (sums, origin_m)) in observation.bodies.iter().zip(sums.iter_mut().zip(&origins)) {
                let Some(position) = track.position_m[k] else { continue };
                let from_first = Estimate::new(position.value - origin_m, position.sigma);
                self.fill(&mut row, track.body - 1, time_s - impact_time_s, from_first);
                sums.add(&row, position.sigma.recip());
            }
        }
        sums
    }

    /// A row (own, shared, residual) in units of the position's sigma; the residual is model less measurement.
    fn fill(&self, row: &mut [f64], body: usize, since_impact_s: f64, position: Estimate) {
        let inverse_sigma = position.sigma.recip();
        let last = row.len() - 1;
        row.fill(0.0);
        row[last] = -position.value * inverse_sigma;
        let Some(moment) = self.families.base.moment(since_impact_s).filter(|_| since_impact_s >= 0.0) else {
            return;
        };
        let base = &self.families.base;
        let x_m = base.displacement_m(&self.value, &moment, body);
        let factor = self.scale * inverse_sigma;
        row[0] = factor * base.displacement_m(&self.slope, &moment, body);
        row[1] = -factor * base.velocity_m_per_s(&self.value, &moment, body);
        row[last] += factor * x_m;
        let sides = self.families.beside.iter().zip(&self.beside).zip(&self.families.widths);
        for (entry, (([lower, upper], [of_lower, of_upper]), width)) in row[N_OWN..last].iter_mut().zip(sides)
        {
            let difference_m =
                upper.displacement_m(of_upper, &moment, body) - lower.displacement_m(of_lower, &moment, body);
            *entry = factor * difference_m / width;
        }
        if let Some(unknown) = self.scale_unknown {
            row[N_OWN + unknown] = x_m * inverse_sigma;
        }
    }
}

/// Positions count from the first one seen, so that sums of squares keep their digits.
fn first_position_m(track: &BodyTrack) -> f64 {
    track.position_m.iter().flatten().next().map_or(0.0, |position| position.value)
}
