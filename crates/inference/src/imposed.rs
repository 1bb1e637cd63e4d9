//! Damping fitted to the motion behind body 1, which drives the chain as it was measured.

mod model;
mod residuals;

use chainwave_measurement::{ChainMotion, ErrorPattern, Estimate};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::displacements::Shifts;
use crate::error::FitError;
use crate::excess::inflation;
use crate::least_squares::{Failure, Minimum, Stop, minimise};
use crate::quantity::Quantity;
use residuals::{ImposedResiduals, N_ALWAYS};

pub use model::ImposedModel;

/// Damping of the chain fitted to the motion behind body 1. The striker's contact does not act on it, so c_s is not identifiable.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedFit {
    /// c_d.
    pub chain_damping_kg_per_s: Estimate,
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
    /// Sum of squared residuals, relative to the samples' total sigma, over their degrees of freedom.
    pub reduced_chi_squared: f64,
    /// Displacements compared.
    pub n_residuals: usize,
    /// Chain simulations carried out.
    pub n_simulations: u64,
}

impl ImposedFit {
    /// Why it gives no c_s.
    pub const NO_STRIKER_DAMPING: &'static str = "not identifiable: the measured motion of body 1 drives the chain, and the striker's contact acts on no other body";
}

/// Draws of body 1's noise, whose effect is known to 1/sqrt(2 n).
const N_DRAWS: usize = 50;
const SEED: u64 = 1;

/// Fits c_d to the displacement field of a motion, whose body 1 drives the chain as it was measured.
///
/// The motion is a mean over drives, and so is the model's, by the quadrature that the fit to the peak energies uses, with body 1 in
/// proportion to the drive. Samples are weighted by their independent noise; the errors that many of them share (the motion's modes)
/// and the noise of body 1 itself, which the model passes on, go through the estimator into the uncertainty.
///
/// # Errors
/// [`FitError`] as its variants say.
pub fn fit_imposed(motion: &ChainMotion, model: &ImposedModel) -> Result<ImposedFit, FitError> {
    let problem = ImposedResiduals::new(motion, model)?;
    let found = minimise(&problem, problem.start(), &[], &Stop::STATED);
    finish(&problem, &found.map_err(|why| problem.failure(why))?)
}

/// Takes through the estimator what errors of many samples and of body 1 do.
fn finish(problem: &ImposedResiduals<'_>, minimum: &Minimum) -> Result<ImposedFit, FitError> {
    let (_, covariance) = minimum.solved().map_err(|why: Failure<FitError>| problem.failure(why))?;
    let unknowns = &minimum.at.shared;
    let ImposedResiduals { displacements, span, .. } = problem;
    let (predicted, columns) = problem.predicted_by_unknowns(unknowns)?;
    let shifts = Shifts::new(displacements, &covariance, &columns);
    // All that the estimator does with an error is linear, so it is done with the patterns that errors are made of.
    let of_body_1 = |pattern: &ErrorPattern| (span.0..=span.1).map(|i| pattern.at((0, i))).collect();
    let errors_m: Vec<Vec<f64>> = displacements.motion.modes.patterns().iter().map(of_body_1).collect();
    let of_patterns = problem.passed_on(unknowns, &errors_m, |k, passed_on| {
        let mut error_m = shifts.pattern_m(k);
        passed_on.into_iter().for_each(|passed_on| error_m -= passed_on);
        shifts.by(&error_m).as_slice().to_vec()
    })?;
    let mut total = shifts.with_modes(&of_patterns);
    let mut random = Pcg64::seed_from_u64(SEED);
    let draws_m: Vec<Vec<f64>> = (0..N_DRAWS).map(|_| noise_of_body_1(problem, &mut random)).collect();
    let of_draws =
        problem.passed_on(unknowns, &draws_m, |_, passed_on| passed_on.map(|one| shifts.by(one)))?;
    for shift in of_draws.into_iter().flatten() {
        total += &shift * shift.transpose() / N_DRAWS as f64;
    }
    let reduced_chi_squared = displacements.reduced_chi_squared(&predicted, N_ALWAYS);
    let inflation = inflation(reduced_chi_squared);
    let estimate = |i: usize| Estimate::new(unknowns[i], inflation * total[(i, i)].sqrt());
    Ok(ImposedFit {
        chain_damping_kg_per_s: estimate(0),
        factors: problem.priors().found(estimate),
        reduced_chi_squared,
        n_residuals: displacements.samples.len(),
        n_simulations: problem.n_simulations(),
    })
}

fn noise_of_body_1(problem: &ImposedResiduals<'_>, random: &mut Pcg64) -> Vec<f64> {
    let noise_m = |k: usize| {
        let deviate: f64 = StandardNormal.sample(random);
        problem.displacements.motion.independent_sigma_m[(0, k)] * deviate
    };
    (problem.span.0..=problem.span.1).map(noise_m).collect()
}
