//! The share of a pixel that lies in a half-plane, at rest, moving and out of focus.

use crate::blur::Blur;
use crate::gaussian::{PER_AREA, second_primitive, third_primitive};

/// A blur across the edge below this many pixels is none: cancellation would cost more than it changes.
const LEAST_BLUR_PX: f64 = 1.0e-4;

/// The area of a unit square that lies in a half-plane whose edge has the unit `normal`, when the square's centre lies
/// `inside` within it: the mean while the half-plane moves along x, and over the lens's spread.
#[inline]
pub(crate) fn half_plane_coverage(normal: [f64; 2], inside: f64, blur: Blur) -> f64 {
    if !blur.is_focused() {
        return soft_coverage(&Square::seen_along(normal), inside, blur.path_px * normal[0], blur.defocus_px);
    }
    focused_coverage::<true>(normal, inside, blur.path_px)
}

/// The same in focus, without a branch, so that it can be worked out for many pixels at once; without `MOVES` the path is none.
#[inline(always)]
pub(crate) fn focused_coverage<const MOVES: bool>(normal: [f64; 2], inside: f64, path_px: f64) -> f64 {
    let square = Square::seen_along(normal);
    let still = 0.5 + square.beyond_half(inside.abs()).copysign(inside);
    if !MOVES {
        return still;
    }
    let blur = (path_px * normal[0]).abs();
    let up_to = |inside: f64| square.beyond_half_integral(inside.abs());
    let moving = 0.5 + (up_to(inside + blur / 2.0) - up_to(inside - blur / 2.0)) / blur;
    if blur < LEAST_BLUR_PX { still } else { moving }
}

/// Out of focus: a square seen along a direction is a box as wide as its large side, averaged over its small side, so the
/// coverage is a difference of the normal distribution's second primitives, and of differences of its third.
fn soft_coverage(square: &Square, inside: f64, path: f64, defocus: f64) -> f64 {
    let Square { small, large, corner, shoulder } = *square;
    Blur::mean_over_path(path, |shift| {
        let at = |distance: f64| (inside + shift + distance) / defocus;
        let share = if small < LEAST_SIDE {
            PER_AREA * defocus * (second_primitive(at(corner)) - second_primitive(at(-corner))) / large
        } else {
            let edges = third_primitive(at(corner)) - third_primitive(at(shoulder))
                + third_primitive(at(-corner))
                - third_primitive(at(-shoulder));
            PER_AREA * defocus * defocus * edges / (large * small)
        };
        (0.5 + share).clamp(0.0, 1.0)
    })
}

/// A square seen along its side within this angle has no small side: what it would change is its square/24.
const LEAST_SIDE: f64 = 1.0e-4;

/// A unit square's extent along a direction: half its diagonal's, and half that of the part of full width.
struct Square {
    small: f64,
    large: f64,
    corner: f64,
    shoulder: f64,
}

impl Square {
    #[inline(always)]
    fn seen_along(normal: [f64; 2]) -> Self {
        let (small, large) = (normal[0].abs().min(normal[1].abs()), normal[0].abs().max(normal[1].abs()));
        Self { small, large, corner: (large + small) / 2.0, shoulder: (large - small) / 2.0 }
    }

    /// The area between the centre and an edge at the distance, which is at least 0.
    #[inline(always)]
    fn beyond_half(&self, distance: f64) -> f64 {
        let Self { small, large, corner, shoulder } = *self;
        let (along, beyond) = (distance / large, corner - distance);
        let in_corner = 0.5 - beyond * beyond / (2.0 * large * small);
        let within = if distance <= shoulder { along } else { in_corner };
        if distance >= corner { 0.5 } else { within }
    }

    /// Integral of [`Square::beyond_half`] from 0.
    #[inline(always)]
    fn beyond_half_integral(&self, distance: f64) -> f64 {
        let Self { small, large, corner, shoulder } = *self;
        let cube = |length: f64| length * length * length;
        let part = (cube(small) - cube((corner - distance).max(0.0))) / (6.0 * large * small);
        // A square seen along its side has no corner part.
        let corners = if small > 0.0 { part } else { 0.0 };
        let beyond = shoulder * shoulder / (2.0 * large) + 0.5 * (distance - shoulder) - corners;
        if distance <= shoulder { distance * distance / (2.0 * large) } else { beyond }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving(path_px: f64) -> Blur {
        Blur { path_px, ..Blur::default() }
    }

    const ANGLES: [f64; 6] = [0.0, 0.3, 0.7, 1.5, 2.0, std::f64::consts::FRAC_PI_2];

    #[test]
    fn a_half_plane_through_the_centre_covers_half_and_far_ones_all_or_nothing() {
        for angle in ANGLES {
            let normal = [f64::cos(angle), f64::sin(angle)];
            for (inside, expected) in [(0.0, 0.5), (0.8, 1.0), (-0.8, 0.0)] {
                // 1e-15: rounding.
                assert!((half_plane_coverage(normal, inside, moving(0.0)) - expected).abs() < 1.0e-15);
            }
        }
    }

    #[test]
    fn a_moving_edge_covers_the_mean_of_the_still_ones() {
        for angle in ANGLES {
            let normal = [f64::cos(angle), f64::sin(angle)];
            for (inside, blur_px) in [(0.0, 0.7), (0.3, 0.2), (-0.45, 1.3), (0.6, -2.5)] {
                let n = 20_000;
                let shift = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * blur_px * normal[0];
                let mean =
                    (0..n).map(|i| half_plane_coverage(normal, inside + shift(i), moving(0.0))).sum::<f64>()
                        / f64::from(n);
                // 1e-7: the midpoint rule at kinks of the coverage, slope 1, points 2.5/20000 apart.
                assert!((half_plane_coverage(normal, inside, moving(blur_px)) - mean).abs() < 1.0e-7);
            }
        }
    }

    #[test]
    fn an_edge_out_of_focus_covers_the_normal_mean_of_the_sharp_ones() {
        for angle in ANGLES {
            let normal = [f64::cos(angle), f64::sin(angle)];
            for (inside, path_px, defocus_px) in
                [(0.0, 0.0, 0.3), (0.7, 0.0, 1.2), (-0.4, 0.6, 0.5), (2.1, -1.5, 1.2), (0.2, 0.0, 0.01)]
            {
                let n = 24_000;
                let z = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * 12.0;
                let weights = |i: i32| libm::exp(-0.5 * z(i) * z(i));
                let sharp = |i: i32| half_plane_coverage(normal, inside + defocus_px * z(i), moving(path_px));
                let total: f64 = (0..n).map(weights).sum();
                let mean = (0..n).map(|i| weights(i) * sharp(i)).sum::<f64>() / total;
                let found = half_plane_coverage(normal, inside, Blur { path_px, defocus_px });
                // 2e-5: along the path, the three-point rule's path^6/2016000 times a sixth derivative of about 3/defocus^5,
                // 2e-6 here; 1e-7 for the sum at kinks and the tails beyond 6 sigma; cancellation in the third primitives
                // (values of (2/0.01)^2 times rounding over a side of 0.07) 1e-10.
                assert!((found - mean).abs() < 2.0e-5, "{angle} {inside} {path_px}: {found} {mean}");
            }
        }
    }
}
