//! Half an ellipse cut into arcs of equal length.

use std::f64::consts::PI;

use super::section::Ring;

/// Abscissae and weights of Gauss's rule with eight points on [-1, 1], the positive half (Abramowitz and Stegun, table 25.4).
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];
/// Parts over which the half's length is summed; aspects up to 10 are then exact to rounding.
const PARTS: usize = 64;

/// The upper half of an ellipse about the origin, from the left bond to the right one, cut into arcs of equal length.
#[derive(Debug, Clone)]
pub(crate) struct HalfEllipse {
    /// Length of one arc, in metres.
    pub(crate) arc_m: f64,
    /// Ends of the arcs, from left to right, in metres.
    pub(crate) nodes_m: Vec<[f64; 2]>,
    /// Direction of the curve at its two ends, in radians from the x axis.
    pub(crate) directions_rad: [f64; 2],
    /// Length of the curve between a pole and the edge of the bond, in metres.
    pub(crate) bonded_m: f64,
}

/// x = -a cos(phi), y = b sin(phi), for phi from 0 (left pole) to pi.
#[derive(Debug, Clone, Copy)]
struct Ellipse {
    a_m: f64,
    b_m: f64,
}

impl HalfEllipse {
    /// The upper half of a ring's centreline between its bonds.
    pub(crate) fn of(ring: &Ring, elements_per_ring: usize) -> Self {
        Self::new(ring.semi_major_m, ring.semi_minor_m, ring.bond_width_m, elements_per_ring / 2)
    }

    /// The half with semi-axes a (along x) and b, cut into `n_arcs` between bonds of the given whole height.
    pub(crate) fn new(a_m: f64, b_m: f64, bond_width_m: f64, n_arcs: usize) -> Self {
        let ellipse = Ellipse { a_m, b_m };
        let edge = (0.5 * bond_width_m / b_m).asin();
        let span = PI - 2.0 * edge;
        let part = |k: usize| edge + span * k as f64 / PARTS as f64;
        let length_m: f64 = (0..PARTS).map(|k| ellipse.length_m(part(k), part(k + 1))).sum();
        let arc_m = length_m / n_arcs as f64;
        let mut phi = edge;
        let mut nodes_m = vec![ellipse.point_m(phi)];
        for _ in 1..n_arcs {
            phi = ellipse.advance(phi, arc_m);
            nodes_m.push(ellipse.point_m(phi));
        }
        nodes_m.push(ellipse.point_m(PI - edge));
        Self {
            arc_m,
            nodes_m,
            directions_rad: [ellipse.direction_rad(edge), ellipse.direction_rad(PI - edge)],
            bonded_m: ellipse.length_m(0.0, edge),
        }
    }
}

impl Ellipse {
    fn point_m(self, phi: f64) -> [f64; 2] {
        [-self.a_m * phi.cos(), self.b_m * phi.sin()]
    }

    fn direction_rad(self, phi: f64) -> f64 {
        (self.b_m * phi.cos()).atan2(self.a_m * phi.sin())
    }

    /// ds / dphi in metres.
    fn speed_m(self, phi: f64) -> f64 {
        (self.a_m * phi.sin()).hypot(self.b_m * phi.cos())
    }

    fn length_m(self, from: f64, to: f64) -> f64 {
        let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
        let pair = |(x, weight): (f64, f64)| {
            weight * (self.speed_m(centre - half * x) + self.speed_m(centre + half * x))
        };
        half * GAUSS.into_iter().map(pair).sum::<f64>()
    }

    /// The parameter an arc of the given length further on, by Newton's method.
    fn advance(self, phi: f64, arc_m: f64) -> f64 {
        let mut to = phi + arc_m / self.speed_m(phi);
        for _ in 0..50 {
            let missing_m = arc_m - self.length_in_parts_m(phi, to);
            to += missing_m / self.speed_m(to);
            if missing_m.abs() < 1e-15 * arc_m {
                break;
            }
        }
        to
    }

    /// The length between two parameters that may lie far apart.
    fn length_in_parts_m(self, from: f64, to: f64) -> f64 {
        let n = ((to - from).abs() * PARTS as f64 / PI).ceil().max(1.0);
        let at = |k: f64| from + (to - from) * k / n;
        (0..n as usize).map(|k| self.length_m(at(k as f64), at(k as f64 + 1.0))).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_cut_into_equal_angles() {
        let half = HalfEllipse::new(2.0, 2.0, 0.0, 7);
        assert!((half.arc_m - 2.0 * PI / 7.0).abs() < 1e-14);
        for (k, [x, y]) in half.nodes_m.iter().enumerate() {
            let phi = PI * k as f64 / 7.0;
            assert!((x + 2.0 * phi.cos()).abs() < 1e-14 && (y - 2.0 * phi.sin()).abs() < 1e-14);
        }
        assert!((half.directions_rad[0] - 0.5 * PI).abs() < 1e-15);
    }

    #[test]
    fn the_length_is_the_elliptic_integral() {
        // Perimeter 4 a E(e) with a = 4, b = 1: E(sqrt(15) / 4) = 1.0722... by mpmath at 30 digits.
        let perimeter_m = 17.156_843_550_313_67;
        for n in [1, 2, 5, 128] {
            let half = HalfEllipse::new(4.0, 1.0, 0.0, n);
            assert!((2.0 * n as f64 * half.arc_m / perimeter_m - 1.0).abs() < 1e-14, "{}", half.arc_m);
        }
    }

    #[test]
    fn a_bond_takes_its_part_of_the_curve() {
        let (whole, bonded) = (HalfEllipse::new(14.8, 8.8, 0.0, 8), HalfEllipse::new(14.8, 8.8, 2.0, 8));
        assert!((bonded.nodes_m[0][1] - 1.0).abs() < 1e-14);
        let length_m = 8.0 * bonded.arc_m + 2.0 * bonded.bonded_m;
        assert!((length_m / (8.0 * whole.arc_m) - 1.0).abs() < 1e-13);
        assert!((bonded.directions_rad[0] + bonded.directions_rad[1]).abs() < 1e-15);
    }
}
