//! Damping fitted to the motion of a chain that is let go from a known state.

use std::sync::atomic::{AtomicU64, Ordering};

use chainwave_measurement::{ChainMotion, Estimate, Trajectory};
use chainwave_mechanics::{Chain, Change, Schedule, simulate_with_sensitivities};
use nalgebra::DVector;

use crate::damping::mean_damping_kg_per_s;
use crate::displacements::{Displacements, Shifts};
use crate::error::FitError;
use crate::excess::inflation;
use crate::least_squares::{
    Bounds, Failure, LeastSquares, Minimum, NormalEquations, Stop, Unknowns, minimise,
};
use crate::priors::PriorFactors;
use crate::quadrature::quadrature;
use crate::quantity::{Prior, Quantity};
use crate::steps::{BESIDE_FACTOR, beside_c_d};

/// What is assumed of a chain that is let go.
#[derive(Debug, Clone, PartialEq)]
pub struct ReleasedModel {
    /// The chain, let go from its state ([`Drive::Free`](chainwave_mechanics::Drive::Free)); its damping is the starting value.
    pub chain: Chain,
    /// Relative standard uncertainty of the state, all bodies alike.
    pub state_sigma: f64,
    /// Quantities that are known only within an uncertainty; the others count as exact.
    pub priors: Vec<Prior>,
    /// Drive of each recording behind the motion, relative to the mean drive, less one.
    pub drive_deviations: Vec<f64>,
}

/// What a fit to a release found.
#[derive(Debug, Clone, PartialEq)]
pub struct ReleasedFit {
    /// c_d.
    pub chain_damping_kg_per_s: Estimate,
    /// When the chain was let go, in seconds after the trigger.
    pub release_time_s: Estimate,
    /// The state over the stated one.
    pub state: Estimate,
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
    /// Sum of squared residuals, relative to the samples' total sigma, over their degrees of freedom.
    pub reduced_chi_squared: f64,
    /// Displacements compared.
    pub n_residuals: usize,
    /// Chain simulations carried out.
    pub n_simulations: u64,
}

impl ReleasedFit {
    /// Why it gives no c_s.
    pub const NO_STRIKER_DAMPING: &'static str =
        "there is none: no striker's contact acts on a chain that is let go";
}

/// Places of the unknowns; factors follow.
const C_D: usize = 0;
const RELEASE: usize = 1;
const STATE: usize = 2;
const N_FIXED: usize = 3;
/// Of these the state has a prior, and the other two have none.
const N_WITHOUT_PRIOR: usize = 2;

/// Fits c_d, the instant of the release and the size of the state to the displacements of all bodies from where they were held.
///
/// The motion is a mean over drives, and so is the model's, by the quadrature that the fit to the peak energies uses. Samples are weighted
/// by their independent noise; the errors that many of them share (the motion's modes) go through the estimator into the uncertainty.
///
/// # Errors
/// [`FitError`] as its variants say.
pub fn fit_release(motion: &ChainMotion, model: &ReleasedModel) -> Result<ReleasedFit, FitError> {
    let problem = ReleasedResiduals::new(motion, model)?;
    let found = minimise(&problem, problem.start(), &[], &Stop::STATED);
    problem.finish(&found.map_err(|why| problem.failure(why))?)
}

/// Displacements of all bodies, in units of their independent noise.
struct ReleasedResiduals<'a> {
    displacements: Displacements<'a>,
    model: &'a ReleasedModel,
    nodes: Vec<(f64, f64)>,
    schedule: Schedule,
    bounds: Bounds,
    n_simulations: AtomicU64,
}

impl<'a> ReleasedResiduals<'a> {
    fn new(motion: &'a ChainMotion, model: &'a ReleasedModel) -> Result<Self, FitError> {
        let n_times = motion.times_s.len();
        let all = (0..motion.n_bodies(), 0..n_times);
        let displacements = Displacements::new(motion, model.chain.n_bodies(), all)?;
        let (first_s, last_s) = (motion.times_s[0], motion.times_s[n_times - 1]);
        let interval_s = (last_s - first_s) / (n_times - 1) as f64;
        // Long enough for a release at the first sample.
        let schedule = Schedule::automatic(last_s - first_s + 2.0 * interval_s, interval_s);
        let mut shared = vec![(0.0, f64::INFINITY), (first_s, last_s), (0.5, 2.0)];
        shared.extend(PriorFactors::new(&model.priors, N_FIXED).bounds());
        Ok(Self {
            displacements,
            model,
            nodes: quadrature(&model.drive_deviations),
            schedule,
            bounds: Bounds::dense(shared),
            n_simulations: AtomicU64::new(0),
        })
    }

    /// Where the search begins: let go at the trigger.
    fn start(&self) -> Unknowns {
        let (earliest_s, latest_s) = self.bounds.shared[RELEASE];
        let mut start = vec![mean_damping_kg_per_s(&self.model.chain), 0.0_f64.clamp(earliest_s, latest_s)];
        start.resize(N_FIXED + self.model.priors.len(), 1.0);
        Unknowns::dense(DVector::from_vec(start))
    }

    /// A search's failure in words.
    fn failure(&self, failure: Failure<FitError>) -> FitError {
        FitError::of(failure, "the motion of a chain that is let go", |unknown| match unknown {
            C_D => "c_d".into(),
            RELEASE => "the instant of the release".into(),
            STATE => "the state".into(),
            factor => self.priors().name(factor),
        })
    }

    /// The factors on what is known within an uncertainty.
    fn priors(&self) -> PriorFactors<'a> {
        PriorFactors::new(&self.model.priors, N_FIXED)
    }

    /// The chain with trial values in place, let go from the state of one of the drives.
    fn chain(&self, unknowns: &DVector<f64>, deviation: f64) -> Chain {
        let mut chain = self.priors().without_striker(&self.model.chain, unknowns[C_D], unknowns);
        chain.drive = chain.drive.with_strength(unknowns[STATE] * (1.0 + deviation));
        chain
    }

    /// The chains on both sides of an unknown: a step of a damping, but no farther than to none, or of a factor.
    fn change(&self, unknowns: &DVector<f64>, unknown: usize, deviation: f64) -> Change {
        let [below, above] = match unknown {
            C_D => beside_c_d(&self.model.chain, unknowns[C_D]),
            _ => BESIDE_FACTOR,
        };
        let moved = |by: f64| {
            let mut moved = unknowns.clone();
            moved[unknown] += by;
            self.chain(&moved, deviation)
        };
        Change { below: moved(below), above: moved(above), width: above - below }
    }

    /// Displacements from where the bodies were held at the samples compared, and their derivatives by every unknown.
    fn predicted(&self, unknowns: &DVector<f64>) -> Result<(DVector<f64>, Vec<DVector<f64>>), FitError> {
        let Displacements { motion, samples } = &self.displacements;
        let scale = self.priors().picture_scale(unknowns);
        let mut sum = DVector::zeros(samples.len());
        let mut derivatives = vec![sum.clone(); unknowns.len()];
        let by_chain: Vec<usize> = (0..unknowns.len()).filter(|unknown| *unknown != RELEASE).collect();
        for (weight, deviation) in &self.nodes {
            let changes: Vec<Change> =
                by_chain.iter().map(|unknown| self.change(unknowns, *unknown, *deviation)).collect();
            let here = self.chain(unknowns, *deviation);
            let found = simulate_with_sensitivities(&here, &self.schedule, &changes)?;
            self.n_simulations.fetch_add(1, Ordering::Relaxed);
            let moved = Released { motion: &found.simulation.trajectory, release_s: unknowns[RELEASE] };
            for (i, sample) in samples.iter().enumerate() {
                let (moved_m, speed_m_per_s) = moved.at(motion.times_s[sample.1], sample.0);
                sum[i] += weight * scale * moved_m;
                derivatives[RELEASE][i] -= weight * scale * speed_m_per_s;
                for unknown in by_chain.iter().filter(|unknown| self.priors().is_picture_scale(**unknown)) {
                    derivatives[*unknown][i] += weight * moved_m;
                }
            }
            for (unknown, derivative) in by_chain.iter().zip(&found.derivatives) {
                let moved = Released { motion: derivative, release_s: unknowns[RELEASE] };
                for (i, sample) in samples.iter().enumerate() {
                    let (by_unknown, _) = moved.at(motion.times_s[sample.1], sample.0);
                    derivatives[*unknown][i] += weight * scale * by_unknown;
                }
            }
        }
        Ok((sum, derivatives))
    }

    /// Takes through the estimator what errors of many samples do.
    fn finish(&self, minimum: &Minimum) -> Result<ReleasedFit, FitError> {
        let (_, covariance) = minimum.solved().map_err(|why: Failure<FitError>| self.failure(why))?;
        let unknowns = &minimum.at.shared;
        let (predicted, columns) = self.predicted(unknowns)?;
        let shifts = Shifts::new(&self.displacements, &covariance, &columns);
        // All that the estimator does with an error is linear, so it is done with the patterns that errors are made of.
        let n_patterns = self.displacements.motion.modes.patterns().len();
        let of_pattern = |pattern: usize| shifts.by(&shifts.pattern_m(pattern)).as_slice().to_vec();
        let total = shifts.with_modes(&(0..n_patterns).map(of_pattern).collect::<Vec<_>>());
        let reduced_chi_squared = self.displacements.reduced_chi_squared(&predicted, N_WITHOUT_PRIOR);
        let inflation = inflation(reduced_chi_squared);
        let estimate = |i: usize| Estimate::new(unknowns[i], inflation * total[(i, i)].sqrt());
        Ok(ReleasedFit {
            chain_damping_kg_per_s: estimate(C_D),
            release_time_s: estimate(RELEASE),
            state: estimate(STATE),
            factors: self.priors().found(estimate),
            reduced_chi_squared,
            n_residuals: self.displacements.samples.len(),
            n_simulations: self.n_simulations.load(Ordering::Relaxed),
        })
    }
}

/// A motion, or its derivative, from an instant on.
struct Released<'a> {
    motion: &'a Trajectory,
    release_s: f64,
}

impl Released<'_> {
    /// Displacement of a body from where it was held, and its velocity; none of either before the release.
    fn at(&self, time_s: f64, row: usize) -> (f64, f64) {
        let since_s = time_s - self.release_s;
        let moment = (since_s > 0.0).then(|| self.motion.at(since_s)).flatten();
        let held = self.motion.displacement_m[(row, 0)];
        moment.map_or((0.0, 0.0), |moment| (moment.displacement_m(row) - held, moment.velocity_m_per_s(row)))
    }
}

impl LeastSquares for ReleasedResiduals<'_> {
    type Error = FitError;

    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    fn equations(&self, at: &Unknowns) -> Result<NormalEquations, FitError> {
        let (predicted, columns) = self.predicted(&at.shared)?;
        let mut equations = self.displacements.equations(&predicted, &columns);
        self.priors().add_priors(&mut equations, &at.shared);
        let of_state = self.model.state_sigma;
        equations.add_prior(STATE, (at.shared[STATE] - 1.0) / of_state, of_state.recip());
        Ok(equations)
    }
}
