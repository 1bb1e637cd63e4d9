//! The Gaussian's first, second and third primitive, and the normal distribution.

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
    let place = x.clamp(-END, END) * NODES_PER_UNIT;
    let nearest = (place + END * NODES_PER_UNIT + 0.5) as usize;
    let at = (nearest as f64) / NODES_PER_UNIT - END;
    let step = place / NODES_PER_UNIT - at;
    let Node { primitive, value } = NODES[nearest];
    // The derivatives of exp(-x^2/2) are the Hermite polynomials times it, with alternating sign.
    let square = at * at;
    let third = (square - 1.0) / 6.0;
    let fourth = at * (3.0 - square) / 24.0;
    let fifth = (square * (square - 6.0) + 3.0) / 120.0;
    primitive + value * step * (1.0 + step * (-0.5 * at + step * (third + step * (fourth + step * fifth))))
}

/// The primitive of [`primitive`] that is 1 at 0: x primitive(x) + exp(-x^2/2).
pub(crate) fn second_primitive(x: f64) -> f64 {
    x * primitive(x) + libm::exp(-0.5 * x * x)
}

/// The primitive of [`second_primitive`] that is 0 at 0: ((x^2 + 1) primitive(x) + x exp(-x^2/2))/2.
pub(crate) fn third_primitive(x: f64) -> f64 {
    0.5 * ((x * x + 1.0) * primitive(x) + x * libm::exp(-0.5 * x * x))
}

/// The share of a normal distribution below `x` standard deviations.
pub(crate) fn normal_share(x: f64) -> f64 {
    0.5 + PER_AREA * primitive(x)
}

/// 1/sqrt(2 pi): one over the Gaussian's area.
pub(crate) const PER_AREA: f64 = 0.5 * FRAC_2_SQRT_PI * FRAC_1_SQRT_2;

/// The primitive and the Gaussian at a node.
struct Node {
    primitive: f64,
    value: f64,
}

static NODES: LazyLock<Vec<Node>> = LazyLock::new(|| {
    let n_nodes = (2.0 * END * NODES_PER_UNIT) as usize + 1;
    let at = |node: usize| node as f64 / NODES_PER_UNIT - END;
    let node =
        |x: f64| Node { primitive: FRAC_PI_2.sqrt() * libm::erf(x / SQRT_2), value: libm::exp(-0.5 * x * x) };
    (0..n_nodes).map(|index| node(at(index))).collect()
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
    fn the_table_is_as_exact_as_the_error_function() {
        for index in -9_000..=9_000 {
            let x = f64::from(index) * 1.0e-3 + 1.234e-4;
            let exact = FRAC_PI_2.sqrt() * libm::erf(x / SQRT_2);
            // 4e-15: the Taylor remainder or the tail beyond the end, 2e-15 each, and rounding of values up to 1.25.
            assert!((primitive(x) - exact).abs() < 4.0e-15, "{x}: {:e}", primitive(x) - exact);
        }
    }
}
