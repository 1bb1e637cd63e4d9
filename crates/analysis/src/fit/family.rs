use chainwave_measurement::{Moment, Trajectory};
use chainwave_mechanics::{Chain, Drive, MechanicsError, Schedule, Striker, scan};

/// Nodes in the striker's velocity. Between them the motion is a polynomial of fourth degree; its error on the
/// paper's chain is below 1 nm where strikers differ by up to 5 % from their mean, and 15 nm at 10 %.
pub(super) const N_NODES: usize = 5;

/// The motions that a chain makes at any striker velocity within a range: solved at a few, interpolated between them.
///
/// Trials of an experiment differ in their striker by some per cent, and the chain's response is smooth in it, so a handful
/// of simulations stands for those of all recordings, and gives the derivative as well.
pub(super) struct Family {
    velocities_m_per_s: Vec<f64>,
    motions: Vec<Trajectory>,
}

/// How the motions of a family add up to that at one striker velocity, or to its derivative.
pub(super) type Weights = Vec<f64>;

impl Family {
    /// Solves the chain at `n_nodes` Chebyshev nodes of the range `lowest..=highest` of striker velocities in metres per second.
    pub(super) fn new(
        chain: &Chain,
        striker: &Striker,
        [lowest, highest]: [f64; 2],
        schedule: &Schedule,
        n_nodes: usize,
    ) -> Result<Self, MechanicsError> {
        let velocities_m_per_s = chebyshev_nodes(lowest, highest, n_nodes);
        let struck = Chain { drive: Drive::Striker(*striker), ..chain.clone() };
        let members = scan(&struck, &velocities_m_per_s, schedule, 1)?;
        let motions = members.into_iter().map(|member| Ok(member?.trajectory));
        Ok(Self { velocities_m_per_s, motions: motions.collect::<Result<_, MechanicsError>>()? })
    }

    /// Number of simulations behind it.
    pub(super) fn n_simulations(&self) -> u64 {
        self.motions.len() as u64
    }

    /// Weights of the motion at a striker velocity, and of its derivative by it.
    pub(super) fn weights(&self, velocity_m_per_s: f64) -> (Weights, Weights) {
        lagrange(&self.velocities_m_per_s, velocity_m_per_s).into_iter().unzip()
    }

    /// The moment of a time after the impact; `None` beyond the simulations' end.
    pub(super) fn moment(&self, since_impact_s: f64) -> Option<Moment<'_>> {
        self.motions.first()?.at(since_impact_s)
    }

    /// Displacement of a body at a moment (of any family with the same schedule), in metres.
    pub(super) fn displacement_m(&self, weights: &Weights, moment: &Moment<'_>, row: usize) -> f64 {
        let pairs = weights.iter().zip(&self.motions);
        pairs.map(|(weight, motion)| weight * moment.of(motion).displacement_m(row)).sum()
    }

    /// The same of its velocity, in metres per second.
    pub(super) fn velocity_m_per_s(&self, weights: &Weights, moment: &Moment<'_>, row: usize) -> f64 {
        let pairs = weights.iter().zip(&self.motions);
        pairs.map(|(weight, motion)| weight * moment.of(motion).velocity_m_per_s(row)).sum()
    }
}

fn chebyshev_nodes(lowest: f64, highest: f64, n_nodes: usize) -> Vec<f64> {
    let node = |k: usize| {
        let angle = std::f64::consts::PI * (k as f64 + 0.5) / n_nodes as f64;
        0.5 * (lowest + highest) - 0.5 * (highest - lowest) * angle.cos()
    };
    (0..n_nodes).map(node).collect()
}

/// Lagrange's polynomial of each node at `x`, and its derivative there.
fn lagrange(nodes: &[f64], x: f64) -> Vec<(f64, f64)> {
    let polynomial = |k: usize| {
        let others = (0..nodes.len()).filter(move |j| *j != k);
        others.fold((1.0, 0.0), |(value, slope), j| {
            let (width, factor) = (nodes[k] - nodes[j], (x - nodes[j]) / (nodes[k] - nodes[j]));
            (value * factor, slope * factor + value / width)
        })
    };
    (0..nodes.len()).map(polynomial).collect()
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::{FarEnd, PowerLaw, simulate};

    use super::*;

    #[test]
    fn between_the_nodes_the_motion_is_that_of_a_simulation() {
        let striker = Striker { mass_kg: 4.3e-3, velocity_m_per_s: 2.73, damping_kg_per_s: 0.2 };
        let chain = Chain {
            mass_kg: vec![0.455e-3; 26],
            damping_kg_per_s: vec![0.003; 26],
            contact: PowerLaw::new(60.1, 2.27e-3, 0.114).unwrap().into(),
            drive: Drive::Striker(striker),
            far_end: FarEnd::Free,
        };
        let schedule = Schedule::automatic(0.02, 1e-4);
        let family = Family::new(&chain, &striker, [2.6, 2.87], &schedule, N_NODES).unwrap();
        for velocity_m_per_s in [2.61, 2.75, 2.86] {
            let drive = Drive::Striker(Striker { velocity_m_per_s, ..striker });
            let direct = simulate(&Chain { drive, ..chain.clone() }, &schedule).unwrap().trajectory;
            let (weights, slopes) = family.weights(velocity_m_per_s);
            let (ahead, behind) =
                (family.weights(velocity_m_per_s + 1e-4).0, family.weights(velocity_m_per_s - 1e-4).0);
            for (k, time_s) in direct.times_s.iter().enumerate() {
                let moment = family.moment(*time_s).unwrap();
                for row in 0..26 {
                    let error_m =
                        family.displacement_m(&weights, &moment, row) - direct.displacement_m[(row, k)];
                    // A four-hundredth of the noise of one reading (0.4 um).
                    assert!(error_m.abs() < 1e-9, "{velocity_m_per_s} m/s: {error_m} m");
                    let at = |weights| family.displacement_m(weights, &moment, row);
                    let slope = (at(&ahead) - at(&behind)) / 2e-4;
                    // The polynomial's own derivative: its third derivative times 1e-8 / 6, and rounding.
                    assert!((at(&slopes) - slope).abs() < 1e-9);
                }
            }
        }
    }
}
