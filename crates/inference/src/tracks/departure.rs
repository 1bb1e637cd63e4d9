//! Whether the tracks ask for more than the simplest model.

use chainwave_analysis::probability::{chi_squared_beyond, normal_beyond};
use chainwave_analysis::{Departure, LEVEL, Rule};
use chainwave_measurement::{Estimate, Observation};
use nalgebra::{DMatrix, DVector};

use super::model::TrackModel;
use super::outcome::{FittedRecording, TrackFit};
use super::residuals::{TrackResiduals, freedom};
use crate::error::FitError;
use crate::least_squares::{Failure, LeastSquares, Own, Unknowns};
use crate::measured_rates;
use crate::quantity::Quantity;

/// Whether the contact law softens at all: the factor on its softening (1 as stated, 0 for a spring of the same stiffness), against 0.
///
/// It is one Gauss-Newton step from the fit, all other unknowns moving along, so a spring far from the stated law is told by a
/// statistic that is too large to be exact, and one near it, where the decision is close, by an exact one.
///
/// # Errors
/// [`FitError`] when the tracks do not determine it.
pub fn softening(observations: &[Observation], fit: &TrackFit) -> Result<Departure, FitError> {
    softening_at(observations, (&fit.model, &asked_of(fit)), &unknowns_of(fit))
}

/// The same at the unknowns of a minimum of a model, and what is asked of it.
pub(crate) fn softening_at(
    observations: &[Observation],
    model: (&TrackModel, &[Quantity]),
    at: &Unknowns,
) -> Result<Departure, FitError> {
    let asked = FreedQuantities::of(observations, model, at, &[Quantity::Softening])?;
    let size = Estimate::new(1.0 + asked.step[0], asked.covariance[(0, 0)].sqrt());
    let z = size.value / size.sigma;
    Ok(Departure { size, chi_squared: z * z, freedom: 1, p_value: normal_beyond(z) })
}

/// The rule by which the contact law counts as a spring.
pub fn softening_rule() -> Rule {
    Rule {
        question: "contact law",
        text: format!(
            "a spring unless the tracks tell the law's softening from zero (one-sided, {} % level); 1 is the law that the experiment gives",
            100.0 * LEVEL
        ),
        level: Some(LEVEL),
        rates: measured_rates::SOFTENING.to_vec(),
    }
}

/// The rule by which bodies count as alike.
pub fn scatter_of_bodies_rule() -> Rule {
    Rule {
        question: "differences between bodies",
        text: format!(
            "none unless masses that are free in each body scatter by more than their errors (chi squared, {} % level); a stiffness that \
             scatters from gap to gap shows as well",
            100.0 * LEVEL
        ),
        level: Some(LEVEL),
        rates: measured_rates::SCATTER.to_vec(),
    }
}

/// Whether bodies differ: a factor on each body's mass about their mean, against none. Its size is the standard deviation of the masses
/// beyond what their own errors make of it, relative to the mean.
///
/// A stiffness that scatters from gap to gap shows here too, as it delays the wave as a heavier body does.
///
/// # Errors
/// [`FitError`] when the tracks do not determine it.
pub fn scatter_of_bodies(observations: &[Observation], fit: &TrackFit) -> Result<Departure, FitError> {
    scatter_of_bodies_at(observations, (&fit.model, &asked_of(fit)), &unknowns_of(fit))
}

/// The same at the unknowns of a minimum of a model, and what is asked of it.
pub(crate) fn scatter_of_bodies_at(
    observations: &[Observation],
    model: (&TrackModel, &[Quantity]),
    at: &Unknowns,
) -> Result<Departure, FitError> {
    let mut bodies: Vec<usize> = observations
        .iter()
        .flat_map(|observation| observation.bodies.iter().map(|track| track.body))
        .collect();
    bodies.sort_unstable();
    bodies.dedup();
    let quantities: Vec<Quantity> = bodies.into_iter().map(Quantity::MassOfBody).collect();
    let asked = FreedQuantities::of(observations, model, at, &quantities)?;
    let open = || FitError::Undetermined { what: "the tracks", unknowns: "the masses of bodies".into() };
    let inverse = asked.covariance.clone().cholesky().ok_or_else(open)?.inverse();
    let ones = DVector::repeat(quantities.len(), 1.0);
    let common = (&inverse * &ones).dot(&asked.step) / (&inverse * &ones).dot(&ones);
    let about_mean = asked.step.add_scalar(-common);
    let chi_squared = about_mean.dot(&(&inverse * &about_mean));
    let freedom = quantities.len().saturating_sub(1).max(1);
    let n = freedom as f64;
    let variance = (about_mean.norm_squared() - asked.covariance.trace()) / n;
    // The standard error of a variance from n values, over twice the deviation.
    let of_errors = asked.covariance.trace() / n;
    let deviation = variance.max(0.0).sqrt();
    let total = variance.max(0.0) + of_errors;
    let sigma = total * (0.5 / n).sqrt() / deviation.max(total.sqrt() * (0.5 / n).powf(0.25));
    let p_value = chi_squared_beyond(chi_squared, freedom as f64);
    Ok(Departure { size: Estimate::new(deviation, sigma), chi_squared, freedom, p_value })
}

/// Quantities that the fit left at one, as one step from it would move them.
struct FreedQuantities {
    step: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl FreedQuantities {
    fn of(
        observations: &[Observation],
        (model, asked): (&TrackModel, &[Quantity]),
        at: &Unknowns,
        quantities: &[Quantity],
    ) -> Result<Self, FitError> {
        let asked = [asked, quantities].concat();
        let problem = TrackResiduals::new(observations, model, &asked)?;
        let failed = |failure: Failure<FitError>| problem.failure(failure);
        let mut at = at.clone();
        at.shared = at.shared.resize_vertically(problem.n_shared(), 1.0);
        let at = problem.equations(&at)?;
        let system = at.reduced(0.0).ok_or_else(|| failed(Failure::Undetermined(Vec::new())))?.system();
        let covariance = system.covariance().map_err(|open| failed(Failure::Undetermined(open)))?;
        let step = system.step().ok_or_else(|| failed(Failure::Undetermined(Vec::new())))?;
        let (first, n) = (problem.n_shared() - quantities.len(), quantities.len());
        // Residuals that are larger than stated even with these quantities free widen the intervals.
        let left = (at.chi_squared() - system.length2(&step)) / freedom(&problem) as f64;
        Ok(Self {
            step: step.rows(first, n).into_owned(),
            covariance: covariance.view((first, first), (n, n)) * left.max(1.0),
        })
    }
}

/// The quantities without a prior that a fit found.
fn asked_of(fit: &TrackFit) -> Vec<Quantity> {
    fit.found.iter().map(|(quantity, _)| *quantity).collect()
}

fn unknowns_of(fit: &TrackFit) -> Unknowns {
    let damping = &fit.damping;
    let mut shared = vec![damping.chain_damping_kg_per_s.value, damping.striker_damping_kg_per_s.value];
    shared.extend(fit.factors.iter().chain(&fit.found).map(|(_, found)| found.value));
    let own = |one: &FittedRecording| Own::new(one.striker_velocity_m_per_s.value, one.impact_time_s.value);
    Unknowns { shared: DVector::from_vec(shared), own: fit.recordings.iter().map(own).collect() }
}
