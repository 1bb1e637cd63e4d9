//! Motions at any striker velocity as sums of a few simulated ones.

use chainwave_mechanics::{Chain, Drive, Striker};

/// Nodes in the striker's velocity. Between them the motion is a polynomial of fourth degree; its error on the
/// paper's chain is below 1 nm where strikers differ by up to 5 % from their mean, and 15 nm at 10 %.
pub(super) const N_NODES: usize = 5;

/// The nodes at which its derivatives by the shared unknowns are solved too: between them these are parabolas. What that leaves of them, some
/// millionths on the paper's chain with strikers that differ by 5 %, changes a minimum by as small a part of its standard error.
pub(super) const DERIVATIVE_NODES: [usize; N_DERIVATIVE_NODES] = [0, 2, 4];

/// Number of these.
pub(super) const N_DERIVATIVE_NODES: usize = 3;

/// Striker velocities at which a chain is solved, so that the motion at any velocity between them is a sum of these motions.
///
/// Trials of an experiment differ in their striker by some per cent, and the chain's response is smooth in it, so a handful
/// of simulations stands for those of all recordings, and gives the derivative as well.
#[derive(Debug, Clone)]
pub(super) struct Family {
    nodes_m_per_s: [f64; N_NODES],
}

/// A chain and what strikes it, at some values of the shared unknowns. Of one that is let go the striker is none, and what takes the place of its velocity is
/// the state over the stated one.
#[derive(Debug, Clone)]
pub(super) struct Struck {
    pub(super) chain: Chain,
    pub(super) striker: Striker,
}

/// How the motions of a family add up to that at one striker velocity, or to its derivative.
pub(super) type Weights = [f64; N_NODES];

impl Family {
    /// Chebyshev nodes of the range `lowest..=highest` of striker velocities in metres per second.
    pub(super) fn new([lowest, highest]: [f64; 2]) -> Self {
        let node = |k: usize| {
            let angle = std::f64::consts::PI * (k as f64 + 0.5) / N_NODES as f64;
            0.5 * (lowest + highest) - 0.5 * (highest - lowest) * angle.cos()
        };
        Self { nodes_m_per_s: std::array::from_fn(node) }
    }

    /// Number of nodes.
    pub(super) fn n_nodes(&self) -> usize {
        self.nodes_m_per_s.len()
    }

    /// The chain, struck at the velocity of a node, or let go from as much of its state.
    pub(super) fn struck(&self, node: usize, Struck { chain, striker }: &Struck) -> Chain {
        let drive = match &chain.drive {
            let_go @ Drive::Free { .. } => let_go.clone(),
            Drive::Striker(_) | Drive::Imposed(_) => Drive::Striker(*striker),
        };
        Chain { drive: drive.with_strength(self.nodes_m_per_s[node]), ..chain.clone() }
    }

    /// Weights of the motion at a striker velocity, and of its derivative by it.
    pub(super) fn weights(&self, velocity_m_per_s: f64) -> (Weights, Weights) {
        let both = polynomials(self.nodes_m_per_s, velocity_m_per_s);
        (both.map(|(value, _)| value), both.map(|(_, slope)| slope))
    }

    /// Weights of the derivatives by the shared unknowns, of which there are fewer nodes.
    pub(super) fn weights_of_derivatives(&self, velocity_m_per_s: f64) -> [f64; N_DERIVATIVE_NODES] {
        let nodes_m_per_s = DERIVATIVE_NODES.map(|node| self.nodes_m_per_s[node]);
        polynomials(nodes_m_per_s, velocity_m_per_s).map(|(value, _)| value)
    }
}

/// Lagrange's polynomials of some nodes at a place, and their derivatives.
fn polynomials<const N: usize>(nodes: [f64; N], at: f64) -> [(f64, f64); N] {
    std::array::from_fn(|k| {
        let others = (0..N).filter(|j| *j != k);
        others.fold((1.0, 0.0), |(value, slope), j| {
            let (width, factor) = (nodes[k] - nodes[j], (at - nodes[j]) / (nodes[k] - nodes[j]));
            (value * factor, slope * factor + value / width)
        })
    })
}

#[cfg(test)]
mod tests {
    use std::num::NonZero;

    use chainwave_mechanics::{Schedule, ensemble, simulate};

    use super::*;

    #[test]
    fn between_the_nodes_the_motion_is_that_of_a_simulation() {
        let (chain, striker) = (Chain::of_rings(26), Striker::OF_RINGS);
        let schedule = Schedule::automatic(0.02, 1e-4);
        let family = Family::new([2.6, 2.87]);
        let struck = Struck { chain: chain.clone(), striker };
        let struck: Vec<Chain> = (0..family.n_nodes()).map(|node| family.struck(node, &struck)).collect();
        let displacement_m =
            |_: usize, simulation: chainwave_mechanics::Simulation| simulation.trajectory.displacement_m;
        let motions = ensemble(&struck, &schedule, NonZero::<usize>::MIN, displacement_m);
        let sum = |weights: &Weights| {
            let parts =
                weights.iter().zip(&motions).map(|(weight, motion)| motion.as_ref().unwrap() * *weight);
            parts.reduce(|sum, part| sum + part).unwrap()
        };
        for velocity_m_per_s in [2.61, 2.75, 2.86] {
            let drive = Drive::Striker(Striker { velocity_m_per_s, ..striker });
            let direct = simulate(&Chain { drive, ..chain.clone() }, &schedule).unwrap().trajectory;
            let (weights, slopes) = family.weights(velocity_m_per_s);
            // A four-hundredth of the noise of one reading (0.4 um).
            assert!((sum(&weights) - &direct.displacement_m).iter().all(|error_m| error_m.abs() < 1e-9));
            // At the fewer nodes of derivatives a parabola goes through -0.951, 0 and 0.951 of half the range, h = 0.135 m/s. Its remainder is at
            // most 0.331 h^3 / 6 times the third derivative, about the motion over the cube of the drive: 6.7e-6 of it.
            let of_few = family.weights_of_derivatives(velocity_m_per_s);
            let parts = DERIVATIVE_NODES.into_iter().zip(of_few);
            let parts = parts.map(|(node, weight)| motions[node].as_ref().unwrap() * weight);
            let parabola = parts.reduce(|sum, part| sum + part).unwrap();
            let largest_m = direct.displacement_m.iter().fold(0.0_f64, |largest, x_m| largest.max(x_m.abs()));
            let error_m = (parabola - &direct.displacement_m).iter().fold(0.0_f64, |m, e| m.max(e.abs()));
            assert!(error_m < 6.7e-6 * largest_m, "{error_m} of {largest_m}");
            let beside = [1e-4, -1e-4].map(|step| sum(&family.weights(velocity_m_per_s + step).0));
            let difference = (&beside[0] - &beside[1]) / 2e-4;
            // The polynomial's own derivative: its third derivative times 1e-8 / 6, and rounding.
            assert!((sum(&slopes) - difference).iter().all(|error| error.abs() < 1e-9));
        }
    }
}
