//! Outlines of subsets, as experiments and tables of points write them.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// What an outline is in a table: corners as columns and rows in pixels from the centre, one after the other.
pub(crate) const EXPECTED: &str = "three corners or more around an area of at least a pixel, as x y x y ..., in pixels from the centre, or nothing";

/// The corners of a cell of a table; none of an empty one.
pub(crate) fn of_cell(text: &str) -> Option<Vec<[f64; 2]>> {
    let numbers: Vec<f64> =
        text.split_whitespace().map(|number| number.parse().ok()).collect::<Option<_>>()?;
    let (corners, rest) = numbers.as_chunks();
    (rest.is_empty() && (corners.is_empty() || is_polygon(corners))).then(|| corners.to_vec())
}

/// The corners of a key; refused here, a wrong one is shown with its line.
pub(crate) fn of_key<'de, D: Deserializer<'de>>(corners: D) -> Result<Vec<[f64; 2]>, D::Error> {
    let corners = Vec::deserialize(corners)?;
    match is_polygon(&corners) {
        true => Ok(corners),
        false => Err(D::Error::custom(format!(
            "expected three corners [x, y] or more around an area of at least a pixel, in pixels from the centre, found {corners:?}"
        ))),
    }
}

/// Whether corners enclose a pixel's area at least.
fn is_polygon(corners: &[[f64; 2]]) -> bool {
    let ends = corners.iter().zip(corners.iter().cycle().skip(1));
    let twice_area: f64 = ends.map(|([x0, y0], [x1, y1])| x0 * y1 - x1 * y0).sum();
    corners.len() >= 3 && corners.iter().flatten().all(|value| value.is_finite()) && twice_area.abs() >= 2.0
}

/// Columns and rows on each side of the centre that hold all corners.
pub(crate) fn half_px(corners: &[[f64; 2]]) -> [usize; 2] {
    [0, 1].map(|axis| {
        corners.iter().map(|corner| corner[axis].abs().floor() as usize).max().unwrap_or_default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_hold_corners_or_nothing() {
        assert_eq!(of_cell(""), Some(Vec::new()));
        let corners = of_cell(" -10 -5  10 -5.5 0 8 ").unwrap();
        assert_eq!(corners, [[-10.0, -5.0], [10.0, -5.5], [0.0, 8.0]]);
        assert_eq!(half_px(&corners), [10, 8]);
        // Two corners, half a corner, no number, no area.
        for wrong in ["1 2 3 4", "-10 -5 10 -5 0", "a b c d e f", "0 0 1 1 2 2", "0 0 1 0 inf 1"] {
            assert_eq!(of_cell(wrong), None, "{wrong}");
        }
    }
}
