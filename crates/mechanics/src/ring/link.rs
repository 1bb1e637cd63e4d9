//! Two threads' exchange of the force on the joint between them, without a lock.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Times that a thread looks for its neighbour's force before it lets others run.
const PATIENCE: u32 = 300;

/// Two threads' exchange of the forces on the joint between their parts of the chain.
#[derive(Debug, Default)]
pub(crate) struct Link {
    sides: [LinkSide; 2],
    /// Times that a thread let others run.
    waits: AtomicU64,
    /// Whether a thread has left before its last step.
    is_left: AtomicBool,
}

/// What one of the two says, in a cache line of its own.
#[derive(Debug, Default)]
#[repr(align(128))]
struct LinkSide {
    /// The forces of the last even and odd step, as bits.
    forces: [AtomicU64; 2],
    /// Number of steps whose force was said.
    steps: AtomicU64,
}

/// The thread to the left or right of a link.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Bank {
    Left = 0,
    Right = 1,
}

impl Link {
    /// Tells the other bank one's force on the joint at a step; steps follow each other from `start`.
    ///
    /// The force two steps before is overwritten. The other has read it: it gave its own force of the step before since.
    pub(crate) fn say(&self, bank: Bank, step: u64, force: f64) {
        let side = &self.sides[bank as usize];
        side.forces[(step % 2) as usize].store(force.to_bits(), Ordering::Relaxed);
        side.steps.store(step + 1, Ordering::Release);
    }

    /// Times that a thread waited so long for the other that it let others run.
    pub(crate) fn n_waits(&self) -> u64 {
        self.waits.load(Ordering::Relaxed)
    }

    /// Tells the other bank that no force will follow.
    pub(crate) fn leave(&self) {
        self.is_left.store(true, Ordering::Release);
    }

    /// The other bank's force on the joint at a step, as soon as it is known; none where the other has left.
    pub(crate) fn hear(&self, bank: Bank, step: u64) -> Option<f64> {
        let side = &self.sides[1 - bank as usize];
        let mut looks = 0;
        while side.steps.load(Ordering::Acquire) <= step {
            looks += 1;
            if looks < PATIENCE {
                std::hint::spin_loop();
                continue;
            }
            if looks == PATIENCE {
                self.waits.fetch_add(1, Ordering::Relaxed);
            }
            if self.is_left.load(Ordering::Acquire) {
                return None;
            }
            std::thread::yield_now();
        }
        Some(f64::from_bits(side.forces[(step % 2) as usize].load(Ordering::Relaxed)))
    }
}
