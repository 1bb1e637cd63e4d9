use super::{
    block::{Block, Machine, RINGS},
    driver::Kick,
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
    /// Place and velocity of the striker.
    pub(crate) striker: Vec<[f64; 2]>,
    /// Displacements of the inner nodes of each ring, where they are asked for.
    pub(crate) shapes: Vec<[f64; 2]>,
    pub(crate) with_shapes: bool,
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

/// Places and velocities of a block's joints before they moved, and what the drive did.
pub(crate) struct Before {
    pub(crate) places: [f64; RINGS + 1],
    pub(crate) velocities: [f64; RINGS + 1],
    pub(crate) kick: Option<Kick>,
}

impl BlockRecord {
    /// Writes an output; the block's joints and nodes have moved by half of the step that the output stands between.
    pub(crate) fn write(&mut self, machine: &Machine, block: &Block, before: &Before, output: usize) {
        if self.motion.is_empty() {
            self.first_output = output;
        }
        let after = &block.joints.velocities;
        let velocities = std::array::from_fn(|j| 0.5 * (before.velocities[j] + after[j]));
        self.motion.push([before.places, velocities]);
        self.balances.push(balance(machine, block, before));
        for (peak, energy) in self.peak_energies.iter_mut().zip(&block.strain_energy) {
            *peak = peak.max(*energy / machine.kernel.gain());
        }
        if let Some([place, velocity_before, velocity_after]) = before.kick.and_then(|kick| kick.striker) {
            self.striker.push([place, 0.5 * (velocity_before + velocity_after)]);
        }
        if self.with_shapes {
            // The inner nodes have moved on already, by their present velocity.
            let rings = (0..RINGS).flat_map(|ring| (0..machine.n_inner()).map(move |node| (ring, node)));
            self.shapes.extend(rings.map(|(ring, node)| machine.inner_place_before(block, ring, node)));
        }
    }
}

fn balance(machine: &Machine, block: &Block, before: &Before) -> Balance {
    let (mut kinetic, mut momentum) = (0.0, 0.0);
    for j in 0..block.n_own_joints {
        let inverse_mass = block.joints.inverse_masses[j];
        if inverse_mass > 0.0 {
            let (was, is) = (before.velocities[j], block.joints.velocities[j]);
            kinetic += 0.5 * was * is / inverse_mass;
            momentum += 0.5 * (was + is) / inverse_mass;
        }
    }
    let strain: f64 = block.strain_energy.iter().sum::<f64>() / machine.kernel.gain();
    let inner: f64 = block.kinetic_energy.iter().sum();
    let inner_momentum: f64 = block.momentum.iter().sum();
    let (drive, drive_lost, drive_momentum) =
        before.kick.map_or((0.0, 0.0, 0.0), |kick| (kick.energy, kick.lost, kick.momentum));
    Balance {
        held: strain + inner + kinetic + drive,
        lost: block.lost + drive_lost,
        momentum: inner_momentum + momentum + drive_momentum,
    }
}
