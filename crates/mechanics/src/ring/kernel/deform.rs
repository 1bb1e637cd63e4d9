//! First sweep: stretch, rotation and turn of each element.

use pulp::Simd;

use super::{KEPT, NODE, RingKernel, Rings, splat, store};
use crate::lanes::Lanes;

/// Largest sine whose arc the polynomial gives: changes of turn up to 15 degrees without, and 120 with three halvings.
const LARGEST_SINE: f64 = 0.258_819_045_102_520_8;
/// Largest change of a chord's squared length, relative to it, for which the polynomial of its root stands.
const LARGEST_STRETCH: f64 = 0.03;
/// (asin(s) - s) / s^3 as a polynomial in s^2, lowest power first: relative error of the arc 2.5e-10 up to
/// [`LARGEST_SINE`] (interpolated at Chebyshev's nodes).
const ARC: [f64; 4] =
    [0.166_666_662_752_550_42, 0.075_001_866_734_998_9, 0.044_504_748_268_945_1, 0.033_607_901_190_141_75];
/// (1 - 1 / sqrt(1 + e)) / e as a polynomial in e, lowest power first: the root's relative error is 2e-11 up to
/// [`LARGEST_STRETCH`] (interpolated at Chebyshev's nodes, the first coefficient exact so that small stretches keep their
/// digits).
const INVERSE_ROOT: [f64; 5] = [
    0.5,
    -0.374_999_977_141_516,
    0.312_499_978_773_980_47,
    -0.273_640_666_624_914_6,
    0.246_282_406_934_921_35,
];

impl RingKernel {
    /// First sweep, from left to right: stretch and rotation of each chord, turn at each node, and the elimination in the
    /// theorem of three moments. `nodes` holds x, y and the velocities of each inner node; `joints` the places of the two
    /// joints. False where a ring is deformed beyond the polynomials' range, which is that of large deformations where it is
    /// to be `WIDE`.
    ///
    /// It goes in two loops, because a processor looks ahead by some hundred operations only: one long chain of them for
    /// each element would leave it waiting.
    #[inline(always)]
    pub(crate) fn deform<S: Simd, const WIDE: bool>(
        &self,
        simd: S,
        nodes: &[[S::f64s; NODE]],
        joints: [Rings<S>; 2],
        scratch: &mut [[S::f64s; KEPT]],
    ) -> bool {
        let largest_stretch = self.stretch::<S, WIDE>(simd, nodes, joints, scratch);
        let largest_sine_square = self.turn::<S, WIDE>(simd, scratch);
        // Written so that values that are not numbers do not pass.
        largest_sine_square.largest() <= LARGEST_SINE * LARGEST_SINE
            && (WIDE || largest_stretch.largest() <= LARGEST_STRETCH)
    }

    /// Keeps each chord's rotation, as cosine and sine, its inverse stretch, and its relative elongation. Returns the
    /// largest change of a squared length.
    #[inline(always)]
    fn stretch<S: Simd, const WIDE: bool>(
        &self,
        simd: S,
        nodes: &[[S::f64s; NODE]],
        joints: [Rings<S>; 2],
        scratch: &mut [[S::f64s; KEPT]],
    ) -> Rings<S> {
        let [zero, one] = splat(simd, [0.0, 1.0]);
        let inverse_root = splat(simd, INVERSE_ROOT);
        let (mut place, mut largest) = ([joints[0], zero], zero);
        for (e, (element, kept)) in self.elements.iter().zip(scratch.iter_mut()).enumerate() {
            let next = match nodes.get(e) {
                Some(node) => [Lanes::new(simd, [node[0]]), Lanes::new(simd, [node[1]])],
                None => [joints[1], zero],
            };
            let change = [next[0] - place[0], next[1] - place[1]];
            place = next;
            // In the frame of the unstressed chord, over its length, the chord is now (1 + along, sideways).
            let [ax, ay] = splat(simd, element.inverse);
            let along = ax.mul_add(change[0], ay * change[1]);
            let sideways = ay.mul_sub_from(change[0], ax * change[1]);
            let stretch = sideways.mul_add(sideways, along.mul_add(along, along + along));
            let (inverse, elongation) = if WIDE {
                let length = (one + stretch).sqrt();
                (one / length, stretch / (one + length))
            } else {
                largest = largest.max(stretch.abs());
                let shortening = polynomial(stretch, inverse_root);
                let inverse = stretch.mul_sub_from(shortening, one);
                // sqrt(1 + e) - 1 = e (r - w) with r = 1 / sqrt(1 + e) = 1 - e w.
                (inverse, stretch * (inverse - shortening))
            };
            let [cosine, sine] = [along.mul_add(inverse, inverse), sideways * inverse];
            store([cosine, sine, inverse, elongation], kept);
        }
        largest
    }

    /// Puts the turn at each chord's left node, and the eliminated turn, in place of its rotation, and those of the last
    /// node behind. Returns the largest square of a sine.
    #[inline(always)]
    fn turn<S: Simd, const WIDE: bool>(&self, simd: S, scratch: &mut [[S::f64s; KEPT]]) -> Rings<S> {
        let [zero, one] = splat(simd, [0.0, 1.0]);
        let to_turn = Arc::new(simd, self.turn_unit);
        let mut rotation = [one, zero];
        let (mut eliminated, mut factor, mut largest) = (zero, 0.0, zero);
        // Behind the last chord the pole keeps its direction.
        let n = self.elements.len();
        (scratch[n][0], scratch[n][1]) = (one.vector(), zero.vector());
        let factors = self.elements.iter().map(|element| element.lower).chain([0.0]);
        for (kept, next_factor) in scratch.iter_mut().zip(factors) {
            let next = [Lanes::new(simd, [kept[0]]), Lanes::new(simd, [kept[1]])];
            let (turn, sine_square) = to_turn.between::<WIDE>(rotation, next);
            rotation = next;
            eliminated = Lanes::splat(simd, factor).mul_sub_from(eliminated, turn);
            factor = next_factor;
            largest = largest.max(sine_square);
            (kept[0], kept[1]) = (turn.vector(), eliminated.vector());
        }
        largest
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
    fn new(simd: S, unit: f64) -> Self {
        let unit = Lanes::splat(simd, unit);
        let mut coefficients = splat(simd, ARC);
        for coefficient in &mut coefficients {
            *coefficient = *coefficient * unit;
        }
        Self { simd, unit, coefficients }
    }

    /// The turn from one direction to the next, and the square of the sine that it was found from.
    #[inline(always)]
    fn between<const WIDE: bool>(self, from: [Rings<S>; 2], to: [Rings<S>; 2]) -> (Rings<S>, Rings<S>) {
        let sine = to[0].mul_sub_from(from[1], to[1] * from[0]);
        if !WIDE {
            return self.of(sine);
        }
        let [one, half, eight] = splat(self.simd, [1.0, 0.5, 8.0]);
        // sin(phi / 2) = sin(phi) / (2 cos(phi / 2)), three times.
        let cosine = to[0].mul_add(from[0], to[1] * from[1]);
        let second = ((one + cosine) * half).sqrt();
        let fourth = ((one + second) * half).sqrt();
        let eighth = ((one + fourth) * half).sqrt();
        let (turn, square) = self.of(sine / (second * fourth * eighth * eight));
        (turn * eight, square)
    }

    /// The arc of a sine up to [`LARGEST_SINE`], and the sine's square.
    #[inline(always)]
    fn of(self, sine: Rings<S>) -> (Rings<S>, Rings<S>) {
        let square = sine * sine;
        (polynomial(square, self.coefficients).mul_add(square, self.unit) * sine, square)
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
