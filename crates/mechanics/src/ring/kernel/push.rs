//! Third sweep: normal and shear forces, and the nodes' motion by a step.

use pulp::Simd;

use super::{KEPT, NODE, NodeSums, RingForces, RingKernel, Rings, load, store};
use crate::lanes::Lanes;

/// The third sweep on its way to the left, between two elements.
struct Pushing<S: Simd> {
    simd: S,
    /// What the dampers leave of a velocity in a step.
    keep: Rings<S>,
    /// The node's moment.
    moment: Rings<S>,
    /// The force that the element to the right pulls it with.
    pull: [Rings<S>; 2],
    moved: NodeSums<S>,
}

impl RingKernel {
    /// Third sweep, from right to left: normal and shear forces, and the motion of the inner nodes by a step. `loaded` is what the second
    /// sweep returned.
    #[inline(always)]
    pub(crate) fn push<S: Simd, const BOOK: bool, const DAMPED: bool>(
        &self,
        simd: S,
        nodes: &mut [[S::f64s; NODE]],
        scratch: &[[S::f64s; KEPT]],
        [first_moment, strain_energy]: [Rings<S>; 2],
    ) -> RingForces<S> {
        let zero = Lanes::splat(simd, 0.0);
        let moved = NodeSums { kinetic_energy: zero, momentum: zero, mean_squares: zero };
        let mut ends = [zero; 2];
        let kept = &scratch[..self.elements.len()];
        let nodes = &mut nodes[..kept.len() - 1];
        if let ([first_node, nodes @ ..], [first, middle @ .., last]) = (nodes, kept) {
            let keep = Lanes::splat(simd, self.keep);
            let [moment, ..] = load(simd, last);
            let mut pushing = Pushing { simd, keep, moment, pull: ends, moved };
            let [left_moment, ..] = load(simd, middle.last().unwrap_or(first));
            pushing.pull = pushing.force(last, left_moment);
            ends[1] = -pushing.pull[0];
            for ((node, kept), left) in nodes.iter_mut().zip(middle).zip(&kept[..middle.len()]).rev() {
                let [left_moment, ..] = load(simd, left);
                pushing.pass::<BOOK, DAMPED>(node, kept, left_moment);
            }
            pushing.pass::<BOOK, DAMPED>(first_node, first, first_moment);
            ends[0] = pushing.pull[0];
            return RingForces { ends, strain_energy, moved: pushing.moved.scaled(simd) };
        }
        RingForces { ends, strain_energy, moved }
    }
}

impl<S: Simd> Pushing<S> {
    /// Passes an element and moves the node at its right.
    #[inline(always)]
    fn pass<const BOOK: bool, const DAMPED: bool>(
        &mut self,
        node: &mut [S::f64s; NODE],
        kept: &[S::f64s; KEPT],
        left_moment: Rings<S>,
    ) {
        let force = self.force(kept, left_moment);
        self.moved.push::<BOOK, DAMPED>(self.simd, self.keep, node, [force, self.pull]);
        self.pull = force;
    }

    /// The force that an element pulls its left node with, given the moment there, which is kept for the next.
    #[inline(always)]
    fn force(&mut self, kept: &[S::f64s; KEPT], left_moment: Rings<S>) -> [Rings<S>; 2] {
        let [_, normal, _, inverse_length, x, y] = load(self.simd, kept);
        let shear = (left_moment - self.moment) * inverse_length * inverse_length;
        let normal = normal * inverse_length;
        self.moment = left_moment;
        [shear.mul_sub_from(y, normal * x), shear.mul_add(x, normal * y)]
    }
}

impl<S: Simd> NodeSums<S> {
    /// Moves a node by a step; the forces pull it to the left and to the right.
    #[inline(always)]
    fn push<const BOOK: bool, const DAMPED: bool>(
        &mut self,
        simd: S,
        keep: Rings<S>,
        node: &mut [S::f64s; NODE],
        [left, right]: [[Rings<S>; 2]; 2],
    ) {
        let [x, y] = [Lanes::new(simd, [node[0]]), Lanes::new(simd, [node[1]])];
        let [before_x, before_y] = [Lanes::new(simd, [node[2]]), Lanes::new(simd, [node[3]])];
        let pulled = [right[0] - left[0], right[1] - left[1]];
        let [after_x, after_y] = match DAMPED {
            true => [before_x.mul_add(keep, pulled[0]), before_y.mul_add(keep, pulled[1])],
            false => [before_x + pulled[0], before_y + pulled[1]],
        };
        store([x + after_x, y + after_y, after_x, after_y], node);
        let (sum_x, sum_y) = (before_x + after_x, before_y + after_y);
        if BOOK {
            self.kinetic_energy = before_x.mul_add(after_x, before_y.mul_add(after_y, self.kinetic_energy));
            self.momentum = self.momentum + sum_x;
        }
        if DAMPED {
            self.mean_squares = sum_x.mul_add(sum_x, sum_y.mul_add(sum_y, self.mean_squares));
        }
    }

    /// The sums with the factors that are the same for all nodes.
    #[inline(always)]
    fn scaled(self, simd: S) -> Self {
        let half = Lanes::splat(simd, 0.5);
        Self {
            kinetic_energy: self.kinetic_energy * half,
            momentum: self.momentum * half,
            mean_squares: self.mean_squares * Lanes::splat(simd, 0.125),
        }
    }
}
