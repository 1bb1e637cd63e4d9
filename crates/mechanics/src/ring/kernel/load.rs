//! Second sweep: moments and normal forces.

use pulp::Simd;

use super::{Element, KEPT, RingKernel, Rings, load, splat};
use crate::lanes::Lanes;

/// The second sweep on its way to the left, between two elements.
struct Loading<S: Simd> {
    simd: S,
    /// The node's turn; twice that at an end, where it is the turn over half an element.
    turn: Rings<S>,
    /// Its moment by bending alone, and with the bulge's part of the element to the right.
    bending: Rings<S>,
    moment: Rings<S>,
    strain_energy: Rings<S>,
}

impl RingKernel {
    /// Second sweep, from right to left: puts the moment at each element's right node, and its normal force, in place of its turns. Returns
    /// the moment at the first node, and the strain energy where it is asked for.
    #[inline(always)]
    pub(crate) fn load<S: Simd, const BOOK: bool>(
        &self,
        simd: S,
        scratch: &mut [[S::f64s; KEPT]],
    ) -> [Rings<S>; 2] {
        let zero = Lanes::splat(simd, 0.0);
        let (inner, behind) = scratch.split_at_mut(self.elements.len());
        let [turn, eliminated, ..] = load(simd, &behind[0]);
        let bending = eliminated * Lanes::splat(simd, self.last_bending_pivot);
        let strain_energy = if BOOK { bending * turn } else { zero };
        let mut loading = Loading { simd, turn: turn + turn, bending, moment: bending, strain_energy };
        let ([first, middle @ .., last], [first_kept, middle_kept @ .., last_kept]) =
            (self.elements.as_slice(), inner)
        else {
            return [zero; 2];
        };
        loading.pass::<BOOK, false, true>(last, last_kept);
        for (element, kept) in middle.iter().zip(middle_kept).rev() {
            loading.pass::<BOOK, false, false>(element, kept);
        }
        loading.pass::<BOOK, true, false>(first, first_kept);
        [loading.moment, loading.strain_energy * Lanes::splat(simd, 0.5 / self.turn_unit)]
    }
}

impl<S: Simd> Loading<S> {
    /// Passes an element, the first or the last of the half ring or one between.
    #[inline(always)]
    fn pass<const BOOK: bool, const FIRST: bool, const LAST: bool>(
        &mut self,
        element: &Element,
        kept: &mut [S::f64s; KEPT],
    ) {
        let [left_turn, eliminated, elongation, ..] = load(self.simd, kept);
        let [lower, pivot, axial] = splat(self.simd, [element.lower, element.bending_pivot, element.axial]);
        let bending = lower.mul_sub_from(self.bending, eliminated * pivot);
        let (left, right) = (if FIRST { left_turn + left_turn } else { left_turn }, self.turn);
        let [a, b] = splat(self.simd, element.turns);
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
        if BOOK {
            self.strain_energy = self.strain_energy + bending.mul_add(left_turn, normal * normal);
        }
        (self.turn, self.bending, self.moment) = (left, bending, moment);
        (kept[0], kept[1]) = (right_moment.vector(), normal.vector());
    }
}
