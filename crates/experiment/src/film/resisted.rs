//! A chain that friction and drag resist: a plain march of its own, which shares nothing with the solver that fits use.

use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Chain, Drive, FarEnd, Resistance, Striker};
use ndarray::Array2;

use crate::error::Error;

/// Steps of the classical Runge-Kutta method between two outputs, which lie a hundredth of the chain's shortest period apart or closer.
const STEPS_PER_OUTPUT: usize = 10;
/// Below this speed friction is proportional to it, which stands for holding: in 10 ms a body creeps by less than 0.03 um.
const HELD_M_PER_S: f64 = 3e-6;

/// The motion of a struck chain whose bodies are all resisted alike, and whose striker may be, sampled every `interval_s`.
///
/// # Errors
/// A chain that no striker drives.
pub(super) fn resisted(
    chain: &Chain,
    resistance: Resistance,
    duration_s: f64,
    interval_s: f64,
) -> Result<Trajectory, Error> {
    let Drive::Striker(striker) = &chain.drive else {
        return Err(Error::Value(
            "[synthetic.chain] friction_n, drag_kg_per_m, striker_friction_n: expected a chain that a striker drives".into(),
        ));
    };
    let row = Row {
        chain,
        resistance,
        mass_kg: [vec![striker.mass_kg], chain.mass_kg.clone()].concat(),
        striker: *striker,
    };
    let n = row.mass_kg.len();
    let n_outputs = (duration_s / interval_s).ceil() as usize + 1;
    let step_s = interval_s / STEPS_PER_OUTPUT as f64;
    let mut state = vec![0.0; 2 * n];
    state[n] = striker.velocity_m_per_s;
    let shape = (n - 1, n_outputs);
    let (mut displacement_m, mut velocity_m_per_s) = (Array2::zeros(shape), Array2::zeros(shape));
    let mut rates = vec![vec![0.0; 2 * n]; 4];
    let mut trial = state.clone();
    for k in 0..n_outputs {
        for body in 0..n - 1 {
            displacement_m[(body, k)] = state[body + 1];
            velocity_m_per_s[(body, k)] = state[n + body + 1];
        }
        for _ in 0..STEPS_PER_OUTPUT {
            for (stage, part) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
                for i in 0..2 * n {
                    let before = if stage == 0 { 0.0 } else { rates[stage - 1][i] };
                    trial[i] = state[i] + part * step_s * before;
                }
                row.rates(&trial, &mut rates[stage]);
            }
            for (i, value) in state.iter_mut().enumerate() {
                *value += step_s / 6.0 * (rates[0][i] + 2.0 * (rates[1][i] + rates[2][i]) + rates[3][i]);
            }
        }
    }
    let times_s = (0..n_outputs).map(|k| k as f64 * interval_s).collect();
    Ok(Trajectory { times_s, displacement_m, velocity_m_per_s })
}

/// Striker and bodies, one behind the other.
struct Row<'a> {
    chain: &'a Chain,
    resistance: Resistance,
    mass_kg: Vec<f64>,
    striker: Striker,
}

impl Row<'_> {
    /// Velocities and accelerations of a state, both kinds one after the other.
    fn rates(&self, state: &[f64], rates: &mut [f64]) {
        let n = self.mass_kg.len();
        let (x_m, v_m_per_s) = state.split_at(n);
        let mut before_n = 0.0;
        for mass in 0..n {
            let is_last = mass + 1 == n;
            let (next_m, next_m_per_s) =
                if is_last { (0.0, 0.0) } else { (x_m[mass + 1], v_m_per_s[mass + 1]) };
            let (overlap_m, closing) = (x_m[mass] - next_m, v_m_per_s[mass] - next_m_per_s);
            let behind_n = match mass {
                0 if overlap_m < 0.0 => 0.0,
                0 => {
                    let spring_n = self.chain.contact.of_striker().force_and_energy(overlap_m).0;
                    (spring_n + self.striker.damping_kg_per_s * closing).max(0.0)
                }
                _ if is_last && self.chain.far_end == FarEnd::Free => 0.0,
                _ => {
                    let contact = self.chain.contact.of_gap(mass - 1);
                    contact.force_and_energy(overlap_m).0 + contact.damping_kg_per_s * closing
                }
            };
            let v = v_m_per_s[mass];
            let sense = (v / HELD_M_PER_S).tanh();
            let held_n = match mass.checked_sub(1) {
                None => self.striker.ground_damping_kg_per_s * v + self.resistance.striker_friction_n * sense,
                Some(body) => {
                    self.chain.damping_kg_per_s[body] * v
                        + self.resistance.friction_n * sense
                        + self.resistance.drag_kg_per_m * v * v.abs()
                        + self.chain.ground_stiffness_n_per_m.get(body).map_or(0.0, |k| k * x_m[mass])
                        + self.chain.ground_law.as_ref().map_or(0.0, |law| law.force_n(x_m[mass]))
                }
            };
            rates[mass] = v_m_per_s[mass];
            rates[n + mass] = (before_n - behind_n - held_n) / self.mass_kg[mass];
            before_n = behind_n;
        }
    }
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::{PowerLaw, Schedule, simulate, simulate_with_resistance};

    use super::*;

    fn chain() -> Chain {
        Chain { far_end: FarEnd::Fixed, ..Chain::of_rings(6) }
    }

    #[test]
    fn without_resistance_it_is_the_chain_that_the_library_solves() {
        let held = Chain { ground_stiffness_n_per_m: vec![200.0; 6], ..chain() };
        let mut slowed = chain();
        if let Drive::Striker(striker) = &mut slowed.drive {
            striker.ground_damping_kg_per_s = 0.02;
        }
        for chain in [chain(), held, slowed] {
            agrees_with_the_library(&chain);
        }
    }

    #[test]
    fn a_striker_that_is_rubbed_is_that_of_the_library() {
        let (chain, schedule) = (chain(), Schedule::automatic(0.004, 1e-5));
        let rubbed = Resistance { striker_friction_n: 4e-3, ..Resistance::default() };
        let found = simulate_with_resistance(&chain, &schedule, &[], &[rubbed]).unwrap();
        let [with, without] =
            [rubbed, Resistance::default()].map(|one| resisted(&chain, one, 0.004, 1e-5).unwrap());
        let added = |k: usize| with.displacement_m[(5, k)] - without.displacement_m[(5, k)];
        let last = found.derivatives[0].times_s.len() - 1;
        let (expected, by_library) = (added(last), found.derivatives[0].displacement_m[(5, last)]);
        // What is linear in a change of 4 mN beside some 100 N is right to a few parts in ten thousand.
        assert!((by_library / expected - 1.0).abs() < 1e-3, "{by_library:e} of {expected:e}");
        // A force of 4 mN for 4 ms takes 4 um/s from a striker of 4.3 g, and hundredths of a micrometre from the last of six bodies.
        assert!(expected < -1e-8, "{expected:e}");
    }

    fn agrees_with_the_library(chain: &Chain) {
        let (plain, solved) = (
            resisted(chain, Resistance::default(), 0.01, 1e-5).unwrap(),
            simulate(chain, &Schedule::automatic(0.01, 1e-5)).unwrap().trajectory,
        );
        let n = solved.times_s.len().min(plain.times_s.len());
        let off = |body: usize, k: usize| {
            (plain.displacement_m[(body, k)] - solved.displacement_m[(body, k)]).abs()
        };
        let worst = (0..6)
            .flat_map(|body| (0..n).map(move |k| (body, k)))
            .map(|(body, k)| off(body, k))
            .fold(0.0, f64::max);
        // A step of 1 us where the striker lifts off is wrong by half of it in that one instant: 0.2 N / 4.3 g for 1 us over 10 ms.
        assert!(worst < 5e-7, "{worst:e}");
    }

    #[test]
    fn friction_takes_the_momentum_that_it_should() {
        let free = Chain { far_end: FarEnd::Free, damping_kg_per_s: vec![0.0; 6], ..chain() };
        let rubbed = Resistance { friction_n: 0.01, ..Resistance::default() };
        let motion = resisted(&free, rubbed, 0.004, 1e-5).unwrap();
        let free = resisted(&free, Resistance::default(), 0.004, 1e-5).unwrap();
        let last = motion.times_s.len() - 1;
        let momentum = |motion: &Trajectory| {
            (0..6).map(|body| 0.455e-3 * motion.velocity_m_per_s[(body, last)]).sum::<f64>()
        };
        // Each body moves forward from its arrival on; what it lost beyond the striker's push lies between one body's and all bodies' loss.
        let lost = momentum(&free) - momentum(&motion);
        assert!(
            lost > 0.5 * 0.01 * motion.times_s[last] && lost < 6.0 * 0.01 * motion.times_s[last],
            "{lost:e}"
        );
    }

    /// A body that nothing pushes: v / v_0 = 1 / (1 + q v_0 t / m).
    #[test]
    fn drag_slows_a_lonely_body_as_it_should() {
        let chain = Chain {
            mass_kg: vec![1e-3],
            damping_kg_per_s: vec![0.0],
            far_end: FarEnd::Free,
            contact: PowerLaw::ELLIPTICAL_RING.into(),
            drive: Drive::Striker(Striker {
                mass_kg: 1e-3,
                velocity_m_per_s: 2.0,
                damping_kg_per_s: 0.0,
                ground_damping_kg_per_s: 0.0,
            }),
            ..chain()
        };
        let drag = Resistance { drag_kg_per_m: 0.01, ..Resistance::default() };
        let motion = resisted(&chain, drag, 0.05, 1e-5).unwrap();
        // Behind the collision, which takes a half period of the contact: 3 ms.
        let (first, last) = (1000, 5000);
        let [before, after] = [first, last].map(|k| motion.velocity_m_per_s[(0, k)]);
        let expected = before / (1.0 + 0.01 * before * (motion.times_s[last] - motion.times_s[first]) / 1e-3);
        // The march's own error is (q v / m)^4 times a step of 1 us to the fourth: 1e-19.
        assert!((after - expected).abs() < 1e-9 * before, "{after} of {expected}");
    }
}
