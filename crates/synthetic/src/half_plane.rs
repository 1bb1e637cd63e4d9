/// A blur across the edge below this many pixels is none: cancellation would cost more than it changes.
const LEAST_BLUR_PX: f64 = 1.0e-4;

/// The area of a unit square that lies in a half-plane whose edge has the unit `normal`, when the square's centre lies
/// `inside` within it: the mean while the half-plane moves by `blur_px` along x.
#[inline]
pub(crate) fn half_plane_coverage(normal: [f64; 2], inside: f64, blur_px: f64) -> f64 {
    let square = Square::seen_along(normal);
    if (blur_px * normal[0]).abs() < LEAST_BLUR_PX {
        return 0.5 + square.beyond_half(inside.abs()).copysign(inside);
    }
    moving_coverage(&square, inside, (blur_px * normal[0]).abs())
}

/// Apart from the still edge's, so that this one stays short enough to be part of its callers.
fn moving_coverage(square: &Square, inside: f64, blur: f64) -> f64 {
    let up_to = |inside: f64| square.beyond_half_integral(inside.abs());
    0.5 + (up_to(inside + blur / 2.0) - up_to(inside - blur / 2.0)) / blur
}

/// A unit square's extent along a direction: half its diagonal's, and half that of the part of full width.
struct Square {
    small: f64,
    large: f64,
    corner: f64,
    shoulder: f64,
}

impl Square {
    #[inline]
    fn seen_along(normal: [f64; 2]) -> Self {
        let (small, large) = (normal[0].abs().min(normal[1].abs()), normal[0].abs().max(normal[1].abs()));
        Self { small, large, corner: (large + small) / 2.0, shoulder: (large - small) / 2.0 }
    }

    /// The area between the centre and an edge at the distance, which is at least 0.
    #[inline]
    fn beyond_half(&self, distance: f64) -> f64 {
        let Self { small, large, corner, shoulder } = *self;
        if distance >= corner {
            0.5
        } else if distance <= shoulder {
            distance / large
        } else {
            0.5 - (corner - distance) * (corner - distance) / (2.0 * large * small)
        }
    }

    /// Integral of [`Square::beyond_half`] from 0.
    fn beyond_half_integral(&self, distance: f64) -> f64 {
        let Self { small, large, corner, shoulder } = *self;
        if distance <= shoulder {
            return distance * distance / (2.0 * large);
        }
        let (cut, rest) = (small.powi(3), (corner - distance).max(0.0).powi(3));
        // A square seen along its side has no corner part: cut and rest are 0.
        let corners = if small > 0.0 { (cut - rest) / (6.0 * large * small) } else { 0.0 };
        shoulder * shoulder / (2.0 * large) + 0.5 * (distance - shoulder) - corners
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANGLES: [f64; 6] = [0.0, 0.3, 0.7, 1.5, 2.0, std::f64::consts::FRAC_PI_2];

    #[test]
    fn a_half_plane_through_the_centre_covers_half_and_far_ones_all_or_nothing() {
        for angle in ANGLES {
            let normal = [f64::cos(angle), f64::sin(angle)];
            for (inside, expected) in [(0.0, 0.5), (0.8, 1.0), (-0.8, 0.0)] {
                // 1e-15: rounding.
                assert!((half_plane_coverage(normal, inside, 0.0) - expected).abs() < 1.0e-15);
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
                let mean = (0..n).map(|i| half_plane_coverage(normal, inside + shift(i), 0.0)).sum::<f64>()
                    / f64::from(n);
                // 1e-7: the midpoint rule at kinks of the coverage, slope 1, points 2.5/20000 apart.
                assert!((half_plane_coverage(normal, inside, blur_px) - mean).abs() < 1.0e-7);
            }
        }
    }
}
