//! Light that grades across pictures otherwise about a marker in one view than in another, as at the edges of a lens: taken out of the second picture before
//! the marker is matched there.
//!
//! Light that grows by the share g per pixel moves a match by about g times the square of a speckle's radius, some thousandths of a pixel, and what it leaves over has
//! places at rest count as known tens of times worse than they are.

use chainwave_measurement::{MemoryRecording, Position, Subset};
use nalgebra::{Matrix4, Vector4};

/// Standard deviations by which light is told to grade.
const TOLD: f64 = 5.0;
/// What light is of that at the marker's centre at least, and at most, wherever the plane of its growth leads to.
const LEAST: f64 = 0.5;
const MOST: f64 = 2.0;

/// The two frames of a marker, the second one lit as the first, where the marker was found in it; `None` where both are alike.
pub(super) fn evenly_lit(
    frames: &MemoryRecording,
    subset: &Subset,
    found: &Position,
) -> Option<MemoryRecording> {
    let [half_width, half_height] = [subset.half_width_px, subset.half_height_px].map(|half| half as f64);
    let [first, second] = frames.frames.first_chunk::<2>()?;
    let width_px = frames.info.width_px;
    let places = (-(half_height as i64)..=half_height as i64)
        .flat_map(|y| (-(half_width as i64)..=half_width as i64).map(move |x| [x as f64, y as f64]));
    // The second picture by the first, one that grows along x, one along y, and a constant.
    let row = |[x, y]: [f64; 2]| {
        let before = between(first, width_px, [subset.x_px + x, subset.y_px + y])?;
        let after = between(second, width_px, [found.x_px.value + x, found.y_px.value + y])?;
        Some((Vector4::new(before, before * x / half_width, before * y / half_height, 1.0), after))
    };
    let rows: Vec<(Vector4<f64>, f64)> = places.filter_map(row).collect();
    let matrix: Matrix4<f64> = rows.iter().map(|(row, _)| row * row.transpose()).sum();
    let right_side: Vector4<f64> = rows.iter().map(|(row, after)| row * *after).sum();
    let inverse = matrix.cholesky()?.inverse();
    let by = inverse * right_side;
    let squares: f64 = rows.iter().map(|(row, after)| (after - row.dot(&by)).powi(2)).sum();
    let variance = squares / rows.len().checked_sub(4).filter(|n| *n > 0)? as f64;
    let is_told = |k: usize| by[k].powi(2) > TOLD.powi(2) * variance * inverse[(k, k)];
    if by[0] <= 0.0 || !(is_told(1) || is_told(2)) {
        return None;
    }
    let light = |x: f64, y: f64| {
        let [x, y] = [(x - found.x_px.value) / half_width, (y - found.y_px.value) / half_height];
        (1.0 + (by[1] * x + by[2] * y) / by[0]).clamp(LEAST, MOST)
    };
    let mut even = frames.clone();
    for (i, grey) in even.frames[1].iter_mut().enumerate() {
        let lit = light((i % width_px) as f64, (i / width_px) as f64);
        *grey = ((f64::from(*grey) - by[3]) / lit + by[3]) as f32;
    }
    Some(even)
}

/// A picture between four of its pixels; `None` outside.
fn between(picture: &[f32], width_px: usize, [x, y]: [f64; 2]) -> Option<f64> {
    let (left, above) = (x.floor(), y.floor());
    if left < 0.0 || above < 0.0 || left + 1.0 >= width_px as f64 {
        return None;
    }
    let [right, below] = [x - left, y - above];
    let first = above as usize * width_px + left as usize;
    let grey = |pixel: usize| picture.get(pixel).map(|grey| f64::from(*grey));
    let row = |first: usize| Some((1.0 - right) * grey(first)? + right * grey(first + 1)?);
    Some((1.0 - below) * row(first)? + below * row(first + width_px)?)
}

#[cfg(test)]
mod tests {
    use chainwave_correlation::{Method, ReferenceFrames, Settings};
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    const WIDTH_PX: usize = 81;
    const SHIFT_PX: f64 = 0.37;

    /// Gaussian speckles, seen once and again a part of a pixel farther, lit by so much more from left to right.
    fn frames(growth_per_px: f64) -> MemoryRecording {
        let mut random = Pcg64::seed_from_u64(3);
        let speckles: Vec<[f64; 2]> =
            (0..90).map(|_| [0, 1].map(|_| 81.0 * random.random::<f64>())).collect();
        let picture = |shift_px: f64, growth_per_px: f64| -> Vec<f32> {
            let grey = |i: usize| {
                let [x, y] = [(i % WIDTH_PX) as f64, (i / WIDTH_PX) as f64];
                let depth = |at: &[f64; 2]| {
                    let square = (x - shift_px - at[0]).powi(2) + (y - at[1]).powi(2);
                    (-square / (2.0 * 2.2_f64.powi(2))).exp()
                };
                let dark: f64 = speckles.iter().map(depth).sum();
                (3000.0 * (-dark).exp() * (1.0 + growth_per_px * (x - 40.0))) as f32
            };
            (0..WIDTH_PX * WIDTH_PX).map(grey).collect()
        };
        MemoryRecording::new(WIDTH_PX, 12, vec![picture(0.0, 0.0), picture(SHIFT_PX, growth_per_px)])
    }

    fn found(frames: &MemoryRecording) -> Position {
        let subset = Subset::new("", 40.0, 40.0, 11, 11);
        let (reference, settings) = (ReferenceFrames::Single(0), Settings::default());
        let method = Method::default();
        let tracks = method.track(frames, std::slice::from_ref(&subset), &reference, &settings, &|_| ());
        tracks.unwrap().remove(0).positions.pop().unwrap().unwrap()
    }

    fn off_px(found: &Position) -> f64 {
        (found.x_px.value - 40.0 - SHIFT_PX).hypot(found.y_px.value - 40.0)
    }

    #[test]
    fn light_that_grades_is_taken_out_of_where_a_marker_lies() {
        let subset = Subset::new("", 40.0, 40.0, 11, 11);
        let graded = frames(3e-3);
        let before = found(&graded);
        let even = evenly_lit(&graded, &subset, &before).unwrap();
        let after = found(&even);
        // What is left is below what a place at rest counts as known to in any case (two thousandths of a pixel), which the light moved it by more than.
        assert!(off_px(&before) > 2e-3 && off_px(&after) < 2e-3, "{before:?} {after:?}");
        // And what it leaves over is what reading between pixels leaves.
        assert!(after.x_px.sigma < 0.3 * before.x_px.sigma, "{before:?} {after:?}");
    }

    #[test]
    fn what_is_lit_alike_stays_as_it_was_seen() {
        let alike = frames(0.0);
        assert!(evenly_lit(&alike, &Subset::new("", 40.0, 40.0, 11, 11), &found(&alike)).is_none());
    }
}
