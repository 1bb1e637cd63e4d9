use pulp::Simd;

use super::{KEPT, Kernel, NODE, Rings, components};
use crate::lanes::Lanes;

/// Largest sine whose arc the polynomial gives: changes of turn up to 15 degrees without, and 120 with three halvings.
const LARGEST_SINE: f64 = 0.258_819_045_102_520_8;
/// Largest change of a chord's squared length, relative to it, for which the series of its root stands.
const LARGEST_STRETCH: f64 = 0.01;
/// (asin(s) - s) / s^3 as a polynomial in s^2, lowest power first: relative error of the arc 2.5e-10 up to
/// [`LARGEST_SINE`] (interpolated at Chebyshev's nodes).
const ARC: [f64; 4] =
    [0.166_666_662_752_550_42, 0.075_001_866_734_998_89, 0.044_504_748_268_945_1, 0.033_607_901_190_141_754];
/// (1 - 1 / sqrt(1 + e)) / e as a polynomial in e, lowest power first: Taylor's, so that small stretches keep their
/// digits; at [`LARGEST_STRETCH`] the square root's relative error is 3e-11 of the strain's.
const INVERSE_ROOT: [f64; 4] = [0.5, -3.0 / 8.0, 5.0 / 16.0, -35.0 / 128.0];

impl Kernel {
    /// First sweep, from left to right: stretch and rotation of each chord, turn at each node, and the elimination in the
    /// theorem of three moments. Returns the last node's turn and eliminated turn.
    ///
    /// It goes in two loops, because a processor looks ahead by some hundred operations only: one long chain of them for
    /// each element would leave it waiting.
    #[inline(always)]
    pub(super) fn deform<S: Simd, const WIDE: bool>(
        &self,
        simd: S,
        nodes: &[[S::f64s; NODE]],
        joints: [Rings<S>; 2],
        scratch: &mut [[S::f64s; KEPT]],
    ) -> Option<[Rings<S>; 2]> {
        let largest_stretch = self.stretch::<S, WIDE>(simd, nodes, joints, scratch);
        let (last, largest_sine_square) = self.turn::<S, WIDE>(simd, scratch);
        // Written so that values that are not numbers do not pass.
        let in_range = largest_sine_square.largest() <= LARGEST_SINE * LARGEST_SINE
            && (WIDE || largest_stretch.largest() <= LARGEST_STRETCH);
        if in_range { Some(last) } else { None }
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
        let all = |value| Lanes::splat(simd, value);
        let (zero, one) = (all(0.0), all(1.0));
        let (mut place, mut largest) = ([joints[0], zero], zero);
        for (e, (element, kept)) in self.elements.iter().zip(scratch.iter_mut()).enumerate() {
            let next = match nodes.get(e) {
                Some(node) => [Lanes::new(simd, [node[0]]), Lanes::new(simd, [node[1]])],
                None => [joints[1], zero],
            };
            let change = [next[0] - place[0], next[1] - place[1]];
            place = next;
            // In the frame of the unstressed chord, over its length, the chord is now (1 + along, sideways).
            let [ax, ay] = components(simd, element.inverse);
            let along = ax.mul_add(change[0], ay * change[1]);
            let sideways = ay.mul_sub_from(change[0], ax * change[1]);
            let stretch = sideways.mul_add(sideways, along.mul_add(along, along + along));
            let (inverse, elongation) = if WIDE {
                let length = (one + stretch).sqrt();
                (one / length, stretch / (one + length))
            } else {
                largest = largest.max(stretch.abs());
                let shortening = polynomial(stretch, INVERSE_ROOT.map(all));
                let inverse = stretch.mul_sub_from(shortening, one);
                // sqrt(1 + e) - 1 = e (r - w) with r = 1 / sqrt(1 + e) = 1 - e w.
                (inverse, stretch * (inverse - shortening))
            };
            let [cosine, sine] = [along.mul_add(inverse, inverse), sideways * inverse];
            *kept = [cosine, sine, inverse, elongation].map(Lanes::vector);
        }
        largest
    }

    /// Puts the turn at each chord's left node, and the eliminated turn, in place of its rotation. Returns those of the last
    /// node, and the largest square of a sine.
    #[inline(always)]
    fn turn<S: Simd, const WIDE: bool>(
        &self,
        simd: S,
        scratch: &mut [[S::f64s; KEPT]],
    ) -> ([Rings<S>; 2], Rings<S>) {
        let all = |value| Lanes::splat(simd, value);
        let (zero, one) = (all(0.0), all(1.0));
        let to_turn = Arc::new(simd, self.turn_unit);
        let mut rotation = [one, zero];
        let (mut eliminated, mut factor, mut largest) = (zero, 0.0, zero);
        for (kept, lower) in scratch.iter_mut().zip(&self.lower) {
            let next = [Lanes::new(simd, [kept[0]]), Lanes::new(simd, [kept[1]])];
            let (turn, sine_square) = to_turn.between::<WIDE>(rotation, next);
            rotation = next;
            eliminated = all(factor).mul_sub_from(eliminated, turn);
            factor = *lower;
            largest = largest.max(sine_square);
            (kept[0], kept[1]) = (turn.vector(), eliminated.vector());
        }
        let (turn, sine_square) = to_turn.between::<WIDE>(rotation, [one, zero]);
        ([turn, all(factor).mul_sub_from(eliminated, turn)], largest.max(sine_square))
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
        let coefficients = ARC.map(|coefficient| Lanes::splat(simd, coefficient * unit));
        Self { simd, unit: Lanes::splat(simd, unit), coefficients }
    }

    /// The turn from one direction to the next, and the square of the sine that it was found from.
    #[inline(always)]
    fn between<const WIDE: bool>(self, from: [Rings<S>; 2], to: [Rings<S>; 2]) -> (Rings<S>, Rings<S>) {
        let sine = to[0].mul_sub_from(from[1], to[1] * from[0]);
        if !WIDE {
            return self.of(sine);
        }
        let [one, half, eight] = [1.0, 0.5, 8.0].map(|value| Lanes::splat(self.simd, value));
        // sin(phi / 2) = sin(phi) / (2 cos(phi / 2)), three times.
        let halved = |cosine: Rings<S>| ((one + cosine) * half).sqrt();
        let cosine = to[0].mul_add(from[0], to[1] * from[1]);
        let second = halved(cosine);
        let fourth = halved(second);
        let eighth = halved(fourth);
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

/// The polynomial of four coefficients, lowest first. By Horner's scheme: elements are independent enough to hide its chain,
/// so that the number of products counts.
#[inline(always)]
fn polynomial<S: Simd>(of: Rings<S>, [c0, c1, c2, c3]: [Rings<S>; 4]) -> Rings<S> {
    c3.mul_add(of, c2).mul_add(of, c1).mul_add(of, c0)
}
