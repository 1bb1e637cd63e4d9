use chainwave_measurement::{Estimate, Observation};
use nalgebra::{DMatrix, DVector};

use super::FitError;
use super::arrow::Own;
use super::quantity::Quantity;
use super::search::undetermined;
use super::track_problem::{Problem, State};
use super::tracks::{TrackFit, TrackModel, freedom};
use crate::probability::{chi_squared_beyond, normal_beyond};

/// How far the tracks depart from a simpler model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// What departs, in words of the question's own: a factor or a relative scatter.
    pub size: Estimate,
    /// The test's statistic: chi squared with `freedom` degrees of freedom where the simpler model holds.
    pub chi_squared: f64,
    /// Its degrees of freedom.
    pub freedom: usize,
    /// Probability of so large a statistic under the simpler model.
    pub p_value: f64,
}

/// Whether the contact law softens at all: the factor on its softening (1 as stated, 0 for a spring of the same stiffness), against 0.
///
/// It is one Gauss-Newton step from the fit, all other unknowns moving along, so a spring far from the stated law is told by a
/// statistic that is too large to be exact, and one near it, where the decision is close, by an exact one.
///
/// # Errors
/// [`FitError`] when the tracks do not determine it.
pub fn softening(
    observations: &[Observation],
    model: &TrackModel,
    fit: &TrackFit,
) -> Result<Departure, FitError> {
    let asked = Asked::of(observations, model, fit, &[Quantity::Softening])?;
    let size = Estimate::new(1.0 + asked.step[0], asked.covariance[(0, 0)].sqrt());
    let z = size.value / size.sigma;
    Ok(Departure { size, chi_squared: z * z, freedom: 1, p_value: normal_beyond(z) })
}

/// Whether bodies differ: a factor on each body's mass about their mean, against none. Its size is the standard deviation of the masses
/// beyond what their own errors make of it, relative to the mean.
///
/// A stiffness that scatters from gap to gap shows here too, as it delays the wave as a heavier body does.
///
/// # Errors
/// [`FitError`] when the tracks do not determine it.
pub fn scatter_of_bodies(
    observations: &[Observation],
    model: &TrackModel,
    fit: &TrackFit,
) -> Result<Departure, FitError> {
    let mut bodies: Vec<usize> = observations
        .iter()
        .flat_map(|observation| observation.bodies.iter().map(|track| track.body))
        .collect();
    bodies.sort_unstable();
    bodies.dedup();
    let quantities: Vec<Quantity> = bodies.into_iter().map(Quantity::MassOfBody).collect();
    let asked = Asked::of(observations, model, fit, &quantities)?;
    let inverse = asked.covariance.clone().cholesky().ok_or_else(undetermined)?.inverse();
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
    let p_value = chi_squared_beyond(chi_squared, freedom);
    Ok(Departure { size: Estimate::new(deviation, sigma), chi_squared, freedom, p_value })
}

/// Quantities that the fit left at one, as one step from it would move them.
struct Asked {
    step: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Asked {
    fn of(
        observations: &[Observation],
        model: &TrackModel,
        fit: &TrackFit,
        quantities: &[Quantity],
    ) -> Result<Self, FitError> {
        let problem = Problem::new(observations, model, quantities)?;
        let at = problem.linearise(&state_of(fit, problem.n_shared()), &mut 0)?;
        let recordings = at.eliminated(0.0).ok_or_else(undetermined)?;
        let equations = at.equations(&recordings, |_| 1.0, 0.0);
        let (step, covariance) =
            (equations.step().ok_or_else(undetermined)?, equations.covariance().ok_or_else(undetermined)?);
        let (first, n) = (problem.n_shared() - quantities.len(), quantities.len());
        // Residuals that are larger than stated even with these quantities free widen the intervals.
        let left = (at.chi_squared - equations.length2(&step)) / freedom(&problem) as f64;
        Ok(Self {
            step: step.rows(first, n).into_owned(),
            covariance: covariance.view((first, first), (n, n)) * left.max(1.0),
        })
    }
}

fn state_of(fit: &TrackFit, n_shared: usize) -> State {
    let damping = &fit.damping;
    let mut shared = vec![damping.chain_damping_kg_per_s.value, damping.striker_damping_kg_per_s.value];
    shared.extend(fit.factors.iter().map(|(_, factor)| factor.value));
    shared.resize(n_shared, 1.0);
    let own =
        |one: &super::FittedRecording| Own::new(one.striker_velocity_m_per_s.value, one.impact_time_s.value);
    State { shared: DVector::from_vec(shared), own: fit.recordings.iter().map(own).collect() }
}
