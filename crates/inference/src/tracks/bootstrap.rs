//! How the damping scatters over recordings drawn anew.

use chainwave_analysis::probability::student;
use chainwave_measurement::{Estimate, Observation};
use nalgebra::DMatrix;

use crate::damping::N_DAMPINGS;
use crate::least_squares::Reduced;

/// How a quantity scatters over trials drawn anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverTrials {
    /// Its standard deviation.
    pub sigma: f64,
    /// Degrees of freedom of that: few where the recordings of one view say most.
    pub degrees_of_freedom: f64,
    /// The standard deviation of what all trials have in common: what the model's error, and the choice of a model, may do.
    pub in_common: f64,
}

impl OverTrials {
    fn factor_95(&self) -> f64 {
        student(Estimate::COVERAGE_95, self.degrees_of_freedom)
    }

    /// The 95 % interval around a value, by Student's t for the scatter over trials.
    pub fn interval_95(&self, value: f64) -> (f64, f64) {
        let half = Estimate::COVERAGE_95 * self.estimate(value).sigma;
        (value - half, value + half)
    }

    /// The estimate that has that interval.
    pub fn estimate(&self, value: f64) -> Estimate {
        let over_trials = self.factor_95() / Estimate::COVERAGE_95 * self.sigma;
        Estimate::new(value, over_trials.hypot(self.in_common))
    }

    /// With so much more variance in common.
    pub(super) fn widened(self, more: f64) -> Self {
        Self { in_common: self.in_common.hypot(more.sqrt()), ..self }
    }
}

/// How c_d and c_s scatter over experiments whose recordings are drawn with replacement from those of each view; `None` where a view
/// has a single one. The shared unknowns have the given covariance, in units of the residuals' variance.
///
/// A draw only weighs the recordings, and one Gauss-Newton step from the minimum answers it: the sum of what each recording moves, its score times
/// the covariance, with its weight. Of a view's n recordings n - 1 are drawn and weighed n/(n - 1) times, which leaves no bias in the variance (J.
/// N. K. Rao, C. F. J. Wu, J. Am. Stat. Assoc. 83 (1988) 231-241), and that of a sum over all draws is known without drawing: n/(n - 1) times the
/// squares about the view's mean. Views' variances add, and each has n - 1 degrees of freedom (Satterthwaite 1946 for their sum).
pub(super) fn bootstrap(
    observations: &[Observation],
    equations: &Reduced,
    covariance: &DMatrix<f64>,
) -> Option<[OverTrials; N_DAMPINGS]> {
    let views = views(observations);
    if views.iter().any(|view| view.len() < 2) {
        return None;
    }
    let scores = equations.scores();
    Some(std::array::from_fn(|i| {
        let moves = |r: &usize| covariance.column(i).dot(&scores[*r]);
        let of_view = |view: &Vec<usize>| {
            (view.len() as f64 - 1.0, variance(&view.iter().map(moves).collect::<Vec<f64>>()))
        };
        let of_views: Vec<(f64, f64)> = views.iter().map(of_view).collect();
        let sum: f64 = of_views.iter().map(|(_, variance)| variance).sum();
        let squares: f64 =
            of_views.iter().map(|(degrees_of_freedom, variance)| variance.powi(2) / degrees_of_freedom).sum();
        OverTrials { sigma: sum.sqrt(), degrees_of_freedom: sum.powi(2) / squares, in_common: 0.0 }
    }))
}

/// Variance of a sum of values that are drawn anew.
fn variance(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    n / (n - 1.0) * values.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
}

/// The recordings of each view.
fn views(observations: &[Observation]) -> Vec<Vec<usize>> {
    let mut numbers: Vec<u32> = observations.iter().map(|observation| observation.view).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let of = |number: &u32| (0..observations.len()).filter(|r| observations[*r].view == *number).collect();
    numbers.iter().map(of).collect()
}
