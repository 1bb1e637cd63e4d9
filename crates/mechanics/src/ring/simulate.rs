use std::f64::consts::PI;

use chainwave_measurement::Trajectory;
use ndarray::{Array2, Array4};

use super::{
    RingChain, RingDrive, Rod,
    block::{Block, Joints, Machine, RINGS},
    driver::{Driver, Units},
    ellipse::HalfEllipse,
    linear::Vibration,
    link::Link,
    record::{Balance, BlockRecord},
    span::{Progress, Span, Stretch},
};
use crate::{FarEnd, MechanicsError, StrikerMotion, check};

/// Automatic step over the largest stable one at rest; rings stiffen somewhat when they are pulled.
const SAFETY: f64 = 0.9;
/// Force that counts as none on a joint at rest, over that of a wave of the drive's velocity. What is neglected stays
/// below the chain's rounding errors.
const NEGLECTED: f64 = 1e-11;
/// Time between looks at the energies, in seconds: a hundredth of the leading pulse, so that peaks err by less than 1e-3.
const PEAK_INTERVAL_S: f64 = 2e-5;
/// Steps between which threads share the blocks anew.
const STEPS_PER_SHARE: u64 = 2048;
/// Blocks below which a further thread does not pay.
const BLOCKS_PER_THREAD: usize = 3;
/// Element-steps beyond which a simulation is refused (about an hour of computing).
const MAX_ELEMENT_STEPS: f64 = 4e12;
/// Stored numbers beyond which a simulation is refused (2 GB).
const MAX_SAMPLES: f64 = 2.5e8;

/// When a simulation ends, when it reports, its step and its threads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingSchedule {
    /// Length of the simulation in seconds. Outputs lie at all multiples of the interval up to it.
    pub duration_s: f64,
    /// Time between outputs, in seconds.
    pub output_interval_s: f64,
    /// Largest time step in seconds; the step used is the next smaller one that divides the output interval. `None`: 0.9
    /// of the largest stable one.
    pub dt_s: Option<f64>,
    /// Whether the rings' shapes are wanted.
    pub shapes: bool,
    /// Threads; the result does not depend on them.
    pub n_threads: usize,
}

/// What a chain of rings did.
#[derive(Debug, Clone, PartialEq)]
pub struct RingSimulation {
    /// Motion of joints 1 to N + 1 at the output times.
    pub trajectory: Trajectory,
    /// Motion of the striker at the output times, where there is one.
    pub striker: Option<StrikerMotion>,
    /// Largest change, over the outputs, of the energy held and lost, relative to the largest held. The energy is that
    /// which velocity Verlet keeps exactly for linear rings: with the product of the velocities half a step before and after.
    pub energy_drift: f64,
    /// Largest change, over the outputs, of the momentum along the chain, relative to the striker's at the start; `None`
    /// where a wall, a damper or an imposed motion takes part.
    pub momentum_drift: Option<f64>,
    /// Largest strain energy of each ring in joules, looked for every 20 microseconds and at the outputs.
    pub psi_max_j: Vec<f64>,
    /// Number of steps.
    pub steps: u64,
    /// Time step in seconds.
    pub dt_s: f64,
    /// Largest stable time step in seconds.
    pub stable_dt_s: f64,
    /// Elements times steps computed: less than all, where the wave was not everywhere all the time.
    pub element_steps: u64,
    /// Share of them by the slower functions, for rings bent beyond the fast ones' range.
    pub wide_share: f64,
    /// Times the striker's contact opened or closed after t = 0.
    pub contact_switches: u32,
    /// Centrelines of the upper halves in metres, shape `[ring, time, node, axis]`: x from the first joint's place at rest, y
    /// from the chain's axis. The first and last node are the joints.
    pub shapes_m: Option<Array4<f64>>,
}

/// Integrates the rings' motion from t = 0 by velocity Verlet.
///
/// # Errors
/// [`MechanicsError::NotPhysical`] or [`MechanicsError::ImposedTooShort`] for input without meaning;
/// [`MechanicsError::UnstableStep`] for a given step beyond the stability bound; [`MechanicsError::RingBroken`],
/// [`MechanicsError::TooLarge`] and [`MechanicsError::NotFinite`] as they say.
pub fn simulate_rings(chain: &RingChain, schedule: &RingSchedule) -> Result<RingSimulation, MechanicsError> {
    chain.check()?;
    let clock = Clock::new(chain, schedule)?;
    let machine = Machine::new(&clock.rod, clock.dt_s, clock.decay_per_s);
    let mut run = Run::new(chain, schedule, &clock, &machine);
    run.go(&machine, schedule.n_threads)?;
    run.finish(chain, schedule)
}

/// The rod of a half ring, its masses, and the steps that fit.
struct Clock {
    rod: Rod,
    half: HalfEllipse,
    /// Mass of the half ring's wall within one bond.
    bonded_kg: f64,
    half_ring_kg: f64,
    decay_per_s: f64,
    stable_dt_s: f64,
    dt_s: f64,
    steps_per_output: u64,
    n_outputs: usize,
}

impl Clock {
    fn new(chain: &RingChain, schedule: &RingSchedule) -> Result<Self, MechanicsError> {
        let ring = &chain.ring;
        let rod = Rod::half_ring(ring, ring.section(), chain.elements_per_ring)?;
        let half = HalfEllipse::of(ring, chain.elements_per_ring);
        let bonded_kg = rod.section().mass_kg_per_m * half.bonded_m;
        let half_ring_kg =
            rod.section().mass_kg_per_m * rod.arc_m * rod.n_elements() as f64 + 2.0 * bonded_kg;
        check::positive("duration_s", schedule.duration_s)?;
        check::positive("output_interval_s", schedule.output_interval_s)?;
        let stable_dt_s = 2.0 / fastest_rad_per_s(chain, &rod, bonded_kg);
        if let Some(dt_s) = schedule.dt_s {
            check::positive("dt_s", dt_s)?;
            if dt_s > stable_dt_s {
                return Err(MechanicsError::UnstableStep { dt_s, limit_s: stable_dt_s });
            }
        }
        let aim_s = schedule.dt_s.unwrap_or(SAFETY * stable_dt_s);
        // The last output may lie a rounding beyond the end.
        let n_outputs = (schedule.duration_s / schedule.output_interval_s * (1.0 + 1e-12)).floor() + 1.0;
        let steps_per_output = (schedule.output_interval_s / aim_s * (1.0 - 1e-12)).ceil().max(1.0);
        let steps = n_outputs * steps_per_output;
        check_size(chain, schedule, steps, n_outputs)?;
        if let RingDrive::Imposed(motion) = &chain.drive {
            motion.check_covers((n_outputs - 1.0) * schedule.output_interval_s)?;
        }
        Ok(Self {
            rod,
            half,
            bonded_kg,
            half_ring_kg,
            decay_per_s: 0.5 * chain.damping_kg_per_s / half_ring_kg,
            stable_dt_s,
            dt_s: schedule.output_interval_s / steps_per_output,
            steps_per_output: steps_per_output as u64,
            n_outputs: n_outputs as usize,
        })
    }
}

/// Upper bound of the frequencies of the rings, and of the striker's contact with the first joint.
fn fastest_rad_per_s(chain: &RingChain, rod: &Rod, bonded_kg: f64) -> f64 {
    let ring = Vibration::new(rod, bonded_kg).largest_rad_per_s();
    let RingDrive::Striker(striker) = &chain.drive else { return ring };
    let joint_kg = 0.5 * rod.section().mass_kg_per_m * rod.arc_m + bonded_kg;
    let contact = 0.5 * striker.contact_stiffness_n_per_m * (joint_kg.recip() + 2.0 / striker.mass_kg);
    (ring * ring + contact).sqrt()
}

fn check_size(
    chain: &RingChain,
    schedule: &RingSchedule,
    steps: f64,
    n_outputs: f64,
) -> Result<(), MechanicsError> {
    let (rings, elements) = (chain.n_rings as f64, 0.5 * chain.elements_per_ring as f64);
    let per_ring = if schedule.shapes { 2.0 * elements } else { 4.0 };
    let limits = [
        (
            "elements times steps",
            steps * rings * elements,
            MAX_ELEMENT_STEPS,
            "shorten the simulation, or take fewer rings or elements",
        ),
        (
            "numbers to report",
            n_outputs * (rings + 1.0) * per_ring,
            MAX_SAMPLES,
            "report less often, or leave out the shapes",
        ),
    ];
    for (quantity, found, limit, hint) in limits {
        if found > limit || found.is_nan() {
            return Err(MechanicsError::TooLarge { quantity, limit, found, hint });
        }
    }
    Ok(())
}

/// A simulation under way.
struct Run<'a> {
    clock: &'a Clock,
    blocks: Vec<Block>,
    records: Vec<BlockRecord>,
    driver: Driver<'a>,
    n_reached: usize,
    least_force: f64,
    block_steps: u64,
    /// Seconds, metres and kilograms of a kernel unit.
    units: Units,
}

impl<'a> Run<'a> {
    fn new(chain: &'a RingChain, schedule: &RingSchedule, clock: &'a Clock, machine: &Machine) -> Self {
        let units = Units {
            length_m: machine.kernel.length_m(),
            element_kg: clock.rod.section().mass_kg_per_m * clock.rod.arc_m,
            dt_s: clock.dt_s,
            keep: machine.kernel.keep(),
            gain: machine.kernel.gain(),
        };
        let n_blocks = chain.n_rings.div_ceil(RINGS);
        let blocks = (0..n_blocks).map(|b| {
            let n_here = (chain.n_rings - b * RINGS).min(RINGS);
            let own = if b + 1 == n_blocks { n_here + 1 } else { RINGS };
            machine.block(joints(chain, clock, b * RINGS), n_here, own, b == 0)
        });
        Self {
            clock,
            blocks: blocks.collect(),
            records: (0..n_blocks).map(|_| BlockRecord::new(schedule.shapes)).collect(),
            driver: Driver::new(chain, units),
            n_reached: 1,
            least_force: NEGLECTED * wave_force_n(chain, clock) * clock.dt_s * clock.dt_s
                / (units.element_kg * units.length_m),
            block_steps: 0,
            units,
        }
    }

    /// Takes all steps; threads share the blocks that the wave has reached, anew from time to time.
    fn go(&mut self, machine: &Machine, n_threads: usize) -> Result<(), MechanicsError> {
        let end = (self.clock.n_outputs as u64 - 1) * self.clock.steps_per_output + 1;
        for start in (0..end).step_by(STEPS_PER_SHARE as usize) {
            let stretch = Stretch {
                steps: start..(start + STEPS_PER_SHARE).min(end),
                steps_per_output: self.clock.steps_per_output,
                steps_per_peak: (PEAK_INTERVAL_S / self.clock.dt_s).max(1.0) as u64,
                least_force: self.least_force,
            };
            let n_spans = n_threads.min(self.n_reached / BLOCKS_PER_THREAD).max(1);
            let links: Vec<Link> = (1..n_spans).map(|_| Link::default()).collect();
            let spans = self.spans(&links, n_spans);
            let outcomes: Vec<Progress> = std::thread::scope(|scope| {
                let mut spans = spans.into_iter();
                let first = spans.next();
                let others: Vec<_> = spans.map(|span| scope.spawn(|| span.run(machine, &stretch))).collect();
                let first = first.map(|span| span.run(machine, &stretch));
                first.into_iter().chain(others.into_iter().filter_map(|thread| thread.join().ok())).collect()
            });
            self.n_reached = outcomes.iter().map(|progress| progress.n_reached).sum();
            self.block_steps += outcomes.iter().map(|progress| progress.block_steps).sum::<u64>();
            let time_s = stretch.steps.end as f64 * self.clock.dt_s;
            if self.blocks.iter().any(|block| block.broken) {
                return Err(MechanicsError::RingBroken { time_s });
            }
            if !self.blocks.iter().all(|block| block.ends.iter().flatten().all(|force| force.is_finite())) {
                return Err(MechanicsError::NotFinite { time_s });
            }
        }
        Ok(())
    }

    /// Shares the blocks among threads: those reached evenly, those at rest with the last.
    fn spans<'s>(&'s mut self, links: &'s [Link], n_spans: usize) -> Vec<Span<'s, 'a>> {
        let mut blocks = self.blocks.as_mut_slice();
        let mut records = self.records.as_mut_slice();
        let mut drive = Some(&mut self.driver);
        let bound = |k: usize| self.n_reached * k / n_spans;
        let mut spans = Vec::with_capacity(n_spans);
        for k in 0..n_spans {
            let n_reached = bound(k + 1) - bound(k);
            let n_blocks = if k + 1 == n_spans { blocks.len() } else { n_reached };
            let (own_blocks, other_blocks) = std::mem::take(&mut blocks).split_at_mut(n_blocks);
            let (own_records, other_records) = std::mem::take(&mut records).split_at_mut(n_blocks);
            (blocks, records) = (other_blocks, other_records);
            spans.push(Span {
                blocks: own_blocks,
                records: own_records,
                n_reached,
                drive: drive.take(),
                left: k.checked_sub(1).and_then(|link| links.get(link)),
                right: links.get(k),
            });
        }
        spans
    }
}

/// A block's joints from the one of the given number (from 0) on.
fn joints(chain: &RingChain, clock: &Clock, first: usize) -> Joints {
    let element_kg = clock.rod.section().mass_kg_per_m * clock.rod.arc_m;
    let bonded = clock.bonded_kg / element_kg;
    let last = chain.n_rings;
    let imposed = matches!(chain.drive, RingDrive::Imposed(_));
    let inverse_mass = |joint: usize| match joint {
        0 if imposed => 0.0,
        joint if joint > last || (joint == last && chain.far_end == FarEnd::Fixed) => 0.0,
        joint if joint == 0 || joint == last => (0.5 + bonded).recip(),
        _ => (1.0 + 2.0 * bonded).recip(),
    };
    Joints { inverse_masses: std::array::from_fn(|j| inverse_mass(first + j)), ..Joints::default() }
}

/// Force of a weak wave of the drive's velocity in the upper half of the chain, in newtons: sqrt(k m) v, with the
/// stiffness k of a half circle of the same length, 2 EI / ((pi / 4 - 2 / pi) R^3) / 4, which gives the order of magnitude.
fn wave_force_n(chain: &RingChain, clock: &Clock) -> f64 {
    let velocity_m_per_s = match &chain.drive {
        RingDrive::Striker(striker) => striker.velocity_m_per_s,
        RingDrive::Imposed(motion) => motion.largest_velocity_m_per_s(),
    };
    let radius_m = clock.rod.arc_m * clock.rod.n_elements() as f64 / PI;
    let stiffness_n_per_m = 3.4 * clock.rod.section().bending_nm2 / radius_m.powi(3);
    (clock.half_ring_kg * stiffness_n_per_m).sqrt() * velocity_m_per_s
}

impl Run<'_> {
    /// Puts what the blocks wrote together, in SI units and for the whole chain.
    fn finish(self, chain: &RingChain, schedule: &RingSchedule) -> Result<RingSimulation, MechanicsError> {
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
        let conserves = striker.is_some() && chain.far_end == FarEnd::Free && clock.decay_per_s == 0.0;
        let n_elements = clock.rod.n_elements() as u64;
        let wide: u64 = self.blocks.iter().map(|block| block.wide_steps).sum();
        Ok(RingSimulation {
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
            contact_switches: self.driver.switches,
            shapes_m: schedule.shapes.then(|| self.shapes_m(chain)),
        })
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
