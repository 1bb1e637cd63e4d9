use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Chain, Drive, Schedule, Simulation, Striker, simulate};
use ndarray::Array2;

use super::{EnergyModel, FitError, Quantity};

/// What the fit varies.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parameters {
    pub(super) chain_damping_kg_per_s: f64,
    pub(super) striker_damping_kg_per_s: f64,
    pub(super) striker_velocity_m_per_s: f64,
    /// Factor on the deviations of the recordings' drives.
    pub(super) drive_scale: f64,
    /// Factors on the model's quantities that are known within an uncertainty.
    pub(super) factors: Vec<f64>,
}

/// The model's answer: the weighted mean of its runs at a slower and a faster drive, as the pictures show it.
pub(super) struct Prediction {
    runs: Vec<(f64, Simulation)>,
    /// Length in the pictures over true length.
    picture_scale: f64,
}

impl Prediction {
    pub(super) fn new(
        model: &EnergyModel,
        parameters: &Parameters,
        duration_s: f64,
        output_interval_s: f64,
    ) -> Result<Self, FitError> {
        let schedule = Schedule::automatic(duration_s, output_interval_s);
        let run = |(weight, deviation): (f64, f64)| -> Result<(f64, Simulation), FitError> {
            let faster = 1.0 + parameters.drive_scale * deviation;
            let velocity_m_per_s = parameters.striker_velocity_m_per_s * faster;
            let chain = with_parameters(model, parameters, velocity_m_per_s).ok_or(FitError::NoStriker)?;
            Ok((weight, simulate(&chain, &schedule)?))
        };
        let runs = quadrature(&model.drive_deviations).into_iter().map(run).collect::<Result<_, _>>()?;
        let known = model.known.iter().zip(&parameters.factors);
        let of_scale = known.filter(|(known, _)| known.quantity == Quantity::Scale);
        Ok(Self { runs, picture_scale: of_scale.map(|(_, factor)| factor).product() })
    }

    /// Number of simulations behind the prediction.
    pub(super) fn n_simulations(&self) -> u64 {
        self.runs.len() as u64
    }

    /// Peak potential energy of a gap (from 1), in joules.
    pub(super) fn psi_max_j(&self, gap: usize) -> f64 {
        self.runs.iter().filter_map(|(weight, run)| Some(weight * run.psi_max_j.get(gap - 1)?)).sum()
    }

    /// Motion at times after the impact, at rest before it.
    pub(super) fn trajectory(&self, times_s: &[f64]) -> Trajectory {
        let n_bodies = self.runs.first().map_or(0, |(_, run)| run.trajectory.displacement_m.nrows());
        let mut moved = Trajectory {
            times_s: times_s.to_vec(),
            displacement_m: Array2::zeros((n_bodies, times_s.len())),
            velocity_m_per_s: Array2::zeros((n_bodies, times_s.len())),
        };
        for (weight, run) in &self.runs {
            for (i, time_s) in times_s.iter().enumerate() {
                let Some(moment) = run.trajectory.at(*time_s) else { continue };
                for body in 0..n_bodies {
                    let share = weight * self.picture_scale;
                    moved.displacement_m[(body, i)] += share * moment.displacement_m(body);
                    moved.velocity_m_per_s[(body, i)] += share * moment.velocity_m_per_s(body);
                }
            }
        }
        moved
    }
}

/// Weights and nodes of the two-point Gauss quadrature whose mean, mean square and mean cube are those of the deviations from
/// their mean; one node where they do not scatter.
pub(super) fn quadrature(deviations: &[f64]) -> Vec<(f64, f64)> {
    let n = deviations.len().max(1) as f64;
    let mean = deviations.iter().sum::<f64>() / n;
    let moment =
        |power: i32| deviations.iter().map(|deviation| (deviation - mean).powi(power)).sum::<f64>() / n;
    let sigma = moment(2).sqrt();
    if sigma < 1e-12 {
        return vec![(1.0, mean)];
    }
    let skewness = moment(3) / sigma.powi(3);
    let root = (skewness * skewness + 4.0).sqrt();
    let (low, high) = (0.5 * (skewness - root), 0.5 * (skewness + root));
    vec![(high / root, mean + sigma * low), (-low / root, mean + sigma * high)]
}

/// The chain with trial values in place; negative dampings are mirrored, so the search may step across zero.
fn with_parameters(model: &EnergyModel, parameters: &Parameters, velocity_m_per_s: f64) -> Option<Chain> {
    let Drive::Striker(striker) = &model.chain.drive else { return None };
    let n_bodies = model.chain.n_bodies();
    let damping_kg_per_s = vec![parameters.chain_damping_kg_per_s.abs(); n_bodies];
    let mut chain = Chain { damping_kg_per_s, ..model.chain.clone() };
    let damping_kg_per_s = parameters.striker_damping_kg_per_s.abs();
    let mut striker = Striker { velocity_m_per_s, damping_kg_per_s, ..*striker };
    for (known, factor) in model.known.iter().zip(&parameters.factors) {
        known.quantity.apply(*factor, &mut chain, &mut striker);
    }
    Some(Chain { drive: Drive::Striker(striker), ..chain })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quadrature_has_the_first_three_moments() {
        let deviations = [0.01, -0.02, 0.03, 0.0, -0.005];
        let nodes = quadrature(&deviations);
        for power in 0..=3 {
            let wanted = deviations.iter().map(|x: &f64| (x - 0.003).powi(power)).sum::<f64>() / 5.0;
            let found: f64 = nodes.iter().map(|(weight, x)| weight * (x - 0.003).powi(power)).sum();
            // Rounding of terms of at most 1.
            assert!((found - wanted).abs() < 1e-15, "moment {power}");
        }
        assert_eq!(quadrature(&[0.0, 0.0]), vec![(1.0, 0.0)]);
    }
}
