//! Puts the blocks' records together to one result in SI units.

use chainwave_measurement::Trajectory;
use ndarray::{Array2, Array4};

use super::{
    block::RINGS,
    chain::{RingChain, RingDrive},
    march::RingRun,
    record::Balance,
    schedule::RingSchedule,
    simulation::{RingSimulation, SelfContact},
};
use crate::{chain::simulation::StrikerMotion, equations::parameters::FarEnd};

impl RingRun<'_> {
    /// Puts what the blocks wrote together, in SI units and for the whole chain.
    pub(crate) fn finish(self, chain: &RingChain, schedule: &RingSchedule) -> RingSimulation {
        let clock = self.clock;
        let speed = self.units.length_m / self.units.dt_s;
        let energy_j = 2.0 * self.units.element_kg * speed * speed;
        let times_s = (0..clock.n_outputs).map(|k| k as f64 * schedule.output_interval_s).collect();
        let shape = (chain.n_rings + 1, clock.n_outputs);
        let (mut displacement_m, mut velocity_m_per_s) = (Array2::zeros(shape), Array2::zeros(shape));
        for (b, (block, record)) in self.blocks.iter().zip(&self.records).enumerate() {
            for (k, [places, velocities]) in (record.first_output..).zip(&record.motion) {
                for j in 0..block.n_own_joints {
                    displacement_m[(b * RINGS + j, k)] = places[j] * self.units.length_m;
                    velocity_m_per_s[(b * RINGS + j, k)] = velocities[j] * speed;
                }
            }
        }
        let peaks = self.records.iter().flat_map(|record| record.peak_energies);
        let motion = &self.records[0].striker;
        let striker = (!motion.is_empty()).then(|| StrikerMotion {
            displacement_m: motion.iter().map(|[place, _]| place * self.units.length_m).collect(),
            velocity_m_per_s: motion.iter().map(|[_, velocity]| velocity * speed).collect(),
        });
        let [energy_drift, momentum_drift] = self.drifts();
        let imposed = matches!(chain.drive, RingDrive::Imposed(_));
        let conserves = !imposed && chain.far_end == FarEnd::Free && clock.decay_per_s == 0.0;
        let n_elements = clock.rod.n_elements() as u64;
        let wide: u64 = self.blocks.iter().map(|block| block.wide_steps).sum();
        RingSimulation {
            trajectory: Trajectory { times_s, displacement_m, velocity_m_per_s },
            striker,
            energy_drift,
            momentum_drift: conserves.then_some(momentum_drift),
            psi_max_j: peaks.take(chain.n_rings).map(|energy| energy * energy_j).collect(),
            steps: (clock.n_outputs as u64 - 1) * clock.steps_per_output,
            dt_s: clock.dt_s,
            stable_dt_s: clock.stable_dt_s,
            element_steps: self.block_steps * RINGS as u64 * n_elements,
            wide_share: wide as f64 / (self.block_steps * RINGS as u64) as f64,
            contact_switches: self.driver.as_ref().map_or(0, |driver| driver.switches),
            self_contact: self.self_contact(),
            shapes_m: schedule.shapes.then(|| self.shapes_m(chain)),
        }
    }

    /// The first contact of walls that was seen.
    fn self_contact(&self) -> Option<SelfContact> {
        let contacts = self.records.iter().enumerate();
        let contacts =
            contacts.filter_map(|(b, record)| record.contact.map(|(step, ring)| (step, b * RINGS + ring)));
        let (step, ring) = contacts.min()?;
        Some(SelfContact { ring: ring + 1, time_s: step as f64 * self.clock.dt_s })
    }

    /// Largest changes of energy and momentum over the outputs, relative to the largest held.
    fn drifts(&self) -> [f64; 2] {
        let mut sums = vec![Balance::default(); self.clock.n_outputs];
        for record in &self.records {
            for (sum, balance) in sums[record.first_output..].iter_mut().zip(&record.balances) {
                sum.held += balance.held;
                sum.lost += balance.lost;
                sum.momentum += balance.momentum;
            }
        }
        let drift = |of: fn(&Balance) -> f64, size: fn(&Balance) -> f64| {
            let start = of(&sums[0]);
            let change = sums.iter().map(|sum| (of(sum) - start).abs()).fold(0.0, f64::max);
            let largest = sums.iter().map(|sum| size(sum).abs()).fold(0.0, f64::max);
            if largest > 0.0 { change / largest } else { change }
        };
        [drift(|sum| sum.held + sum.lost, |sum| sum.held), drift(|sum| sum.momentum, |sum| sum.momentum)]
    }

    fn shapes_m(&self, chain: &RingChain) -> Array4<f64> {
        let nodes_m = &self.clock.half.nodes_m;
        let n_inner = nodes_m.len() - 2;
        let semi_major_m = chain.ring.semi_major_m;
        Array4::from_shape_fn(
            (chain.n_rings, self.clock.n_outputs, nodes_m.len(), 2),
            |(ring, k, node, axis)| {
                let (record, lane) = (&self.records[ring / RINGS], ring % RINGS);
                let rest_m =
                    nodes_m[node][axis] + if axis == 0 { semi_major_m * (2 * ring + 1) as f64 } else { 0.0 };
                let Some(row) = k.checked_sub(record.first_output).filter(|row| *row < record.motion.len())
                else {
                    return rest_m;
                };
                let moved = match node {
                    0 if axis == 0 => record.motion[row][0][lane],
                    node if node > n_inner && axis == 0 => record.motion[row][0][lane + 1],
                    node if (1..=n_inner).contains(&node) => {
                        record.shapes[(row * RINGS + lane) * n_inner + node - 1][axis]
                    }
                    _ => 0.0,
                };
                rest_m + moved * self.units.length_m
            },
        )
    }
}
