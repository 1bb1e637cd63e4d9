//! Time stepping of a chain of rings on several threads.

use std::f64::consts::PI;

use super::{
    block::{BlockStepper, Joints, RINGS, RingBlock},
    chain::{RingChain, RingDrive},
    clock::RingClock,
    driver::{Driver, Units},
    link::Link,
    record::BlockRecord,
    release::Release,
    schedule::RingSchedule,
    span::{Progress, Span, StepPlan},
};
use crate::{equations::parameters::FarEnd, error::MechanicsError};

/// Force that counts as none on a joint at rest, over that of a wave of the drive's velocity. What is neglected stays
/// below the chain's rounding errors.
const NEGLECTED: f64 = 1e-11;
/// Time between looks at the energies and the walls, in seconds: a hundredth of the leading pulse, so that peaks err by less
/// than 1e-3.
const PEAK_INTERVAL_S: f64 = 2e-5;
/// Steps between which threads share the blocks anew.
const STEPS_PER_SHARE: u64 = 2048;
/// Share of the steps in which threads may wait for each other, before one goes on alone: a machine that has other work to do
/// gives two threads their turns one after the other, and each step then takes as long as a turn.
const WAITING_SHARE: u64 = 16;
/// Shares that it goes alone at first; twice as many each further time.
const SHARES_ALONE: u32 = 8;
/// Blocks below which a further thread does not pay.
const BLOCKS_PER_THREAD: usize = 3;

/// A simulation under way.
pub(crate) struct RingRun<'a> {
    pub(super) clock: &'a RingClock,
    pub(super) blocks: Vec<RingBlock>,
    pub(super) records: Vec<BlockRecord>,
    pub(super) driver: Option<Driver<'a>>,
    n_reached: usize,
    least_force: f64,
    pub(super) block_steps: u64,
    /// Seconds, metres and kilograms of a kernel unit.
    pub(super) units: Units,
}

impl<'a> RingRun<'a> {
    pub(crate) fn new(
        chain: &'a RingChain,
        schedule: &RingSchedule,
        clock: &'a RingClock,
        machine: &BlockStepper,
    ) -> Result<Self, MechanicsError> {
        let units = Units {
            length_m: machine.kernel.length_m(),
            element_kg: clock.rod.section().mass_kg_per_m * clock.rod.arc_m,
            dt_s: clock.dt_s,
            keep: machine.kernel.keep(),
            gain: machine.kernel.gain(),
        };
        let driver = Driver::new(chain, units);
        let n_blocks = chain.n_rings.div_ceil(RINGS);
        let blocks = (0..n_blocks).map(|b| {
            let n_here = (chain.n_rings - b * RINGS).min(RINGS);
            let own = if b + 1 == n_blocks { n_here + 1 } else { RINGS };
            machine.block(joints(chain, clock, b * RINGS), n_here, own, b == 0 && driver.is_some())
        });
        let mut blocks: Vec<RingBlock> = blocks.collect();
        let records = (0..n_blocks).map(|_| BlockRecord::new(schedule.shapes)).collect();
        let force_unit_n = units.element_kg * units.length_m / (clock.dt_s * clock.dt_s);
        let (n_reached, least_force) = match &chain.drive {
            RingDrive::Free { displacement_m, velocity_m_per_s } => {
                let release = Release::new(&clock.rod, displacement_m, velocity_m_per_s)?;
                release.set(machine, &mut blocks, units);
                (n_blocks, 0.0)
            }
            RingDrive::Striker(striker) => (1, wave_force_n(clock, striker.velocity_m_per_s)),
            RingDrive::Imposed(motion) => (1, wave_force_n(clock, motion.largest_velocity_m_per_s())),
        };
        let least_force = NEGLECTED * least_force / force_unit_n;
        Ok(Self { clock, blocks, records, driver, n_reached, least_force, block_steps: 0, units })
    }

    /// Takes all steps; threads share the blocks that the wave has reached, anew from time to time.
    pub(crate) fn go(&mut self, machine: &BlockStepper, n_threads: usize) -> Result<(), MechanicsError> {
        let end = (self.clock.n_outputs as u64 - 1) * self.clock.steps_per_output + 1;
        let (mut alone, mut next_alone) = (0_u32, SHARES_ALONE);
        for start in (0..end).step_by(STEPS_PER_SHARE as usize) {
            let stretch = StepPlan {
                steps: start..(start + STEPS_PER_SHARE).min(end),
                steps_per_output: self.clock.steps_per_output,
                steps_per_peak: (PEAK_INTERVAL_S / self.clock.dt_s).max(1.0) as u64,
                least_force: self.least_force,
            };
            let n_spans = match alone {
                0 => n_threads.min(self.n_reached / BLOCKS_PER_THREAD).max(1),
                _ => 1,
            };
            alone = alone.saturating_sub(1);
            let links: Vec<Link> = (1..n_spans).map(|_| Link::default()).collect();
            let spans = self.spans(&links, n_spans);
            let outcomes = run_in_parallel(spans, machine, &stretch);
            if links.iter().map(Link::n_waits).sum::<u64>() > STEPS_PER_SHARE / WAITING_SHARE {
                (alone, next_alone) = (next_alone, next_alone.saturating_mul(2));
            }
            self.n_reached = outcomes.iter().map(|progress| progress.n_reached).sum();
            self.block_steps += outcomes.iter().map(|progress| progress.block_steps).sum::<u64>();
            if self.records.iter().any(|record| record.contact.is_some()) {
                return Ok(());
            }
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
        let mut drive = self.driver.as_mut();
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

/// Runs each span on a thread of its own, the first on this one. A panic of any ends the others at their next exchange and goes on here.
fn run_in_parallel(spans: Vec<Span<'_, '_>>, machine: &BlockStepper, stretch: &StepPlan) -> Vec<Progress> {
    let outcomes: std::thread::Result<Vec<Progress>> = std::thread::scope(|scope| {
        let mut spans = spans.into_iter();
        let first = spans.next();
        let others: Vec<_> = spans.map(|span| scope.spawn(|| span.run(machine, stretch))).collect();
        let first = first.map(|span| Ok(span.run(machine, stretch)));
        // All are joined, so that the panic that goes on is the first one and not the scope's word for several.
        let others: Vec<_> = others.into_iter().map(|thread| thread.join()).collect();
        first.into_iter().chain(others).collect()
    });
    outcomes.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// A block's joints from the one of the given number (from 0) on.
fn joints(chain: &RingChain, clock: &RingClock, first: usize) -> Joints {
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

/// Force of a weak wave of the given velocity in the upper half of the chain, in newtons: sqrt(k m) v, with the stiffness k
/// of a half circle of the same length, 2 EI / ((pi / 4 - 2 / pi) R^3) / 4, which gives the order of magnitude.
fn wave_force_n(clock: &RingClock, velocity_m_per_s: f64) -> f64 {
    let radius_m = clock.rod.arc_m * clock.rod.n_elements() as f64 / PI;
    let stiffness_n_per_m = 3.4 * clock.rod.section().bending_nm2 / radius_m.powi(3);
    (clock.half_ring_kg * stiffness_n_per_m).sqrt() * velocity_m_per_s
}

#[cfg(test)]
mod tests {
    use std::{sync::mpsc, thread, time::Duration};

    use super::*;
    use crate::ring::{section::Ring, walls::Walls};

    /// A chain on the move from the start, which so many rings share among as many threads as blocks allow.
    fn moving_chain(n_rings: usize, elements_per_ring: usize) -> RingChain {
        RingChain {
            ring: Ring::PAPER,
            n_rings,
            elements_per_ring,
            damping_kg_per_s: 0.0,
            drive: RingDrive::Free {
                displacement_m: vec![0.0; n_rings + 1],
                velocity_m_per_s: (0..=n_rings).map(|joint| 1e-3 * (joint as f64).sin()).collect(),
            },
            far_end: FarEnd::Free,
        }
    }

    const SCHEDULE: RingSchedule =
        RingSchedule { duration_s: 1e-3, output_interval_s: 1e-4, dt_s: None, shapes: false, n_threads: 3 };

    fn machine_of(chain: &RingChain, clock: &RingClock) -> BlockStepper {
        BlockStepper::new(&clock.rod, Walls::new(&chain.ring, clock.half.nodes_m.clone()), clock)
    }

    /// A block with the nodes of a coarser mesh is too short for the element loop, which panics in the thread that has it: the first
    /// one, one between two others, and the last one. The whole run takes milliseconds, so a minute is for ever.
    #[test]
    fn a_panic_of_one_thread_comes_out_and_none_waits_for_it() {
        for broken in [0, 4, 8] {
            let (report, reported) = mpsc::channel();
            let worker = thread::spawn(move || {
                let (chain, coarser) = (moving_chain(9 * RINGS, 12), moving_chain(9 * RINGS, 6));
                let clock = RingClock::new(&chain, &SCHEDULE).unwrap();
                let machine = machine_of(&chain, &clock);
                let mut run = RingRun::new(&chain, &SCHEDULE, &clock, &machine).unwrap();
                let coarser_clock = RingClock::new(&coarser, &SCHEDULE).unwrap();
                run.blocks[broken] =
                    machine_of(&coarser, &coarser_clock).block(Joints::default(), RINGS, RINGS, false);
                let marched = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                    run.go(&machine, SCHEDULE.n_threads).is_ok()
                }));
                report.send(marched.map_err(|panic| panic.downcast_ref::<String>().cloned())).unwrap();
            });
            let marched = reported.recv_timeout(Duration::from_secs(60)).unwrap();
            worker.join().unwrap();
            // The message is that of the slice which was too short.
            let message = marched.unwrap_err().unwrap();
            assert!(message.contains("range end index"), "{broken}: {message}");
        }
    }
}
