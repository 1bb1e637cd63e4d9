//! One axis of a rectangle that moves during the exposure and may be out of focus: its coverage and its speckles' integrals.

use crate::blur::Blur;
use crate::gaussian::{self, PER_AREA, normal_share};

/// One axis of a rectangle that moves during the exposure, about its centre in the middle of it.
///
/// What a pixel collects is the difference of a primitive between its edges; the mean of a primitive f over the motion is
/// (S(edge + path/2) - S(edge - path/2))/path, with S its own primitive. Both stop at the rectangle's ends, where f is
/// constant from there on.
#[derive(Clone, Copy)]
pub(crate) struct Smear {
    /// Half the rectangle's length.
    pub(crate) half_px: f64,
    /// What blurs it along this axis.
    pub(crate) blur: Blur,
}

/// Nodes in [-1, 1] and weights (they add up to 1) of the five-point Gauss-Legendre rule.
const FIVE_POINTS: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.118_463_442_528_094_54],
    [-0.538_469_310_105_683_1, 0.239_314_335_249_683_23],
    [0.0, 0.284_444_444_444_444_46],
    [0.538_469_310_105_683_1, 0.239_314_335_249_683_23],
    [0.906_179_845_938_664, 0.118_463_442_528_094_54],
];

impl Smear {
    /// How far motion and defocus carry the ends beyond rest.
    pub(crate) fn spread_px(self) -> f64 {
        if self.is_sharp() { 0.0 } else { self.blur.reach_px() }
    }

    /// How far the motion carries a point beyond rest.
    pub(crate) fn path_reach_px(self) -> f64 {
        if self.blur.is_still() { 0.0 } else { self.blur.path_px.abs() / 2.0 }
    }

    /// Length of the rectangle on the left of `edge` (from the rectangle's centre), up to a constant.
    pub(crate) fn covered_up_to(self, edge: f64) -> f64 {
        if self.blur.is_focused() {
            return self.mean_over_motion(edge, |x| x, |x| 0.5 * x * x);
        }
        let (sigma, path) = (self.blur.defocus_px, self.blur.path_px);
        let between = |of: fn(f64) -> f64, edge: f64| {
            of((edge + self.half_px) / sigma) - of((edge - self.half_px) / sigma)
        };
        if self.blur.is_still() {
            return PER_AREA * sigma * between(gaussian::second_primitive, edge);
        }
        let up_to = |edge: f64| PER_AREA * sigma * sigma * between(gaussian::third_primitive, edge);
        (up_to(edge + path / 2.0) - up_to(edge - path / 2.0)) / path
    }

    /// Integrals of exp(-(x - at)^2/(2 sigma^2)) over the part of the rectangle between neighbouring `edges`.
    pub(crate) fn gaussian_between(self, edges: &[f64], at: f64, sigma: f64, integrals: &mut Vec<f64>) {
        if !self.blur.is_focused() {
            let pixel = |ends: &[f64]| self.soft_gaussian_between([ends[0], ends[1]], at, sigma);
            return integrals.extend(edges.windows(2).map(pixel));
        }
        let per_sigma = 1.0 / sigma;
        let scaled = |x: f64| (x - at) * per_sigma;
        let first = |x: f64| sigma * gaussian::primitive(scaled(x));
        if self.is_sharp() {
            let up_to = |&edge: &f64| first(edge.clamp(-self.half_px, self.half_px));
            return integrals.extend(differences(edges.iter().map(up_to)));
        }
        let second = |x: f64| sigma * sigma * gaussian::second_primitive(scaled(x));
        let up_to = |&edge: &f64| self.mean_over_motion(edge, first, second);
        integrals.extend(differences(edges.iter().map(up_to)));
    }

    /// The integral between two edges of a Gaussian that the rectangle cuts, out of focus.
    ///
    /// The lens shows the point x as a normal distribution of the deviation b about x. Where a point y of the picture is lit
    /// from is then normal too, with the mean at + (y - at) sigma^2/(sigma^2 + b^2) and the deviation
    /// sigma b/sqrt(sigma^2 + b^2): its share within the rectangle is what the cut leaves of the widened Gaussian.
    fn soft_gaussian_between(self, ends: [f64; 2], at: f64, sigma: f64) -> f64 {
        let (widened, height) = self.blur.widened(sigma);
        let source = |y: f64| at + (y - at) * height * height;
        let deviation = self.blur.defocus_px * height;
        let path = self.blur.path_px.abs();
        let outermost = source(ends[0] - path / 2.0).abs().max(source(ends[1] + path / 2.0).abs());
        if outermost + crate::blur::REACH_SIGMA * deviation <= self.half_px {
            let whole = Smear { half_px: f64::INFINITY, blur: Blur { defocus_px: 0.0, ..self.blur } };
            let mut integral = Vec::with_capacity(1);
            whole.gaussian_between(&ends, at, widened, &mut integral);
            return height * integral[0];
        }
        let cut = |y: f64| {
            let [low, high] = [-self.half_px, self.half_px].map(|end| (end - source(y)) / deviation);
            let z = (y - at) / widened;
            libm::exp(-0.5 * z * z) * (normal_share(high) - normal_share(low))
        };
        // Pieces of the cut's width or narrower: the rule's error is below 1e-8 of the Gaussian's height.
        let n_pieces = ((ends[1] - ends[0]) / (2.0 * deviation)).ceil().max(1.0);
        let piece = (ends[1] - ends[0]) / n_pieces;
        let of_piece = |index: usize| {
            let middle = ends[0] + (index as f64 + 0.5) * piece;
            let value = |[node, weight]: [f64; 2]| {
                let y = middle + 0.5 * node * piece;
                weight * Blur::mean_over_path(self.blur.path_px, |shift| cut(y + shift))
            };
            FIVE_POINTS.map(value).iter().sum::<f64>()
        };
        height * piece * (0..n_pieces as usize).map(of_piece).sum::<f64>()
    }

    fn is_sharp(self) -> bool {
        self.blur.is_still() && self.blur.is_focused()
    }

    fn mean_over_motion(self, edge: f64, first: impl Fn(f64) -> f64, second: impl Fn(f64) -> f64) -> f64 {
        let clamped = |x: f64| x.clamp(-self.half_px, self.half_px);
        let path_px = self.blur.path_px;
        if self.blur.is_still() {
            return first(clamped(edge));
        }
        let up_to = |x: f64| {
            let inside = clamped(x);
            let beyond = x - inside;
            second(inside) + if beyond == 0.0 { 0.0 } else { beyond * first(inside) }
        };
        (up_to(edge + path_px / 2.0) - up_to(edge - path_px / 2.0)) / path_px
    }
}

/// Differences of neighbours.
pub(crate) fn differences(mut values: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
    let mut before = values.next().unwrap_or_default();
    values.map(move |after| after - std::mem::replace(&mut before, after))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blur::LEAST_PATH_PX;

    fn moving(path_px: f64) -> Smear {
        Smear { half_px: 5.25, blur: Blur { path_px, defocus_px: 0.0 } }
    }

    /// The mean over the motion by the midpoint rule.
    fn slowly(smear: Smear, edge: f64, up_to: impl Fn(Smear, f64) -> f64) -> f64 {
        let n = 20_000;
        let sharp = Smear { blur: Blur { path_px: 0.0, ..smear.blur }, ..smear };
        let shift = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * smear.blur.path_px;
        (0..n).map(|i| up_to(sharp, edge + shift(i))).sum::<f64>() / f64::from(n)
    }

    #[test]
    fn the_closed_form_is_the_mean_over_the_motion() {
        for path_px in [2.0e-4, 0.13, -0.7, 3.0] {
            let smear = moving(path_px);
            for edge in [-9.0, -5.3, -5.0, -0.4, 0.0, 1.7, 5.2, 6.0] {
                let covered = slowly(smear, edge, Smear::covered_up_to);
                // 1e-7: the midpoint rule at a kink, (3/20000)^2/8 and the like; cancellation, 1e-14/path.
                assert!((smear.covered_up_to(edge) - covered).abs() < 1.0e-7, "{path_px} {edge}");
                let found = speckle(smear, edge);
                assert!((found - slowly(smear, edge, speckle)).abs() < 1.0e-7, "{path_px} {edge}");
            }
        }
    }

    /// A speckle's integral from far on the left to an edge.
    fn speckle(smear: Smear, edge: f64) -> f64 {
        let mut integrals = Vec::new();
        smear.gaussian_between(&[-20.0, edge], 4.6, 1.6, &mut integrals);
        integrals[0]
    }

    #[test]
    fn the_blurs_bound_joins_the_two_forms() {
        for edge in [-5.0, 0.3, 5.1] {
            let at = |path_px: f64| speckle(moving(path_px), edge);
            // 1e-9: path^2/24 of a slope's slope below 1, and cancellation.
            assert!((at(0.99 * LEAST_PATH_PX) - at(1.01 * LEAST_PATH_PX)).abs() < 1.0e-9);
        }
    }

    /// The normal mean over the lens's spread, by the midpoint rule over 6 deviations to either side.
    fn slowly_out_of_focus(smear: Smear, edge: f64, up_to: impl Fn(Smear, f64) -> f64) -> f64 {
        let n = 20_000;
        let focused = Smear { blur: Blur { defocus_px: 0.0, ..smear.blur }, ..smear };
        let z = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * 12.0;
        let weight = |i: i32| libm::exp(-0.5 * z(i) * z(i));
        let value = |i: i32| weight(i) * up_to(focused, edge + smear.blur.defocus_px * z(i));
        (0..n).map(value).sum::<f64>() / (0..n).map(weight).sum::<f64>()
    }

    #[test]
    fn out_of_focus_the_closed_form_is_the_mean_over_the_spread() {
        for (path_px, defocus_px) in [(0.0, 0.1), (0.0, 1.2), (0.4, 0.6), (-1.3, 1.2)] {
            let smear = Smear { half_px: 5.25, blur: Blur { path_px, defocus_px } };
            for edge in [-9.0, -5.3, -5.0, -0.4, 0.0, 1.7, 4.7, 5.2, 6.0] {
                let covered = slowly_out_of_focus(smear, edge, Smear::covered_up_to);
                // 1e-7: kinks under the midpoint rule and the tails beyond 6 sigma, 2e-9 of lengths up to 11.
                assert!(
                    (smear.covered_up_to(edge) - covered).abs() < 1.0e-7,
                    "{path_px} {defocus_px} {edge}"
                );
                let (found, mean) = (speckle(smear, edge), slowly_out_of_focus(smear, edge, speckle));
                // 1e-5: the rules' own error; the three-point one's along the path, path^6/2016000 times a sixth derivative
                // of some 15/deviation^5, 1e-5 at most; tails as above.
                assert!((found - mean).abs() < 1.0e-5, "{path_px} {defocus_px} {edge}: {found} {mean}");
            }
        }
    }

    #[test]
    fn a_speckle_far_from_the_ends_gains_the_defocus_variance_and_keeps_its_area() {
        let blur = Blur { path_px: 0.0, defocus_px: 1.2 };
        let smear = Smear { half_px: 40.0, blur };
        let edges: Vec<f64> = (-60..=60).map(|edge| f64::from(edge) * 0.5).collect();
        let mut integrals = Vec::new();
        smear.gaussian_between(&edges, 0.3, 1.6, &mut integrals);
        let moment = |power: i32| -> f64 {
            edges.iter().zip(&integrals).map(|(edge, area)| (edge + 0.25 - 0.3).powi(power) * area).sum()
        };
        let area = 1.6 / PER_AREA;
        // 1e-9: tails beyond 6 sigma, and the table.
        assert!((moment(0) / area - 1.0).abs() < 1.0e-9);
        // A bin of width 0.5 adds 0.5^2/12 (Sheppard).
        let variance = moment(2) / moment(0) - 0.25 / 12.0;
        assert!((variance - (1.6 * 1.6 + 1.2 * 1.2)).abs() < 1.0e-7, "{variance}");
    }
}
