//! Damping fitted to the motion behind body 1, which drives the chain as it was measured.

mod model;
mod residuals;

use chainwave_measurement::{ChainMotion, ErrorPattern, Estimate};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::error::FitError;
use crate::least_squares::{Failure, Minimum, Stop, minimise};
use crate::quantity::Quantity;
use residuals::ImposedResiduals;

pub use model::ImposedModel;

/// Damping of the chain fitted to the motion behind body 1. The striker's contact does not act on it, so c_s is not identifiable.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedFit {
    /// c_d.
    pub chain_damping_kg_per_s: Estimate,
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
    /// Sum of squared residuals, relative to the samples' total sigma, over their number.
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
    let ImposedResiduals { motion, span, samples, .. } = problem;
    let (predicted, columns) = problem.predicted_by_unknowns(unknowns)?;
    let shifts = Shifts::new(problem, &covariance, &columns);
    let mut total = covariance.clone();
    // All that the estimator does with an error is linear, so it is done with the patterns that errors are made of.
    let patterns = motion.modes.patterns();
    let of_body_1 = |pattern: &ErrorPattern| (span.0..=span.1).map(|i| pattern.at((0, i))).collect();
    let errors_m: Vec<Vec<f64>> = patterns.iter().map(of_body_1).collect();
    let of_patterns = problem.passed_on(unknowns, &errors_m, |k, passed_on| {
        let mut error_m = DVector::from_fn(samples.len(), |i, _| patterns[k].at(samples[i]));
        passed_on.into_iter().for_each(|passed_on| error_m -= passed_on);
        shifts.by(&error_m).as_slice().to_vec()
    })?;
    for shift in motion.modes.combined(&of_patterns).map(DVector::from_vec) {
        total += &shift * shift.transpose();
    }
    let mut random = Pcg64::seed_from_u64(SEED);
    let draws_m: Vec<Vec<f64>> = (0..N_DRAWS).map(|_| noise_of_body_1(problem, &mut random)).collect();
    let of_draws =
        problem.passed_on(unknowns, &draws_m, |_, passed_on| passed_on.map(|one| shifts.by(one)))?;
    for shift in of_draws.into_iter().flatten() {
        total += &shift * shift.transpose() / N_DRAWS as f64;
    }
    let residual = |(i, sample): (usize, &(usize, usize))| {
        let x = motion.displacement_m[*sample]?;
        Some(((x.value - predicted[i]) / x.sigma).powi(2))
    };
    let squares: f64 = samples.iter().enumerate().filter_map(residual).sum();
    let reduced_chi_squared = squares / samples.len() as f64;
    // Residuals larger than stated widen the intervals; smaller ones do not narrow them.
    let inflation = reduced_chi_squared.max(1.0).sqrt();
    let estimate = |i: usize| Estimate::new(unknowns[i], inflation * total[(i, i)].sqrt());
    let known = problem.model.known.iter().zip(1..);
    Ok(ImposedFit {
        chain_damping_kg_per_s: estimate(0),
        factors: known.map(|(known, i)| (known.quantity, estimate(i))).collect(),
        reduced_chi_squared,
        n_residuals: samples.len(),
        n_simulations: problem.n_simulations(),
    })
}

/// How errors of the samples compared move the unknowns.
struct Shifts<'a> {
    covariance: &'a DMatrix<f64>,
    /// Derivatives by the unknowns over the samples' variances.
    weighted: DMatrix<f64>,
}

impl<'a> Shifts<'a> {
    fn new(
        problem: &ImposedResiduals<'_>,
        covariance: &'a DMatrix<f64>,
        derivatives: &[DVector<f64>],
    ) -> Self {
        let mut weighted = DMatrix::from_columns(derivatives);
        for (mut row, sample) in weighted.row_iter_mut().zip(&problem.samples) {
            row *= problem.motion.independent_sigma_m[*sample].powi(-2);
        }
        Self { covariance, weighted }
    }

    /// C J' W e.
    fn by(&self, error_m: &DVector<f64>) -> DVector<f64> {
        self.covariance * self.weighted.tr_mul(error_m)
    }
}

fn noise_of_body_1(problem: &ImposedResiduals<'_>, random: &mut Pcg64) -> Vec<f64> {
    let noise_m = |k: usize| {
        let deviate: f64 = StandardNormal.sample(random);
        problem.motion.independent_sigma_m[(0, k)] * deviate
    };
    (problem.span.0..=problem.span.1).map(noise_m).collect()
}
