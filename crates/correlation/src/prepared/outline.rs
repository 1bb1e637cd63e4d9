//! Subsets that are no rectangles: which places a polygon holds, and how it turns with its subset.

/// Whether a polygon holds a place: whether a ray to the right crosses its sides an odd number of times. Corners are columns and rows.
pub(crate) fn is_within(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let ends = corners.iter().zip(corners.iter().cycle().skip(1));
    let crosses = |(from, to): &(&[f64; 2], &[f64; 2])| {
        let ([from_x, from_y], [to_x, to_y]) = (from, to);
        (*from_y > y) != (*to_y > y) && x < from_x + (to_x - from_x) * (y - from_y) / (to_y - from_y)
    };
    ends.filter(crosses).count() % 2 == 1
}

/// The polygon turned by an angle about the centre, in radians, from right towards down.
pub(crate) fn turned(corners: &[[f64; 2]], theta_rad: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = theta_rad.sin_cos();
    corners.iter().map(|[x, y]| [cos * x - sin * y, sin * x + cos * y]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An L: a square of 10 px without the quarter at its lower right.
    const CORNER: [[f64; 2]; 6] =
        [[-5.0, -5.0], [5.0, -5.0], [5.0, 0.0], [0.0, 0.0], [0.0, 5.0], [-5.0, 5.0]];

    #[test]
    fn a_polygon_holds_what_lies_between_its_sides() {
        for (x, y) in (-7..=7).flat_map(|x| (-7..=7).map(move |y| (f64::from(x) + 0.5, f64::from(y) + 0.5))) {
            let expected = x.abs() < 5.0 && y.abs() < 5.0 && !(x > 0.0 && y > 0.0);
            assert_eq!(is_within(&CORNER, [x, y]), expected, "{x}, {y}");
        }
    }

    #[test]
    fn a_quarter_turn_takes_right_to_down() {
        let [x, y] = turned(&[[3.0, 1.0]], std::f64::consts::FRAC_PI_2)[0];
        // Right by 3 becomes down by 3, down by 1 becomes left by 1; the cosine is zero to rounding.
        assert!((x + 1.0).abs() < 1e-12 && (y - 3.0).abs() < 1e-12, "{x}, {y}");
    }
}
