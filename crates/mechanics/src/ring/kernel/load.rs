//! Second sweep: moments, normal and shear forces, and the nodes' motion by a step.

use pulp::Simd;

use super::{Element, KEPT, NODE, NodeSums, RingForces, RingKernel, Rings, load, splat, store};
use crate::lanes::Lanes;

/// The second sweep on its way to the left, between two elements.
#[derive(Clone, Copy)]
struct Sweep<S: Simd> {
    /// PhasePoint of the node.
    place: [Rings<S>; 2],
    /// Its turn; twice that at an end, where it is the turn over half an element.
    turn: Rings<S>,
    /// Its moment by bending alone, and with the bulge's part of the element to the right.
    bending: Rings<S>,
    moment: Rings<S>,
    strain_energy: Rings<S>,
}

/// An element whose force is known but for the moment at its left.
#[derive(Clone, Copy)]
struct Loaded<S: Simd> {
    /// The deformed chord.
    chord: [Rings<S>; 2],
    /// Normal force and one, over the chord's length.
    normal: Rings<S>,
    inverse_length: Rings<S>,
    right_moment: Rings<S>,
}

impl RingKernel {
    /// Second sweep, from right to left: moments, normal and shear forces, and the motion of the inner nodes by a step.
    #[inline(always)]
    pub(crate) fn load_and_move<S: Simd, const BOOK: bool, const DAMPED: bool>(
        &self,
        simd: S,
        nodes: &mut [[S::f64s; NODE]],
        joints: [Rings<S>; 2],
        scratch: &[[S::f64s; KEPT]],
    ) -> RingForces<S> {
        let zero = Lanes::splat(simd, 0.0);
        let keep = Lanes::splat(simd, self.keep);
        let (elements, scratch) = (self.elements.as_slice(), &scratch[..=self.elements.len()]);
        let last = elements.len() - 1;
        let [turn, eliminated, ..] = load(simd, &scratch[last + 1]);
        let bending = eliminated * Lanes::splat(simd, self.last_bending_pivot);
        let mut sweep = Sweep {
            place: [joints[1], zero],
            turn: turn + turn,
            bending,
            moment: bending,
            strain_energy: if BOOK { bending * turn } else { zero },
        };
        let mut moved = NodeSums { kinetic_energy: zero, momentum: zero, mean_squares: zero };
        // Lengths that the compiler sees, so that it asks for none of them in the loop.
        let nodes = &mut nodes[..last];
        let mut loaded = sweep.load::<BOOK, false, true>(
            simd,
            &elements[last],
            &scratch[last],
            place(simd, &nodes[last - 1]),
        );
        let mut right = [zero; 2];
        let mut right_end = zero;
        for e in (1..last).rev() {
            let at_left = place(simd, &nodes[e - 1]);
            let next = sweep.load::<BOOK, false, false>(simd, &elements[e], &scratch[e], at_left);
            let force = loaded.force(next.right_moment);
            if e + 1 < last {
                moved.push::<BOOK, DAMPED>(simd, keep, &mut nodes[e + 1], [force, right]);
            } else {
                right_end = -force[0];
            }
            (loaded, right) = (next, force);
        }
        let first = sweep.load::<BOOK, true, false>(simd, &elements[0], &scratch[0], [joints[0], zero]);
        let force = loaded.force(first.right_moment);
        if last > 1 {
            moved.push::<BOOK, DAMPED>(simd, keep, &mut nodes[1], [force, right]);
        } else {
            right_end = -force[0];
        }
        right = force;
        let force = first.force(sweep.moment);
        moved.push::<BOOK, DAMPED>(simd, keep, &mut nodes[0], [force, right]);
        let left_end = force[0];
        RingForces {
            ends: [left_end, right_end],
            strain_energy: sweep.strain_energy * Lanes::splat(simd, 0.5 / self.turn_unit),
            moved: moved.scaled(simd),
        }
    }
}

/// Where a node stands.
#[inline(always)]
fn place<S: Simd>(simd: S, node: &[S::f64s; NODE]) -> [Rings<S>; 2] {
    [Lanes::new(simd, [node[0]]), Lanes::new(simd, [node[1]])]
}

impl<S: Simd> Sweep<S> {
    /// Passes an element, the first or the last of the half ring or one between, whose left node is at `place`.
    #[inline(always)]
    fn load<const BOOK: bool, const FIRST: bool, const LAST: bool>(
        &mut self,
        simd: S,
        element: &Element,
        kept: &[S::f64s; KEPT],
        place: [Rings<S>; 2],
    ) -> Loaded<S> {
        let [left_turn, eliminated, inverse_stretch, elongation] = load(simd, kept);
        let [lower, pivot, axial, inverse_rest_length] =
            splat(simd, [element.lower, element.bending_pivot, element.axial, element.inverse_length]);
        let bending = lower.mul_sub_from(self.bending, eliminated * pivot);
        let (left, right) = (if FIRST { left_turn + left_turn } else { left_turn }, self.turn);
        let [a, b] = splat(simd, element.turns);
        let (left_sum, right_sum) = (a + left + right, b + right);
        let bulge = left.mul_add(left_sum, right * right_sum);
        let normal = elongation.mul_add(axial, bulge);
        let (left_slope, right_slope) = (left_sum + left, right_sum + right + left);
        let mut right_moment = normal.mul_add(right_slope, self.moment);
        if LAST {
            right_moment = normal.mul_add(right_slope, right_moment);
        }
        let mut moment = normal.mul_add(left_slope, bending);
        if FIRST {
            moment = normal.mul_add(left_slope, moment);
        }
        let at_rest = splat(simd, element.chord);
        let chord = [at_rest[0] + (self.place[0] - place[0]), at_rest[1] + (self.place[1] - place[1])];
        let mut strain_energy = self.strain_energy;
        if BOOK {
            strain_energy = strain_energy + bending.mul_add(left_turn, normal * normal);
        }
        *self = Self { place, turn: left, bending, moment, strain_energy };
        let inverse_length = inverse_stretch * inverse_rest_length;
        Loaded { chord, normal: normal * inverse_length, inverse_length, right_moment }
    }
}

impl<S: Simd> Loaded<S> {
    /// The force that the element pulls its left node with, given the moment there.
    #[inline(always)]
    fn force(self, left_moment: Rings<S>) -> [Rings<S>; 2] {
        let Self { chord: [x, y], normal, inverse_length, right_moment } = self;
        let shear = (left_moment - right_moment) * inverse_length * inverse_length;
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
