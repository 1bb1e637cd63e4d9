//! How large the errors are that a fit takes as usual ones.

use chainwave_measurement::Estimate;
use nalgebra::{DMatrix, DVector};

use super::residuals::TrackResiduals;
use crate::least_squares::{NormalEquations, Reduced};

/// Standard deviations beyond which an amplitude is told: once in eighty by chance.
const TOLD: f64 = 2.5;

/// Amplitudes of a model's usual errors, in their standard deviations and order, as the tracks and these tell them together.
#[derive(Debug, Clone, PartialEq)]
pub struct UsualAmplitudes {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl UsualAmplitudes {
    /// At a minimum whose shared unknowns have the given covariance. An error that no reading has is as open as it was.
    pub(super) fn of(
        problem: &TrackResiduals<'_>,
        equations: &NormalEquations,
        (reduced, shared): (&Reduced, &DMatrix<f64>),
    ) -> Self {
        let (amplitudes, covariances) = (equations.amplitudes(), reduced.amplitude_covariances(shared));
        let usual = problem.usual_errors();
        let value = |i: usize| usual[i].map_or(0.0, |(tie, error)| amplitudes[tie][error]);
        let covariance = |i: usize, j: usize| match (usual[i], usual[j]) {
            (Some((tie, error)), Some((same, other))) if tie == same => covariances[tie][(error, other)],
            _ => f64::from(u8::from(i == j)),
        };
        let n = usual.len();
        Self { values: DVector::from_fn(n, |i, _| value(i)), covariance: DMatrix::from_fn(n, n, covariance) }
    }

    /// How much larger they are than others, which may be none.
    pub(super) fn less(&self, others: &Self) -> DVector<f64> {
        let value = |of: &Self, i: usize| of.values.get(i).copied().unwrap_or(0.0);
        DVector::from_fn(others.values.len(), |i, _| value(self, i) - value(others, i))
    }

    /// The logarithm of how many times smaller the tracks leave the square of the volume in which they may be than it was: minus that of the covariance's determinant, their
    /// variances having been one.
    pub(super) fn narrowing(&self) -> f64 {
        match self.covariance.clone().cholesky() {
            Some(factor) => -2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>(),
            None => 0.0,
        }
    }

    /// Whether one of them is told.
    pub fn are_told(&self) -> bool {
        self.estimates().any(Self::is_told)
    }

    /// Whether readings without the error would seldom show this amplitude: of a prior of unit variance, an estimate that is uncertain by s scatters
    /// about zero by s sqrt(1 - s^2).
    pub fn is_told(amplitude: Estimate) -> bool {
        let by_chance = amplitude.sigma * (1.0 - amplitude.sigma.powi(2)).max(0.0).sqrt();
        amplitude.value.abs() > TOLD * by_chance
    }

    /// Each amplitude with its standard uncertainty.
    pub fn estimates(&self) -> impl Iterator<Item = Estimate> {
        (0..self.values.len()).map(|i| Estimate::new(self.values[i], self.covariance[(i, i)].sqrt()))
    }

    /// The amplitudes among all that the problem's ties have, tie by tie, the others zero.
    pub(super) fn among_ties(&self, problem: &TrackResiduals<'_>) -> Vec<DVector<f64>> {
        placed_among_ties(problem, &self.values)
    }
}

/// Numbers of a model's usual errors, in their order, among those of all errors that the problem's ties have, tie by tie, the others zero.
pub(super) fn placed_among_ties(problem: &TrackResiduals<'_>, of_usual: &DVector<f64>) -> Vec<DVector<f64>> {
    let mut of_ties: Vec<DVector<f64>> = problem.ties().map(DVector::zeros).collect();
    for (place, value) in problem.usual_errors().iter().zip(of_usual) {
        if let Some((tie, error)) = place {
            of_ties[*tie][*error] = *value;
        }
    }
    of_ties
}
