//! First sweep: stretch, rotation and turn of each element.

use pulp::Simd;

use super::reach::{self, LARGE, SMALL};
use super::{Element, KEPT, NODE, RingKernel, Rings, splat};
use crate::lanes::Lanes;

impl RingKernel {
    /// First sweep, from left to right: stretch and rotation of each chord, turn at each node, and the elimination in the
    /// theorem of three moments. `nodes` holds x, y and the velocities of each inner node; `joints` the places of the two
    /// joints. Returns the reach that the deformation asks for: where that is more than `REACH`, what was found means nothing.
    ///
    /// It goes in two loops, because a processor looks ahead by some hundred operations only: one long chain of them for
    /// each element would leave it waiting. Each takes two elements at a time, so that what one hands to the next stays in its register.
    #[inline(always)]
    pub(crate) fn deform<S: Simd, const REACH: u8>(
        &self,
        simd: S,
        nodes: &[[S::f64s; NODE]],
        joints: [Rings<S>; 2],
        scratch: &mut [[S::f64s; KEPT]],
    ) -> u8 {
        let largest_stretch = self.stretch::<S, REACH>(simd, nodes, joints, scratch);
        let largest_sine_square = self.turn::<S, REACH>(simd, scratch);
        reach::reach_of(REACH, largest_sine_square.largest(), largest_stretch.largest())
    }

    /// Keeps each chord, its rotation, as cosine and sine, its relative elongation and its inverse length. Returns the largest change of a
    /// squared length.
    ///
    /// Each element is drawn while the one before is still being measured, so that a processor finds work on two in its queues.
    #[inline(always)]
    fn stretch<S: Simd, const REACH: u8>(
        &self,
        simd: S,
        nodes: &[[S::f64s; NODE]],
        joints: [Rings<S>; 2],
        scratch: &mut [[S::f64s; KEPT]],
    ) -> Rings<S> {
        let zero = Lanes::splat(simd, 0.0);
        let mut stretching = Stretching {
            simd,
            inverse_root: splat(simd, reach::inverse_root(REACH)),
            place: [joints[0], zero],
            largest: zero,
        };
        let (
            [first, middle @ .., last],
            [first_kept, middle_kept @ .., last_kept, _],
            [first_node, nodes @ ..],
        ) = (self.elements.as_slice(), scratch, nodes)
        else {
            return zero;
        };
        let mut drawn = stretching.draw(first, place(simd, first_node), first_kept);
        let mut before = first_kept;
        let ((pairs, odd), (kept_pairs, odd_kept), (node_pairs, odd_node)) =
            (middle.as_chunks::<2>(), middle_kept.as_chunks_mut::<2>(), nodes.as_chunks::<2>());
        for (([left, right], [left_kept, right_kept]), [left_node, right_node]) in
            pairs.iter().zip(kept_pairs).zip(node_pairs)
        {
            let drawn_left = stretching.draw(left, place(simd, left_node), left_kept);
            stretching.measure::<REACH>(drawn, before);
            drawn = stretching.draw(right, place(simd, right_node), right_kept);
            stretching.measure::<REACH>(drawn_left, left_kept);
            before = right_kept;
        }
        for ((element, kept), node) in odd.iter().zip(odd_kept).zip(odd_node) {
            let next = stretching.draw(element, place(simd, node), kept);
            stretching.measure::<REACH>(drawn, before);
            (drawn, before) = (next, kept);
        }
        let next = stretching.draw(last, [joints[1], zero], last_kept);
        stretching.measure::<REACH>(drawn, before);
        stretching.measure::<REACH>(next, last_kept);
        stretching.largest
    }

    /// Puts the turn at each chord's left node, and the eliminated turn, in place of its rotation, and those of the last
    /// node behind. Returns the largest square of a sine.
    #[inline(always)]
    fn turn<S: Simd, const REACH: u8>(&self, simd: S, scratch: &mut [[S::f64s; KEPT]]) -> Rings<S> {
        let [zero, one] = splat(simd, [0.0, 1.0]);
        let mut turning = Turning {
            simd,
            to_turn: Arc::new(simd, self.turn_unit, reach::arc(REACH)),
            rotation: [one, zero],
            eliminated: zero,
            factor: 0.0,
            largest: zero,
        };
        let (inner, behind) = scratch.split_at_mut(self.elements.len());
        let ((pairs, odd), (kept_pairs, odd_kept)) =
            (self.elements.as_chunks::<2>(), inner.as_chunks_mut::<2>());
        for ([left, right], [left_kept, right_kept]) in pairs.iter().zip(kept_pairs) {
            turning.pass::<REACH>(left_kept);
            turning.factor = left.lower;
            turning.pass::<REACH>(right_kept);
            turning.factor = right.lower;
        }
        for (element, kept) in odd.iter().zip(odd_kept) {
            turning.pass::<REACH>(kept);
            turning.factor = element.lower;
        }
        // Behind the last chord the pole keeps its direction.
        (behind[0][0], behind[0][1]) = (one.vector(), zero.vector());
        turning.pass::<REACH>(&mut behind[0]);
        turning.largest
    }
}

/// The first loop on its way to the right, between two elements.
struct Stretching<S: Simd> {
    simd: S,
    inverse_root: [Rings<S>; 5],
    place: [Rings<S>; 2],
    /// The largest change of a squared length.
    largest: Rings<S>,
}

/// A chord in the frame of the unstressed one, over its length: (1 + along, sideways).
#[derive(Clone, Copy)]
struct Drawn<S: Simd> {
    along: Rings<S>,
    sideways: Rings<S>,
    /// Change of the squared length.
    stretch: Rings<S>,
    inverse_rest_length: f64,
}

impl<S: Simd> Stretching<S> {
    /// Draws an element's chord to its right node, which stands at `next`.
    #[inline(always)]
    fn draw(&mut self, element: &Element, next: [Rings<S>; 2], kept: &mut [S::f64s; KEPT]) -> Drawn<S> {
        let change = [next[0] - self.place[0], next[1] - self.place[1]];
        self.place = next;
        let [x, y] = splat(self.simd, element.chord);
        (kept[4], kept[5]) = ((x + change[0]).vector(), (y + change[1]).vector());
        let [ax, ay] = splat(self.simd, element.inverse);
        let along = ax.mul_add(change[0], ay * change[1]);
        let sideways = ay.mul_sub_from(change[0], ax * change[1]);
        let stretch = sideways.mul_add(sideways, along.mul_add(along, along + along));
        Drawn { along, sideways, stretch, inverse_rest_length: element.inverse_length }
    }

    /// Measures a chord that was drawn.
    #[inline(always)]
    fn measure<const REACH: u8>(&mut self, drawn: Drawn<S>, kept: &mut [S::f64s; KEPT]) {
        let Drawn { along, sideways, stretch, inverse_rest_length } = drawn;
        let one = Lanes::splat(self.simd, 1.0);
        let (inverse, elongation) = if REACH == LARGE {
            let length = (one + stretch).sqrt();
            (one / length, stretch / (one + length))
        } else {
            self.largest = self.largest.max(stretch.abs());
            let [a, b, c, d, _] = self.inverse_root;
            let shortening = match REACH {
                SMALL => polynomial(stretch, [a, b, c, d]),
                _ => polynomial(stretch, self.inverse_root),
            };
            let inverse = stretch.mul_sub_from(shortening, one);
            // sqrt(1 + e) - 1 = e (r - w) with r = 1 / sqrt(1 + e) = 1 - e w.
            (inverse, stretch * (inverse - shortening))
        };
        let [cosine, sine] = [along.mul_add(inverse, inverse), sideways * inverse];
        let inverse_length = inverse * Lanes::splat(self.simd, inverse_rest_length);
        (kept[0], kept[1]) = (cosine.vector(), sine.vector());
        (kept[2], kept[3]) = (elongation.vector(), inverse_length.vector());
    }
}

/// The second loop on its way to the right, between two nodes.
struct Turning<S: Simd> {
    simd: S,
    to_turn: Arc<S>,
    rotation: [Rings<S>; 2],
    eliminated: Rings<S>,
    factor: f64,
    /// The largest square of a sine.
    largest: Rings<S>,
}

impl<S: Simd> Turning<S> {
    /// Passes the node at the left of a chord whose rotation is kept.
    #[inline(always)]
    fn pass<const REACH: u8>(&mut self, kept: &mut [S::f64s; KEPT]) {
        let next = [Lanes::new(self.simd, [kept[0]]), Lanes::new(self.simd, [kept[1]])];
        let (turn, sine_square) = self.to_turn.between::<REACH>(self.rotation, next);
        self.rotation = next;
        self.eliminated = Lanes::splat(self.simd, self.factor).mul_sub_from(self.eliminated, turn);
        self.largest = self.largest.max(sine_square);
        (kept[0], kept[1]) = (turn.vector(), self.eliminated.vector());
    }
}

/// Turns between directions, in the kernel's unit.
#[derive(Clone, Copy)]
struct Arc<S: Simd> {
    simd: S,
    unit: Rings<S>,
    coefficients: [Rings<S>; 4],
}

impl<S: Simd> Arc<S> {
    #[inline(always)]
    fn new(simd: S, unit: f64, arc: [f64; 4]) -> Self {
        let unit = Lanes::splat(simd, unit);
        let mut coefficients = splat(simd, arc);
        for coefficient in &mut coefficients {
            *coefficient = *coefficient * unit;
        }
        Self { simd, unit, coefficients }
    }

    /// The turn from one direction to the next, and the square of the sine that it was found from.
    #[inline(always)]
    fn between<const REACH: u8>(self, from: [Rings<S>; 2], to: [Rings<S>; 2]) -> (Rings<S>, Rings<S>) {
        let sine = to[0].mul_sub_from(from[1], to[1] * from[0]);
        if REACH != LARGE {
            return self.of::<REACH>(sine);
        }
        let [one, half, eight] = splat(self.simd, [1.0, 0.5, 8.0]);
        // sin(phi / 2) = sin(phi) / (2 cos(phi / 2)), three times.
        let cosine = to[0].mul_add(from[0], to[1] * from[1]);
        let second = ((one + cosine) * half).sqrt();
        let fourth = ((one + second) * half).sqrt();
        let eighth = ((one + fourth) * half).sqrt();
        let (turn, square) = self.of::<REACH>(sine / (second * fourth * eighth * eight));
        (turn * eight, square)
    }

    /// The arc of a sine within reach, and the sine's square.
    #[inline(always)]
    fn of<const REACH: u8>(self, sine: Rings<S>) -> (Rings<S>, Rings<S>) {
        let square = sine * sine;
        let [a, b, c, _] = self.coefficients;
        let curve = match REACH {
            SMALL => polynomial(square, [a, b, c]),
            _ => polynomial(square, self.coefficients),
        };
        (curve.mul_add(square, self.unit) * sine, square)
    }
}

/// A polynomial, lowest power first. By Horner's scheme: elements are independent enough to hide its chain, so that the
/// number of products counts.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(of: Rings<S>, coefficients: [Rings<S>; N]) -> Rings<S> {
    let mut sum = coefficients[N - 1];
    for &coefficient in coefficients[..N - 1].iter().rev() {
        sum = sum.mul_add(of, coefficient);
    }
    sum
}

/// Where a node stands.
#[inline(always)]
fn place<S: Simd>(simd: S, node: &[S::f64s; NODE]) -> [Rings<S>; 2] {
    [Lanes::new(simd, [node[0]]), Lanes::new(simd, [node[1]])]
}
