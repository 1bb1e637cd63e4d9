use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Chain, Drive, MechanicsError, Schedule, Striker, simulate};
use ndarray::Array2;

/// Nodes in the striker's velocity. Between them the motion is a polynomial of fourth degree; its error on the
/// paper's chain is below 1 nm where strikers differ by up to 5 % from their mean, and 15 nm at 10 %.
const N_NODES: usize = 5;

/// The motions that a chain makes at any striker velocity within a range: solved at a few, interpolated between them.
///
/// Trials of an experiment differ in their striker by some per cent, and the chain's response is smooth in it, so a handful
/// of simulations stands for those of all recordings, and gives the derivative as well.
pub(super) struct Family {
    velocities_m_per_s: [f64; N_NODES],
    motions: Vec<Trajectory>,
}

impl Family {
    /// Solves the chain at the Chebyshev nodes of the range `lowest..=highest` of striker velocities in metres per second.
    pub(super) fn new(
        chain: &Chain,
        striker: &Striker,
        [lowest, highest]: [f64; 2],
        schedule: &Schedule,
    ) -> Result<Self, MechanicsError> {
        let velocities_m_per_s = chebyshev_nodes(lowest, highest);
        let motion = |velocity_m_per_s: &f64| {
            let drive = Drive::Striker(Striker { velocity_m_per_s: *velocity_m_per_s, ..*striker });
            Ok(simulate(&Chain { drive, ..chain.clone() }, schedule)?.trajectory)
        };
        let motions = velocities_m_per_s.iter().map(motion).collect::<Result<_, MechanicsError>>()?;
        Ok(Self { velocities_m_per_s, motions })
    }

    /// Number of simulations behind it.
    pub(super) const fn n_simulations() -> u64 {
        N_NODES as u64
    }

    /// The motion at a striker velocity.
    pub(super) fn at(&self, velocity_m_per_s: f64) -> Trajectory {
        self.combined(lagrange(&self.velocities_m_per_s, velocity_m_per_s).map(|(value, _)| value))
    }

    /// Its derivative by the striker velocity.
    pub(super) fn slope_at(&self, velocity_m_per_s: f64) -> Trajectory {
        self.combined(lagrange(&self.velocities_m_per_s, velocity_m_per_s).map(|(_, slope)| slope))
    }

    fn combined(&self, weights: [f64; N_NODES]) -> Trajectory {
        let shape = self.motions[0].displacement_m.dim();
        let mut sum = Trajectory {
            times_s: self.motions[0].times_s.clone(),
            displacement_m: Array2::zeros(shape),
            velocity_m_per_s: Array2::zeros(shape),
        };
        for (weight, motion) in weights.into_iter().zip(&self.motions) {
            sum.displacement_m.scaled_add(weight, &motion.displacement_m);
            sum.velocity_m_per_s.scaled_add(weight, &motion.velocity_m_per_s);
        }
        sum
    }
}

fn chebyshev_nodes(lowest: f64, highest: f64) -> [f64; N_NODES] {
    std::array::from_fn(|k| {
        let angle = std::f64::consts::PI * (k as f64 + 0.5) / N_NODES as f64;
        0.5 * (lowest + highest) - 0.5 * (highest - lowest) * angle.cos()
    })
}

/// Lagrange's polynomial of each node at `x`, and its derivative there.
fn lagrange(nodes: &[f64; N_NODES], x: f64) -> [(f64, f64); N_NODES] {
    std::array::from_fn(|k| {
        let others = || (0..N_NODES).filter(move |j| *j != k);
        others().fold((1.0, 0.0), |(value, slope), j| {
            let (width, factor) = (nodes[k] - nodes[j], (x - nodes[j]) / (nodes[k] - nodes[j]));
            (value * factor, slope * factor + value / width)
        })
    })
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::{FarEnd, PowerLaw};

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
        let family = Family::new(&chain, &striker, [2.6, 2.87], &schedule).unwrap();
        for velocity_m_per_s in [2.61, 2.75, 2.86] {
            let drive = Drive::Striker(Striker { velocity_m_per_s, ..striker });
            let direct = simulate(&Chain { drive, ..chain.clone() }, &schedule).unwrap().trajectory;
            let difference = family.at(velocity_m_per_s).displacement_m - &direct.displacement_m;
            let largest_m = difference.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
            // A four-hundredth of the noise of one reading (0.4 um).
            assert!(largest_m < 1e-9, "{velocity_m_per_s} m/s: {largest_m} m");
            let (ahead, behind) = (family.at(velocity_m_per_s + 1e-4), family.at(velocity_m_per_s - 1e-4));
            let slope = (ahead.displacement_m - behind.displacement_m) / 2e-4;
            let error = family.slope_at(velocity_m_per_s).displacement_m - slope;
            // The polynomial's own derivative: its third derivative times 1e-8 / 6, and rounding.
            assert!(error.iter().all(|error| error.abs() < 1e-9));
        }
    }
}
