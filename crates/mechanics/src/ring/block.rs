use nalgebra::DVector;
use pulp::{Simd, WithSimd, bytemuck::cast_slice_mut};

use super::{
    Rod,
    kernel::{Kernel, NODE, Outcome},
    lanes::Lanes,
    record::Before,
};

/// Rings handled together, whatever the machine's vectors are.
pub(crate) const RINGS: usize = 8;
/// Bytes to which vectors are aligned in memory.
const ALIGNMENT: usize = 64;

/// Eight neighbouring half rings and the nine joints that they hang between, in the kernel's units.
///
/// Rings beyond the end of the chain fill the last block; they stay at rest.
#[derive(Debug)]
pub(crate) struct Block {
    /// By vector of rings, then inner node, then value (x, y, and their velocities), then ring.
    nodes: Aligned,
    /// The outermost two are shared with the neighbours, which move their own copies in the same way.
    pub(crate) joints: Joints,
    /// 1 for each ring of the chain, 0 beyond its end: those stay at rest.
    is_ring: [f64; RINGS],
    /// Forces of the rings on their left and right joints, at the joints' present places.
    pub(crate) ends: [[f64; RINGS]; 2],
    /// Strain energy of each ring, when last booked.
    pub(crate) strain_energy: [f64; RINGS],
    /// Kinetic energy of each ring's inner nodes, when last booked.
    pub(crate) kinetic_energy: [f64; RINGS],
    /// Half the velocities squared of each ring's inner nodes, each the mean over the last step, where dampers take them.
    pub(crate) mean_squares: [f64; RINGS],
    /// Momentum of each ring's inner nodes along the chain, when last booked.
    pub(crate) momentum: [f64; RINGS],
    /// Energy that the rings' dampers took.
    pub(crate) lost: f64,
    /// Joints that belong to this block alone: all but the last, which is its right neighbour's, or all.
    pub(crate) n_own_joints: usize,
    /// Steps of rings by the slower, exact functions.
    pub(crate) exact_steps: u64,
}

/// Nine joints in the kernel's units.
#[derive(Debug, Clone, Default)]
pub(crate) struct Joints {
    pub(crate) places: [f64; RINGS + 1],
    /// Half a step before the places.
    pub(crate) velocities: [f64; RINGS + 1],
    /// Zero where a joint does not move by itself.
    pub(crate) inverse_masses: [f64; RINGS + 1],
}

/// Values that begin where a vector may.
#[derive(Debug)]
pub(crate) struct Aligned {
    values: Vec<f64>,
    first: usize,
    len: usize,
}

impl Aligned {
    pub(crate) fn zeros(len: usize) -> Self {
        let values = vec![0.0; len + ALIGNMENT / size_of::<f64>()];
        let first = values.as_ptr().align_offset(ALIGNMENT).min(ALIGNMENT / size_of::<f64>());
        Self { values, first, len }
    }

    fn get(&self) -> &[f64] {
        &self.values[self.first..self.first + self.len]
    }

    fn get_mut(&mut self) -> &mut [f64] {
        &mut self.values[self.first..self.first + self.len]
    }
}

/// What blocks share: the loop, its exact counterpart, and the instruction set.
#[derive(Debug)]
pub(crate) struct Machine {
    pub(crate) kernel: Kernel,
    pub(crate) rod: Rod,
    arch: pulp::Arch,
    /// Rings in a vector.
    lanes: usize,
    n_inner: usize,
    units: ExactUnits,
}

/// Kernel units of what the rod gives in SI units.
#[derive(Debug, Clone, Copy)]
struct ExactUnits {
    force: f64,
    energy: f64,
}

impl Machine {
    pub(crate) fn new(rod: Rod, dt_s: f64, decay_per_s: f64) -> Self {
        let arch = pulp::Arch::new();
        let kernel = Kernel::new(&rod, dt_s, decay_per_s);
        let (h, element_kg) = (rod.arc_m, rod.section().mass_kg_per_m * rod.arc_m);
        let force = kernel.gain() * dt_s * dt_s / (element_kg * h);
        let lanes = arch.dispatch(CountLanes).min(RINGS);
        let n_inner = rod.n_elements() - 1;
        Self { kernel, rod, arch, lanes, n_inner, units: ExactUnits { force, energy: force / h } }
    }

    /// Room for the values that a step of one block keeps between its sweeps.
    pub(crate) fn scratch(&self) -> Aligned {
        Aligned::zeros(self.kernel.scratch_len() * RINGS)
    }

    pub(crate) fn block(&self, joints: Joints, n_rings: usize, n_own_joints: usize) -> Block {
        Block {
            nodes: Aligned::zeros(self.n_inner * NODE * RINGS),
            joints,
            is_ring: std::array::from_fn(|ring| if ring < n_rings { 1.0 } else { 0.0 }),
            ends: [[0.0; RINGS]; 2],
            strain_energy: [0.0; RINGS],
            kinetic_energy: [0.0; RINGS],
            mean_squares: [0.0; RINGS],
            momentum: [0.0; RINGS],
            lost: 0.0,
            n_own_joints,
            exact_steps: 0,
        }
    }

    /// Finds the forces in a block and moves its inner nodes by a step; energies are booked on request.
    pub(crate) fn step(&self, block: &mut Block, scratch: &mut Aligned, book: bool) {
        match (book, self.kernel.keep() < 1.0) {
            (false, false) => self.arch.dispatch(Step::<false, false> { machine: self, block, scratch }),
            (true, false) => self.arch.dispatch(Step::<true, false> { machine: self, block, scratch }),
            (false, true) => self.arch.dispatch(Step::<false, true> { machine: self, block, scratch }),
            (true, true) => self.arch.dispatch(Step::<true, true> { machine: self, block, scratch }),
        }
    }

    /// Moves a block's joints by a step under the forces of its own rings and of the neighbours' outermost ones.
    pub(crate) fn move_joints(&self, block: &mut Block, left: f64, right: f64) {
        let Block { joints, ends: [on_left, on_right], .. } = block;
        let mut forces = [left; RINGS + 1];
        forces[1..].copy_from_slice(on_right);
        for (force, on_left) in forces.iter_mut().zip(on_left.iter().chain([&right])) {
            *force += on_left;
        }
        let keep = self.kernel.keep();
        for j in 0..=RINGS {
            joints.velocities[j] = joints.velocities[j] * keep + forces[j] * joints.inverse_masses[j];
            joints.places[j] += joints.velocities[j];
        }
    }

    /// Energy that the dampers of a block's rings took in the step that its nodes and joints just made.
    pub(crate) fn lost(&self, block: &Block, before: &Before) -> f64 {
        let decay = self.kernel.decay();
        if decay == 0.0 {
            return 0.0;
        }
        let joints = (0..block.n_own_joints).filter(|&j| block.joints.inverse_masses[j] > 0.0);
        let joints: f64 = joints
            .map(|j| {
                let mean = 0.5 * (before.velocities[j] + block.joints.velocities[j]);
                mean * mean / block.joints.inverse_masses[j]
            })
            .sum();
        decay * (joints + 2.0 * block.mean_squares.iter().sum::<f64>())
    }

    /// Inner nodes of a half ring.
    pub(crate) fn n_inner(&self) -> usize {
        self.n_inner
    }

    /// Displacement of a ring's inner node in units of an element's length.
    fn inner_place(&self, block: &Block, ring: usize, node: usize) -> [f64; 2] {
        let (at, nodes) = (self.index(ring, node), block.nodes.get());
        [nodes[at], nodes[at + self.lanes]]
    }

    /// The same one step earlier.
    pub(crate) fn inner_place_before(&self, block: &Block, ring: usize, node: usize) -> [f64; 2] {
        let (at, nodes) = (self.index(ring, node), block.nodes.get());
        let before = |axis: usize| nodes[at + axis * self.lanes] - nodes[at + (axis + 2) * self.lanes];
        [before(0), before(1)]
    }

    /// Where the x of a ring's inner node stands; the other values follow at distances of a vector.
    fn index(&self, ring: usize, node: usize) -> usize {
        let (vector, lane) = (ring / self.lanes, ring % self.lanes);
        (vector * self.n_inner + node) * NODE * self.lanes + lane
    }

    /// The step of some rings by the rod's own, slower functions, where a ring is bent beyond the kernel's polynomials.
    fn step_exactly(&self, block: &mut Block, rings: std::ops::Range<usize>) {
        block.exact_steps += rings.len() as u64;
        for ring in rings {
            let unknowns = self.unknowns_m(block, ring);
            let response = self.rod.response(&unknowns);
            let forces = response.forces * self.units.force;
            let n = self.n_inner + 1;
            block.ends[0][ring] = -forces[0];
            block.ends[1][ring] = -forces[2 * n];
            block.strain_energy[ring] = response.energy_j * self.units.energy;
            let (mut products, mut squares, mut momentum) = (0.0, 0.0, 0.0);
            for node in 0..self.n_inner {
                for axis in 0..2 {
                    let at = self.index(ring, node) + axis * self.lanes;
                    let nodes = block.nodes.get_mut();
                    let before = nodes[at + 2 * self.lanes];
                    let after = before * self.kernel.keep() - forces[2 * node + 2 + axis];
                    nodes[at + 2 * self.lanes] = after;
                    nodes[at] += after;
                    products += before * after;
                    squares += (before + after) * (before + after);
                    momentum += if axis == 0 { 0.5 * (before + after) } else { 0.0 };
                }
            }
            block.kinetic_energy[ring] = 0.5 * products;
            block.mean_squares[ring] = 0.125 * squares;
            block.momentum[ring] = momentum;
        }
    }

    /// Displacements of a ring in metres, as the rod takes them.
    fn unknowns_m(&self, block: &Block, ring: usize) -> DVector<f64> {
        let mut unknowns = DVector::zeros(self.rod.n_unknowns());
        let joint_m = |joint: usize| block.joints.places[joint] * block.is_ring[ring] * self.rod.arc_m;
        unknowns[0] = joint_m(ring);
        for node in 0..self.n_inner {
            let [x, y] = self.inner_place(block, ring, node);
            unknowns[2 * node + 2] = x * self.rod.arc_m;
            unknowns[2 * node + 3] = y * self.rod.arc_m;
        }
        unknowns[2 * (self.n_inner + 1)] = joint_m(ring + 1);
        unknowns
    }
}

struct CountLanes;

impl WithSimd for CountLanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

struct Step<'a, const BOOK: bool, const DAMPED: bool> {
    machine: &'a Machine,
    block: &'a mut Block,
    scratch: &'a mut Aligned,
}

impl<const BOOK: bool, const DAMPED: bool> WithSimd for Step<'_, BOOK, DAMPED> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { machine, block, scratch } = self;
        let lanes = S::F64_LANES;
        let per_vector = machine.n_inner * NODE * lanes;
        let kept = cast_slice_mut(&mut scratch.get_mut()[..machine.kernel.scratch_len() * lanes]);
        for vector in 0..RINGS / lanes {
            let first = vector * lanes;
            let load = |values: &[f64]| Lanes::new(simd, S::as_simd_f64s(&values[..lanes]).0[0]);
            let is_ring = load(&block.is_ring[first..]);
            let joints =
                [first, first + 1].map(|joint| load(&block.joints.places[joint..]) * is_ring);
            let nodes = &mut block.nodes.get_mut()[vector * per_vector..(vector + 1) * per_vector];
            let outcome = machine.kernel.step::<S, BOOK, DAMPED>(simd, cast_slice_mut(nodes), joints, kept);
            match outcome {
                Some(outcome) => outcome.store::<BOOK, DAMPED>(block, first),
                None => machine.step_exactly(block, first..first + lanes),
            }
        }
    }
}

impl<S: Simd> Outcome<S> {
    /// Writes the values of the rings from `first` on.
    #[inline(always)]
    fn store<const BOOK: bool, const DAMPED: bool>(self, block: &mut Block, first: usize) {
        let lanes = first..first + S::F64_LANES;
        let write = |to: &mut [f64; RINGS], from: Lanes<S>| {
            let (vectors, _) = S::as_mut_simd_f64s(&mut to[lanes.clone()]);
            vectors[0] = from.values;
        };
        write(&mut block.ends[0], self.ends[0]);
        write(&mut block.ends[1], self.ends[1]);
        if BOOK {
            write(&mut block.strain_energy, self.strain_energy);
            write(&mut block.kinetic_energy, self.moved.kinetic_energy);
            write(&mut block.momentum, self.moved.momentum);
        }
        if DAMPED {
            write(&mut block.mean_squares, self.moved.mean_squares);
        }
    }
}
