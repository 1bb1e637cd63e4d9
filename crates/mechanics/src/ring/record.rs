//! What a block of rings did at the outputs: motion, energies, peaks, contact of walls.

use super::{
    block::{BlockStepper, Joints, RINGS, RingBlock},
    driver::DriveStep,
};

/// What a block did at the outputs since the wave reached it, in the kernel's units.
#[derive(Debug, Default)]
pub(crate) struct BlockRecord {
    /// Number of the first output.
    pub(crate) first_output: usize,
    /// Places and velocities of the nine joints.
    pub(crate) motion: Vec<[[f64; RINGS + 1]; 2]>,
    pub(crate) balances: Vec<Balance>,
    /// Largest strain energy of each ring.
    pub(crate) peak_energies: [f64; RINGS],
    /// Step and ring of the first contact of a ring's walls.
    pub(crate) contact: Option<(u64, usize)>,
    /// Place and velocity of the striker.
    pub(crate) striker: Vec<[f64; 2]>,
    /// Displacements of the inner nodes of each ring, where they are asked for.
    pub(crate) shapes: Vec<[f64; 2]>,
    with_shapes: bool,
    /// Room for one ring's places.
    places_m: Vec<[f64; 2]>,
    /// Energy that the rings' dampers took.
    lost: f64,
}

/// Sums over a block: its rings, the joints at their left, and the drive.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Balance {
    /// Energy held.
    pub(crate) held: f64,
    /// Energy that dampers took, less what the drive put in.
    pub(crate) lost: f64,
    /// Momentum along the chain.
    pub(crate) momentum: f64,
}

/// A block's joints before they moved, and what the drive did.
pub(crate) struct Before {
    pub(crate) joints: Joints,
    pub(crate) kick: Option<DriveStep>,
}

impl Before {
    /// Velocity of a joint; of a driven one, as its drive has it.
    fn velocity(&self, joint: usize) -> f64 {
        let driven = self.kick.filter(|_| joint == 0);
        driven.map_or(self.joints.velocities[joint], |kick| kick.velocity_before)
    }
}

impl BlockRecord {
    pub(crate) fn new(with_shapes: bool) -> Self {
        Self { with_shapes, ..Self::default() }
    }

    /// Keeps the largest strain energy of each ring, after a step that booked it.
    pub(crate) fn look_for_peaks(&mut self, machine: &BlockStepper, block: &RingBlock) {
        for (peak, energy) in self.peak_energies.iter_mut().zip(&block.strain_energy) {
            *peak = peak.max(*energy / machine.kernel.gain());
        }
    }

    /// Looks for a ring whose walls touch, after a step of the inner nodes and before that of the joints.
    pub(crate) fn look_for_contact(&mut self, machine: &BlockStepper, block: &RingBlock, step: u64) {
        if self.contact.is_none() {
            self.contact = machine.touching(block, &mut self.places_m).map(|ring| (step, ring));
        }
    }

    /// Books a step that joints and inner nodes have just made: what dampers took, and the motion where the step begins at an
    /// output.
    pub(crate) fn book(
        &mut self,
        machine: &BlockStepper,
        block: &RingBlock,
        before: &Before,
        output: Option<usize>,
    ) {
        let lost = lost(machine, block, before);
        if let Some(output) = output {
            self.write(machine, block, before, output, self.lost + 0.5 * lost);
        }
        self.lost += lost;
    }

    fn write(
        &mut self,
        machine: &BlockStepper,
        block: &RingBlock,
        before: &Before,
        output: usize,
        lost: f64,
    ) {
        if self.motion.is_empty() {
            self.first_output = output;
        }
        let after = &block.joints.velocities;
        let velocities = std::array::from_fn(|j| 0.5 * (before.velocity(j) + after[j]));
        self.motion.push([before.joints.places, velocities]);
        self.balances.push(balance(machine, block, before, lost));
        if let Some([place, velocity_before, velocity_after]) = before.kick.and_then(|kick| kick.striker) {
            self.striker.push([place, 0.5 * (velocity_before + velocity_after)]);
        }
        if self.with_shapes {
            let rings = (0..RINGS).flat_map(|ring| (0..machine.n_inner()).map(move |node| (ring, node)));
            self.shapes.extend(rings.map(|(ring, node)| machine.inner_place_before(block, ring, node)));
        }
    }
}

fn balance(machine: &BlockStepper, block: &RingBlock, before: &Before, lost: f64) -> Balance {
    let (mut kinetic, mut momentum) = (0.0, 0.0);
    for j in 0..block.n_own_joints {
        let inverse_mass = block.joints.inverse_masses[j];
        if inverse_mass > 0.0 {
            let (was, is) = (before.joints.velocities[j], block.joints.velocities[j]);
            kinetic += 0.5 * was * is / inverse_mass;
            momentum += 0.5 * (before.velocity(j) + is) / inverse_mass;
        }
    }
    let strain: f64 = block.strain_energy.iter().sum::<f64>() / machine.kernel.gain();
    let inner: f64 = block.kinetic_energy.iter().sum();
    let inner_momentum: f64 = block.momentum.iter().sum();
    let (drive, drive_lost, drive_momentum) =
        before.kick.map_or((0.0, 0.0, 0.0), |kick| (kick.energy, kick.lost, kick.momentum));
    Balance {
        held: strain + inner + kinetic + drive,
        lost: lost + drive_lost,
        momentum: inner_momentum + momentum + drive_momentum,
    }
}

/// Energy that the dampers of a block's rings took in the step just made.
fn lost(machine: &BlockStepper, block: &RingBlock, before: &Before) -> f64 {
    if !machine.is_damped() {
        return 0.0;
    }
    let moving = (0..block.n_own_joints).filter(|&j| block.joints.inverse_masses[j] > 0.0);
    let joints: f64 = moving
        .map(|j| {
            let mean = 0.5 * (before.joints.velocities[j] + block.joints.velocities[j]);
            mean * mean / block.joints.inverse_masses[j]
        })
        .sum();
    machine.kernel.decay() * (joints + 2.0 * block.mean_squares.iter().sum::<f64>())
}
