//! The Gaussian's first, second and third primitive, the normal distribution, and the exponential function.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI, FRAC_PI_2, SQRT_2};
use std::sync::LazyLock;

/// Nodes per unit of the table.
const NODES_PER_UNIT: f64 = 64.0;

/// The table's end; the integral beyond it is 2e-15.
const END: f64 = 8.0;

/// The primitive of exp(-x^2/2) that is 0 at 0, for a million calls a frame: the Taylor series to the fifth order
/// around the nearest of a table's nodes. Nodes lie 1/64 apart, so the error is below (1/128)^6/720 times the fifth
/// derivative of the Gaussian (at most 5.8): 2e-15.
#[inline]
pub(crate) fn primitive(x: f64) -> f64 {
    let (node, step) = nearest(x);
    node.primitive(step)
}

/// The primitive of [`primitive`] that is 1 at 0: x primitive(x) + exp(-x^2/2).
#[inline]
pub(crate) fn second_primitive(x: f64) -> f64 {
    let (node, step) = nearest(x);
    x * node.primitive(step) + node.gaussian(step)
}

/// The primitive of [`second_primitive`] that is 0 at 0: ((x^2 + 1) primitive(x) + x exp(-x^2/2))/2.
#[inline]
pub(crate) fn third_primitive(x: f64) -> f64 {
    let (node, step) = nearest(x);
    0.5 * ((x * x + 1.0) * node.primitive(step) + x * node.gaussian(step))
}

/// The exponential function, for millions of calls a frame: 2 to a whole number of 64ths from a table, times the Taylor series of what
/// is left, whose next term is below (ln 2/128)^6/720: 4e-17. It is 0 below exp(-700), where no picture shows anything, and grows no more from
/// exp(700) on.
#[inline]
pub(crate) fn exp(x: f64) -> f64 {
    const PER_STEP: f64 = 64.0 / std::f64::consts::LN_2;
    // ln 2/64 in two parts, the first so short that its multiples here are exact.
    const STEP: [f64; 2] = [f64::from_bits(0x3F86_2E42_FEF0_0000), 1.162_596_423_439_437e-12];
    /// 1.5 2^52, beside which a number is rounded to a whole one, that its lowest bits hold.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    if x < -700.0 {
        return 0.0;
    }
    let x = x.min(700.0);
    let shifted = x * PER_STEP + WHOLE;
    let (steps, index) = (shifted - WHOLE, shifted.to_bits() as i32);
    let rest = (x - steps * STEP[0]) - steps * STEP[1];
    let series =
        1.0 + rest * (1.0 + rest * (0.5 + rest * (1.0 / 6.0 + rest * (1.0 / 24.0 + rest * (1.0 / 120.0)))));
    let doubled = f64::from_bits(u64::from((1023 + (index >> 6)) as u32) << 52);
    ROOTS[(index & 63) as usize] * series * doubled
}

/// 2 to the power of 64ths.
static ROOTS: LazyLock<[f64; 64]> =
    LazyLock::new(|| std::array::from_fn(|index| libm::exp2(index as f64 / 64.0)));

/// The share of a normal distribution below `x` standard deviations.
pub(crate) fn normal_share(x: f64) -> f64 {
    0.5 + PER_AREA * primitive(x)
}

/// 1/sqrt(2 pi): one over the Gaussian's area.
pub(crate) const PER_AREA: f64 = 0.5 * FRAC_2_SQRT_PI * FRAC_1_SQRT_2;

/// The Taylor series around a node: the primitive, and what multiplies the powers of the step from there.
struct Node {
    primitive: f64,
    powers: [f64; 6],
}

impl Node {
    fn new(at: f64) -> Self {
        let (square, value) = (at * at, libm::exp(-0.5 * at * at));
        // The derivatives of exp(-x^2/2) are the Hermite polynomials times it, with alternating sign.
        let derivatives = [
            1.0,
            -at / 2.0,
            (square - 1.0) / 6.0,
            at * (3.0 - square) / 24.0,
            (square * (square - 6.0) + 3.0) / 120.0,
            at * (square * (10.0 - square) - 15.0) / 720.0,
        ];
        Self {
            primitive: FRAC_PI_2.sqrt() * libm::erf(at / SQRT_2),
            powers: derivatives.map(|derivative| value * derivative),
        }
    }

    #[inline]
    fn primitive(&self, step: f64) -> f64 {
        let [first, second, third, fourth, fifth, _] = self.powers;
        self.primitive + step * (first + step * (second + step * (third + step * (fourth + step * fifth))))
    }

    /// The Gaussian itself, to the fifth order too: what is left out is below (1/128)^6/720 times 15, 5e-15.
    #[inline]
    fn gaussian(&self, step: f64) -> f64 {
        let [first, second, third, fourth, fifth, sixth] = self.powers;
        let beyond_second = 3.0 * third + step * (4.0 * fourth + step * (5.0 * fifth + step * 6.0 * sixth));
        first + step * (2.0 * second + step * beyond_second)
    }
}

/// The node nearest to a place, and the step from there.
#[inline]
fn nearest(x: f64) -> (&'static Node, f64) {
    let place = x.clamp(-END, END) * NODES_PER_UNIT;
    let index = (place + (END * NODES_PER_UNIT + 0.5)) as i32;
    let at = f64::from(index) - END * NODES_PER_UNIT;
    (&NODES[index as usize], (place - at) * (1.0 / NODES_PER_UNIT))
}

static NODES: LazyLock<Vec<Node>> = LazyLock::new(|| {
    let n_nodes = (2.0 * END * NODES_PER_UNIT) as usize + 1;
    (0..n_nodes).map(|index| Node::new(index as f64 / NODES_PER_UNIT - END)).collect()
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_primitive_is_the_slope_of_the_next() {
        let step = 1.0e-3;
        for index in -90..=90 {
            let x = f64::from(index) * 0.1;
            let slope = |of: fn(f64) -> f64| (of(x + step) - of(x - step)) / (2.0 * step);
            // 1e-6: the central difference's step^2/6 times third derivatives below 3, and rounding of values up to 60.
            assert!((slope(second_primitive) - primitive(x)).abs() < 1.0e-6, "{x}");
            assert!((slope(third_primitive) - second_primitive(x)).abs() < 1.0e-6, "{x}");
            let share = 0.5 * (1.0 + libm::erf(x / SQRT_2));
            assert!((normal_share(x) - share).abs() < 4.0e-15, "{x}"); // as for the table
        }
    }

    #[test]
    fn the_exponential_function_is_exact_to_rounding() {
        for index in -70_000..=1_000 {
            let x = f64::from(index) * 0.01 + 1.234e-4;
            let exact = libm::exp(x);
            // 1e-15: four roundings of 1.1e-16 each, and those of the argument's parts.
            assert!((exp(x) / exact - 1.0).abs() < 1.0e-15, "{x}: {:e}", exp(x) / exact - 1.0);
        }
        assert_eq!(exp(-701.0).to_bits(), 0.0_f64.to_bits());
    }

    #[test]
    fn the_table_is_as_exact_as_the_error_function() {
        for index in -9_000..=9_000 {
            let x = f64::from(index) * 1.0e-3 + 1.234e-4;
            let exact = FRAC_PI_2.sqrt() * libm::erf(x / SQRT_2);
            // 4e-15: the Taylor remainder or the tail beyond the end, 2e-15 each, and rounding of values up to 1.25.
            assert!((primitive(x) - exact).abs() < 4.0e-15, "{x}: {:e}", primitive(x) - exact);
            let exact = x * exact + libm::exp(-0.5 * x * x);
            // x times as much, the Gaussian's own 5e-15, and rounding of values up to 11.
            let found = second_primitive(x);
            assert!((found - exact).abs() < 4.0e-15 * x.abs() + 9.0e-15, "{x}: {:e}", found - exact);
        }
    }
}
