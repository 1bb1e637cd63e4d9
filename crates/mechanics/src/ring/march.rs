use std::f64::consts::PI;

use super::{
    RingChain, RingDrive, RingSchedule,
    block::{Block, Joints, Machine, RINGS},
    clock::Clock,
    driver::{Driver, Units},
    link::Link,
    record::BlockRecord,
    release::Release,
    span::{Progress, Span, Stretch},
};
use crate::{FarEnd, MechanicsError};

/// Force that counts as none on a joint at rest, over that of a wave of the drive's velocity. What is neglected stays
/// below the chain's rounding errors.
const NEGLECTED: f64 = 1e-11;
/// Time between looks at the energies and the walls, in seconds: a hundredth of the leading pulse, so that peaks err by less
/// than 1e-3.
const PEAK_INTERVAL_S: f64 = 2e-5;
/// Steps between which threads share the blocks anew.
const STEPS_PER_SHARE: u64 = 2048;
/// Blocks below which a further thread does not pay.
const BLOCKS_PER_THREAD: usize = 3;

/// A simulation under way.
pub(crate) struct Run<'a> {
    pub(super) clock: &'a Clock,
    pub(super) blocks: Vec<Block>,
    pub(super) records: Vec<BlockRecord>,
    pub(super) driver: Option<Driver<'a>>,
    n_reached: usize,
    least_force: f64,
    pub(super) block_steps: u64,
    /// Seconds, metres and kilograms of a kernel unit.
    pub(super) units: Units,
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        chain: &'a RingChain,
        schedule: &RingSchedule,
        clock: &'a Clock,
        machine: &Machine,
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
        let mut blocks: Vec<Block> = blocks.collect();
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
    pub(crate) fn go(&mut self, machine: &Machine, n_threads: usize) -> Result<(), MechanicsError> {
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

/// Force of a weak wave of the given velocity in the upper half of the chain, in newtons: sqrt(k m) v, with the stiffness k
/// of a half circle of the same length, 2 EI / ((pi / 4 - 2 / pi) R^3) / 4, which gives the order of magnitude.
fn wave_force_n(clock: &Clock, velocity_m_per_s: f64) -> f64 {
    let radius_m = clock.rod.arc_m * clock.rod.n_elements() as f64 / PI;
    let stiffness_n_per_m = 3.4 * clock.rod.section().bending_nm2 / radius_m.powi(3);
    (clock.half_ring_kg * stiffness_n_per_m).sqrt() * velocity_m_per_s
}
