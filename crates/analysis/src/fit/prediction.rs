use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Chain, Drive, MechanicsError, Schedule, Simulation, Striker, simulate};
use ndarray::Array2;

use super::{DampingModel, FitError};

/// What the fit varies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Parameters {
    pub(super) chain_damping_kg_per_s: f64,
    pub(super) striker_damping_kg_per_s: f64,
    pub(super) striker_velocity_m_per_s: f64,
    pub(super) impact_time_s: f64,
}

/// The model's answer: the mean of its runs at a slower and a faster drive.
pub(super) struct Prediction {
    runs: Vec<Simulation>,
    interval_s: f64,
}

impl Prediction {
    pub(super) fn new(
        model: &DampingModel,
        parameters: &Parameters,
        duration_s: f64,
        output_interval_s: f64,
    ) -> Result<Self, FitError> {
        let drives: &[f64] = if model.drive_scatter > 0.0 { &[-1.0, 1.0] } else { &[0.0] };
        let schedule = Schedule { duration_s, output_interval_s, dt_s: None };
        let run = |sign: &f64| -> Result<Simulation, FitError> {
            let velocity_m_per_s = parameters.striker_velocity_m_per_s * (1.0 + sign * model.drive_scatter);
            let chain =
                with_parameters(&model.chain, parameters, velocity_m_per_s).ok_or(FitError::NoStriker)?;
            simulate(&chain, &schedule).map_err(|error: MechanicsError| FitError::Model(error))
        };
        Ok(Self { runs: drives.iter().map(run).collect::<Result<_, _>>()?, interval_s: output_interval_s })
    }

    /// Number of simulations behind the prediction.
    pub(super) fn n_simulations(&self) -> u64 {
        self.runs.len() as u64
    }

    /// Peak potential energy of a gap (from 1), in joules.
    pub(super) fn psi_max_j(&self, gap: usize) -> f64 {
        let sum: f64 = self.runs.iter().filter_map(|run| run.psi_max_j.get(gap - 1)).sum();
        sum / self.runs.len() as f64
    }

    /// Displacements at times after the trigger, shape `[body, time]`.
    pub(super) fn displacement_m(&self, times_s: &[f64], impact_time_s: f64) -> Array2<f64> {
        self.trajectory(times_s, impact_time_s).displacement_m
    }

    /// Motion at times after the trigger: cubic Hermite interpolation between outputs, at rest before the impact.
    pub(super) fn trajectory(&self, times_s: &[f64], impact_time_s: f64) -> Trajectory {
        let n_bodies = self.runs.first().map_or(0, |run| run.trajectory.displacement_m.nrows());
        let mut moved = Trajectory {
            times_s: times_s.to_vec(),
            displacement_m: Array2::zeros((n_bodies, times_s.len())),
            velocity_m_per_s: Array2::zeros((n_bodies, times_s.len())),
        };
        let share = 1.0 / self.runs.len() as f64;
        for run in &self.runs {
            for (i, time_s) in times_s.iter().enumerate() {
                let since_impact_s = time_s - impact_time_s;
                if since_impact_s <= 0.0 {
                    continue;
                }
                for body in 0..n_bodies {
                    let (x, v) = hermite(&run.trajectory, body, since_impact_s, self.interval_s);
                    moved.displacement_m[(body, i)] += share * x;
                    moved.velocity_m_per_s[(body, i)] += share * v;
                }
            }
        }
        moved
    }
}

/// The chain with trial values in place; negative dampings are mirrored, so the search may step across zero.
fn with_parameters(chain: &Chain, parameters: &Parameters, velocity_m_per_s: f64) -> Option<Chain> {
    let Drive::Striker(striker) = &chain.drive else { return None };
    let damping_kg_per_s = parameters.striker_damping_kg_per_s.abs();
    Some(Chain {
        damping_kg_per_s: vec![parameters.chain_damping_kg_per_s.abs(); chain.n_bodies()],
        drive: Drive::Striker(Striker { velocity_m_per_s, damping_kg_per_s, ..*striker }),
        ..chain.clone()
    })
}

/// Displacement and velocity of a body between two outputs.
fn hermite(trajectory: &Trajectory, body: usize, time_s: f64, interval_s: f64) -> (f64, f64) {
    let last = trajectory.times_s.len() - 1;
    let left = ((time_s / interval_s) as usize).min(last.saturating_sub(1));
    let right = (left + 1).min(last);
    let u = time_s / interval_s - left as f64;
    let (x0, x1) = (trajectory.displacement_m[(body, left)], trajectory.displacement_m[(body, right)]);
    let v0 = trajectory.velocity_m_per_s[(body, left)] * interval_s;
    let v1 = trajectory.velocity_m_per_s[(body, right)] * interval_s;
    let (cubic, square) = (2.0 * (x0 - x1) + v0 + v1, 3.0 * (x1 - x0) - 2.0 * v0 - v1);
    let x = x0 + u * (v0 + u * (square + u * cubic));
    let v = (v0 + u * (2.0 * square + 3.0 * u * cubic)) / interval_s;
    (x, v)
}
