use crate::gaussian;

/// A blur below this many pixels is none: what it would change is blur^2/24 of a second derivative, 4e-10.
const LEAST_BLUR_PX: f64 = 1.0e-4;

/// One axis of a rectangle that moves by `blur_px` during the exposure, about its centre in the middle of it.
///
/// What a pixel collects is the difference of a primitive between its edges; the mean of a primitive f over the motion is
/// (S(edge + blur/2) - S(edge - blur/2))/blur, with S its own primitive. Both stop at the rectangle's ends, where f is
/// constant from there on.
#[derive(Clone, Copy)]
pub(crate) struct Smear {
    /// Half the rectangle's length.
    pub(crate) half_px: f64,
    /// Path during the exposure, of either sign.
    pub(crate) blur_px: f64,
}

impl Smear {
    /// How far the motion carries the ends beyond rest.
    pub(crate) fn spread_px(self) -> f64 {
        if self.is_sharp() { 0.0 } else { self.blur_px.abs() / 2.0 }
    }

    /// Length of the rectangle on the left of `edge` (from the rectangle's centre), up to a constant.
    pub(crate) fn covered_up_to(self, edge: f64) -> f64 {
        self.mean_over_motion(edge, |x| x, |x| 0.5 * x * x)
    }

    /// Integrals of exp(-(x - at)^2/(2 sigma^2)) over the part of the rectangle between neighbouring `edges`.
    pub(crate) fn gaussian_between(self, edges: &[f64], at: f64, sigma: f64, integrals: &mut Vec<f64>) {
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

    fn is_sharp(self) -> bool {
        self.blur_px.abs() < LEAST_BLUR_PX
    }

    fn mean_over_motion(self, edge: f64, first: impl Fn(f64) -> f64, second: impl Fn(f64) -> f64) -> f64 {
        let clamped = |x: f64| x.clamp(-self.half_px, self.half_px);
        if self.is_sharp() {
            return first(clamped(edge));
        }
        let up_to = |x: f64| {
            let inside = clamped(x);
            let beyond = x - inside;
            second(inside) + if beyond == 0.0 { 0.0 } else { beyond * first(inside) }
        };
        (up_to(edge + self.blur_px / 2.0) - up_to(edge - self.blur_px / 2.0)) / self.blur_px
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

    /// The mean over the motion by the midpoint rule.
    fn slowly(smear: Smear, edge: f64, up_to: impl Fn(Smear, f64) -> f64) -> f64 {
        let n = 20_000;
        let sharp = Smear { blur_px: 0.0, ..smear };
        let shift = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * smear.blur_px;
        (0..n).map(|i| up_to(sharp, edge + shift(i))).sum::<f64>() / f64::from(n)
    }

    #[test]
    fn the_closed_form_is_the_mean_over_the_motion() {
        for blur_px in [2.0e-4, 0.13, -0.7, 3.0] {
            let smear = Smear { half_px: 5.25, blur_px };
            for edge in [-9.0, -5.3, -5.0, -0.4, 0.0, 1.7, 5.2, 6.0] {
                let covered = slowly(smear, edge, Smear::covered_up_to);
                // 1e-7: the midpoint rule at a kink, (3/20000)^2/8 and the like; cancellation, 1e-14/blur.
                assert!((smear.covered_up_to(edge) - covered).abs() < 1.0e-7, "{blur_px} {edge}");
                let found = speckle(smear, edge);
                assert!((found - slowly(smear, edge, speckle)).abs() < 1.0e-7, "{blur_px} {edge}");
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
            let at = |blur_px: f64| speckle(Smear { half_px: 5.25, blur_px }, edge);
            // 1e-9: blur^2/24 of a slope's slope below 1, and cancellation.
            assert!((at(0.99 * LEAST_BLUR_PX) - at(1.01 * LEAST_BLUR_PX)).abs() < 1.0e-9);
        }
    }
}
