//! Neighbouring blocks that one thread moves, step by step.

use super::{
    block::{BlockStepper, RINGS, RingBlock},
    driver::Driver,
    link::{Bank, Link},
    record::{Before, BlockRecord},
};

/// Neighbouring blocks that one thread moves, with what they meet at either side.
#[derive(Debug)]
pub(crate) struct Span<'s, 'a> {
    pub(crate) blocks: &'s mut [RingBlock],
    pub(crate) records: &'s mut [BlockRecord],
    /// Blocks that the wave has reached; those behind are at rest. All of them, where another thread goes on to the right.
    pub(crate) n_reached: usize,
    pub(crate) drive: Option<&'s mut Driver<'a>>,
    pub(crate) left: Option<&'s Link>,
    pub(crate) right: Option<&'s Link>,
}

/// Steps to take, and what is decided in them.
#[derive(Debug, Clone)]
pub(crate) struct StepPlan {
    pub(crate) steps: std::ops::Range<u64>,
    pub(crate) steps_per_output: u64,
    /// Steps between which the energies' peaks are looked for.
    pub(crate) steps_per_peak: u64,
    /// Force on a joint at rest, in the kernel's units, from which on the next block is reached.
    pub(crate) least_force: f64,
}

/// How far a span got.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Progress {
    /// Blocks that the wave has reached.
    pub(crate) n_reached: usize,
    /// Blocks times steps computed.
    pub(crate) block_steps: u64,
}

impl Span<'_, '_> {
    /// Takes the steps, or those until a neighbour left in a panic.
    pub(crate) fn run(mut self, machine: &BlockStepper, stretch: &StepPlan) -> Progress {
        let mut presence = Presence { links: [self.left, self.right], has_finished: false };
        let mut scratch = machine.scratch();
        let mut block_steps = 0;
        for step in stretch.steps.clone() {
            let is_output = step.is_multiple_of(stretch.steps_per_output);
            let output = is_output.then(|| (step / stretch.steps_per_output) as usize);
            let book = is_output || step.is_multiple_of(stretch.steps_per_peak);
            // The outer blocks first, so that the neighbours need not wait for what is inside.
            machine.step(&mut self.blocks[..1], &mut scratch, book);
            if let Some(link) = self.left {
                link.say(Bank::Right, step, self.blocks[0].ends[0][0]);
            }
            let last = self.n_reached - 1;
            if last > 0 {
                machine.step(&mut self.blocks[last..=last], &mut scratch, book);
            }
            if let Some(link) = self.right {
                link.say(Bank::Left, step, self.blocks[last].ends[1][RINGS - 1]);
            }
            machine.step(&mut self.blocks[last.min(1)..last], &mut scratch, book);
            block_steps += self.n_reached as u64;
            self.reach(stretch.least_force);
            if book {
                for (block, record) in self.blocks.iter().zip(self.records.iter_mut()).take(self.n_reached) {
                    record.look_for_peaks(machine, block);
                    record.look_for_contact(machine, block, step);
                }
            }
            if self.move_joints(machine, step, output).is_none() {
                return Progress { n_reached: self.n_reached, block_steps };
            }
        }
        presence.has_finished = true;
        Progress { n_reached: self.n_reached, block_steps }
    }

    /// Takes in the next block at rest once the last one pushes against it.
    fn reach(&mut self, least_force: f64) {
        let pushes = self.blocks[self.n_reached - 1].ends[1][RINGS - 1].abs() > least_force;
        if self.right.is_none() && pushes && self.n_reached < self.blocks.len() {
            self.n_reached += 1;
        }
    }

    /// Moves the joints by a step; returns none where a neighbour has left, whose force they would need.
    fn move_joints(&mut self, machine: &BlockStepper, step: u64, output: Option<usize>) -> Option<()> {
        let force = |link: Option<&Link>, bank: Bank| link.map_or(Some(0.0), |link| link.hear(bank, step));
        let mut left = force(self.left, Bank::Right)?;
        let from_right = force(self.right, Bank::Left)?;
        for b in 0..self.n_reached {
            let next_left = self.blocks[b].ends[1][RINGS - 1];
            let right = match self.blocks.get(b + 1) {
                Some(next) if b + 1 < self.n_reached => next.ends[0][0],
                // A joint with a block at rest is held.
                Some(_) => -next_left,
                None => from_right,
            };
            let block = &mut self.blocks[b];
            let before = (output.is_some() || machine.is_damped()).then(|| block.joints.clone());
            let kick = match &mut self.drive {
                Some(drive) if b == 0 => Some(drive.kick(step, &mut block.joints, block.ends[0][0])),
                _ => None,
            };
            machine.move_joints(block, left, right);
            if let Some(before) = before {
                self.records[b].book(machine, block, &Before { joints: before, kick }, output);
            }
            left = next_left;
        }
        Some(())
    }
}

/// Tells the neighbours when a thread leaves before its last step, in a panic of its own or after another's, so that none waits for it.
struct Presence<'s> {
    links: [Option<&'s Link>; 2],
    has_finished: bool,
}

impl Drop for Presence<'_> {
    fn drop(&mut self) {
        if !self.has_finished {
            self.links.into_iter().flatten().for_each(Link::leave);
        }
    }
}
