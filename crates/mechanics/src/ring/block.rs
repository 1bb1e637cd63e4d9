//! Eight neighbouring half rings in vectors, and a Verlet step of their inner nodes.

use pulp::{
    Simd, WithSimd,
    bytemuck::{cast_slice, cast_slice_mut},
};

use super::{
    clock::RingClock,
    kernel::{BEYOND, LARGE, MODERATE, NODE, RingForces, RingKernel, Rings, SMALL},
    rod::Rod,
    walls::Walls,
};
use crate::lanes::{self, Lanes, row::AlignedRow};

/// Rings handled together, whatever the machine's vectors are.
pub(crate) const RINGS: usize = 8;

/// Eight neighbouring half rings and the nine joints that they hang between, in the kernel's units.
///
/// Rings beyond the end of the chain fill the last block; they stay at rest.
#[derive(Debug)]
pub(crate) struct RingBlock {
    /// By vector of rings, then inner node, then value (x, y, and their velocities), then ring.
    nodes: AlignedRow,
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
    /// Joints that belong to this block alone: all but the last, which is its right neighbour's, or all.
    pub(crate) n_own_joints: usize,
    /// Whether the first joint is moved by the drive.
    is_driven: bool,
    /// What reached as far as its rings were deformed in the last step: [`SMALL`] or [`MODERATE`], which is tried first.
    reach: u8,
    /// Steps of rings that were bent beyond the fast functions' range.
    pub(crate) wide_steps: u64,
    /// Whether a ring was bent beyond any range.
    pub(crate) broken: bool,
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

/// What blocks share: the element loop, and how many rings go in a vector.
#[derive(Debug)]
pub(crate) struct BlockStepper {
    pub(crate) kernel: RingKernel,
    walls: Walls,
    /// Rings in a vector.
    lanes: usize,
    n_inner: usize,
}

impl BlockStepper {
    pub(crate) fn new(rod: &Rod, walls: Walls, clock: &RingClock) -> Self {
        let lanes = lanes::width().min(RINGS);
        let kernel = RingKernel::new(rod, clock.dt_s, clock.decay_per_s);
        Self { kernel, walls, lanes, n_inner: rod.n_elements() - 1 }
    }

    /// Room for the values that a step of one block keeps between its sweeps.
    pub(crate) fn scratch(&self) -> AlignedRow {
        AlignedRow::zeros(self.kernel.scratch_len() * RINGS)
    }

    pub(crate) fn block(
        &self,
        joints: Joints,
        n_rings: usize,
        n_own_joints: usize,
        is_driven: bool,
    ) -> RingBlock {
        RingBlock {
            nodes: AlignedRow::zeros(self.n_inner * NODE * RINGS),
            joints,
            is_ring: std::array::from_fn(|ring| if ring < n_rings { 1.0 } else { 0.0 }),
            ends: [[0.0; RINGS]; 2],
            strain_energy: [0.0; RINGS],
            kinetic_energy: [0.0; RINGS],
            mean_squares: [0.0; RINGS],
            momentum: [0.0; RINGS],
            n_own_joints,
            is_driven,
            reach: SMALL,
            wide_steps: 0,
            broken: false,
        }
    }

    /// Finds the forces in blocks and moves their inner nodes by a step; energies are booked on request.
    pub(crate) fn step(&self, blocks: &mut [RingBlock], scratch: &mut AlignedRow, book: bool) {
        match (book, self.kernel.keep() < 1.0) {
            (false, false) => {
                chainwave_vectors::dispatch(StepBlocks::<false, false> { machine: self, blocks, scratch });
            }
            (true, false) => {
                chainwave_vectors::dispatch(StepBlocks::<true, false> { machine: self, blocks, scratch });
            }
            (false, true) => {
                chainwave_vectors::dispatch(StepBlocks::<false, true> { machine: self, blocks, scratch });
            }
            (true, true) => {
                chainwave_vectors::dispatch(StepBlocks::<true, true> { machine: self, blocks, scratch });
            }
        }
    }

    /// Moves a block's joints by a step under the forces of its own rings and of the neighbours' outermost ones; a driven
    /// first joint has moved already.
    pub(crate) fn move_joints(&self, block: &mut RingBlock, left: f64, right: f64) {
        let RingBlock { joints, ends: [on_left, on_right], .. } = block;
        let keep = self.kernel.keep();
        let mut push = |joint: usize, force: f64| {
            let velocity = joints.velocities[joint] * keep + force * joints.inverse_masses[joint];
            joints.velocities[joint] = velocity;
            joints.places[joint] += velocity;
        };
        if !block.is_driven {
            push(0, left + on_left[0]);
        }
        for joint in 1..RINGS {
            push(joint, on_right[joint - 1] + on_left[joint]);
        }
        push(RINGS, on_right[RINGS - 1] + right);
    }

    /// Whether dampers take energy in each step.
    pub(crate) fn is_damped(&self) -> bool {
        self.kernel.decay() > 0.0
    }

    /// Inner nodes of a half ring.
    pub(crate) fn n_inner(&self) -> usize {
        self.n_inner
    }

    /// The first ring of a block whose walls touch, at the joints' places; `places_m` is room for one ring's.
    pub(crate) fn touching(&self, block: &RingBlock, places_m: &mut Vec<[f64; 2]>) -> Option<usize> {
        let length_m = self.kernel.length_m();
        if !self.may_touch(block) {
            return None;
        }
        let n_rings = block.is_ring.iter().filter(|is_ring| **is_ring > 0.0).count();
        (0..n_rings).find(|&ring| {
            let displacement = |node: usize| match node {
                0 => [block.joints.places[ring], 0.0],
                node if node > self.n_inner => [block.joints.places[ring + 1], 0.0],
                node => self.inner_place_before(block, ring, node - 1),
            };
            self.walls.put_places(places_m, |node| displacement(node).map(|moved| moved * length_m));
            self.walls.touch(places_m)
        })
    }

    /// Whether a node of a block has come to its mirror image, or a ring is so short that its sides may touch: all of them are asked at once, as
    /// hardly ever one has.
    fn may_touch(&self, block: &RingBlock) -> bool {
        let is_short =
            |ends: &[f64]| self.walls.is_shortened_by(self.kernel.length_m() * (ends[0] - ends[1]));
        let nearest_m = match self.lanes {
            8 => self.nearest_m::<8>(block),
            4 => self.nearest_m::<4>(block),
            2 => self.nearest_m::<2>(block),
            _ => self.nearest_m::<1>(block),
        };
        // Written so that values that are not numbers are looked at one by one.
        let is_clear = nearest_m >= self.walls.image_m() && !block.joints.places.windows(2).any(is_short);
        !is_clear
    }

    /// How near the axis an inner node is that rests far from it, before it last moved; `LANES` rings go in a vector.
    fn nearest_m<const LANES: usize>(&self, block: &RingBlock) -> f64 {
        let length_m = self.kernel.length_m();
        let rest_m = &self.walls.inner_far_m;
        let vectors = block.nodes.as_chunks::<LANES>().0.as_chunks::<NODE>().0;
        let mut nearest_m = [f64::INFINITY; LANES];
        chainwave_vectors::dispatch_loop(
            #[inline(always)]
            || {
                for nodes in vectors.chunks_exact(self.n_inner) {
                    for ([_, y, _, step], rest_m) in nodes.iter().zip(rest_m) {
                        for lane in 0..LANES {
                            let at_m = rest_m + (y[lane] - step[lane]) * length_m;
                            nearest_m[lane] = nearest_m[lane].min(at_m);
                        }
                    }
                }
            },
        );
        nearest_m.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Sets an inner node's displacement, and its velocity half a step before.
    pub(crate) fn set_inner(&self, block: &mut RingBlock, ring: usize, node: usize, values: [f64; NODE]) {
        let (at, nodes) = (self.index(ring, node), &mut block.nodes);
        for (k, value) in values.into_iter().enumerate() {
            nodes[at + k * self.lanes] = value;
        }
    }

    /// Displacement of a ring's inner node before it last moved, in the kernel's units.
    pub(crate) fn inner_place_before(&self, block: &RingBlock, ring: usize, node: usize) -> [f64; 2] {
        let (at, nodes) = (self.index(ring, node), &block.nodes);
        let before = |axis: usize| nodes[at + axis * self.lanes] - nodes[at + (axis + 2) * self.lanes];
        [before(0), before(1)]
    }

    /// Where the x of a ring's inner node stands; the other values follow at distances of a vector.
    fn index(&self, ring: usize, node: usize) -> usize {
        let (vector, lane) = (ring / self.lanes, ring % self.lanes);
        (vector * self.n_inner + node) * NODE * self.lanes + lane
    }
}

struct StepBlocks<'a, const BOOK: bool, const DAMPED: bool> {
    machine: &'a BlockStepper,
    blocks: &'a mut [RingBlock],
    scratch: &'a mut AlignedRow,
}

impl<const BOOK: bool, const DAMPED: bool> WithSimd for StepBlocks<'_, BOOK, DAMPED> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for block in self.blocks {
            self.machine.step_block::<S, BOOK, DAMPED>(simd, block, self.scratch);
        }
    }
}

impl BlockStepper {
    /// Steps a block's rings. All of a block go by the polynomials or roots that the one bent most asks for, so that no ring's digits
    /// depend on how many fit a vector. What reached in the last step is tried first, and where less would have, that in the next.
    #[inline(always)]
    fn step_block<S: Simd, const BOOK: bool, const DAMPED: bool>(
        &self,
        simd: S,
        block: &mut RingBlock,
        scratch: &mut AlignedRow,
    ) {
        let mut reach = block.reach;
        if reach == SMALL {
            reach = self.deform::<S, SMALL>(simd, block, scratch);
        }
        if reach == MODERATE {
            reach = self.deform::<S, MODERATE>(simd, block, scratch);
        }
        block.reach = reach.min(MODERATE);
        if reach >= LARGE {
            block.wide_steps += RINGS as u64;
            if self.deform::<S, LARGE>(simd, block, scratch) == BEYOND {
                block.broken = true;
                return;
            }
        }
        for first in (0..RINGS).step_by(S::F64_LANES) {
            let nodes = cast_slice_mut(&mut block.nodes[self.nodes_of::<S>(first)]);
            let kept = cast_slice_mut(&mut scratch[self.kept_of::<S>(first)]);
            let loaded = self.kernel.load::<S, BOOK>(simd, kept);
            let forces = self.kernel.push::<S, BOOK, DAMPED>(simd, nodes, kept, loaded);
            forces.store::<BOOK, DAMPED>(block, first);
        }
    }

    /// The first sweep over all rings of a block; what reaches as far as they are deformed.
    #[inline(always)]
    fn deform<S: Simd, const REACH: u8>(&self, simd: S, block: &RingBlock, scratch: &mut AlignedRow) -> u8 {
        let mut reach = SMALL;
        for first in (0..RINGS).step_by(S::F64_LANES) {
            let joints = self.joints::<S>(simd, block, first);
            let nodes = cast_slice(&block.nodes[self.nodes_of::<S>(first)]);
            let kept = cast_slice_mut(&mut scratch[self.kept_of::<S>(first)]);
            reach = reach.max(self.kernel.deform::<S, REACH>(simd, nodes, joints, kept));
        }
        reach
    }

    /// Places of the left and right joints of the rings from `first` on that fit a vector.
    #[inline(always)]
    fn joints<S: Simd>(&self, simd: S, block: &RingBlock, first: usize) -> [Rings<S>; 2] {
        let is_ring = Lanes::read(simd, &block.is_ring[first..]);
        let places = &block.joints.places;
        [Lanes::read(simd, &places[first..]) * is_ring, Lanes::read(simd, &places[first + 1..]) * is_ring]
    }

    /// Where a block's nodes of these rings stand.
    #[inline(always)]
    fn nodes_of<S: Simd>(&self, first: usize) -> std::ops::Range<usize> {
        let per_ring = self.n_inner * NODE;
        first * per_ring..(first + S::F64_LANES) * per_ring
    }

    /// Where the values stand that a step keeps of these rings between its sweeps.
    #[inline(always)]
    fn kept_of<S: Simd>(&self, first: usize) -> std::ops::Range<usize> {
        let per_ring = self.kernel.scratch_len();
        first * per_ring..(first + S::F64_LANES) * per_ring
    }
}

impl<S: Simd> RingForces<S> {
    /// Writes the values of the rings from `first` on.
    #[inline(always)]
    fn store<const BOOK: bool, const DAMPED: bool>(self, block: &mut RingBlock, first: usize) {
        self.ends[0].write(&mut block.ends[0][first..]);
        self.ends[1].write(&mut block.ends[1][first..]);
        if BOOK {
            self.strain_energy.write(&mut block.strain_energy[first..]);
            self.moved.kinetic_energy.write(&mut block.kinetic_energy[first..]);
            self.moved.momentum.write(&mut block.momentum[first..]);
        }
        if DAMPED {
            self.moved.mean_squares.write(&mut block.mean_squares[first..]);
        }
    }
}
