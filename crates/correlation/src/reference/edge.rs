//! Sharp edges beside a subset, which ring through the interpolation into it.

use std::fmt;

use chainwave_measurement::{Recording, Subset};

use crate::reference::pixel_bounds;
use crate::{CorrelationError, Reference, ReferenceFrames};

/// A sharp edge, as a marker's against its ground, that runs along a side of a subset. It rings through the spline's prefilter
/// into the subset, by the power of the prefilter's pole, and biases positions: those of the cubic kernel by 1 to 2 mpx at
/// 3 px, half as much with each further one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharpEdge {
    /// Where it lies from the subset.
    pub side: Side,
    /// Pixels between the subset's last and the edge; 0 where it runs inside.
    pub distance_px: usize,
}

/// An edge as near as this biases positions by a thousandth of a pixel or more; one a pixel farther off by half as much.
const RINGING_PX: usize = 3;

impl SharpEdge {
    /// Whether it is so near that it biases positions by a thousandth of a pixel or more.
    pub fn rings(&self) -> bool {
        self.distance_px <= RINGING_PX
    }
}

/// A side of a subset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Towards smaller x.
    Left,
    /// Towards larger x.
    Right,
    /// Towards smaller y.
    Above,
    /// Towards larger y.
    Below,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Left => "left",
            Self::Right => "right",
            Self::Above => "above",
            Self::Below => "below",
        })
    }
}

/// Pixels beyond the subset in which an edge is looked for, and as many within.
const REACH_PX: i64 = 4;
/// Mean square of third differences along a side over that along the roughest line in the subset from which on there is an
/// edge. A step as high as the contrast has nine times its square, speckles of 4.5 px a third of it, and noise of a fifth of it
/// as much again.
const EDGE_RATIO: f64 = 3.0;

/// The sharp edge nearest to a subset, if one runs along a side within 4 px. Ground that is left out ([`crate::PreparedSubset`])
/// has no edge.
///
/// # Errors
/// As [`Reference::read`].
pub fn sharp_edge(
    recording: &dyn Recording,
    subset: &Subset,
    frames: &ReferenceFrames,
) -> Result<Option<SharpEdge>, CorrelationError> {
    Ok(sharp_edge_in(&Reference::read(recording, subset, frames)?, subset))
}

fn sharp_edge_in(reference: &Reference, subset: &Subset) -> Option<SharpEdge> {
    let [x0, x1, y0, y1] = pixel_bounds(subset);
    let sides = [
        (Side::Left, [[x0, -1, x1 - x0], [y0, y1, 0]]),
        (Side::Right, [[x1, 1, x1 - x0], [y0, y1, 0]]),
        (Side::Above, [[y0, -1, y1 - y0], [x0, x1, 1]]),
        (Side::Below, [[y1, 1, y1 - y0], [x0, x1, 1]]),
    ];
    let of_side = |(side, [[last, out, depth], [start, end, axis]]): (Side, [[i64; 3]; 2])| {
        // the mean square of third differences between the pixels at a distance and one farther out
        let roughness = |distance: i64| -> Option<f64> {
            let step = |along: i64| {
                let pixel = |k: i64| {
                    let across = last + out * (distance + k);
                    reference.usable_pixel(if axis == 0 { [across, along] } else { [along, across] })
                };
                Some(pixel(-1)? - 3.0 * pixel(0)? + 3.0 * pixel(1)? - pixel(2)?)
            };
            let squares = (start..=end).map(|along| step(along).map(|step| step * step));
            let sum = squares.sum::<Option<f64>>()?;
            Some(sum / (end - start + 1) as f64)
        };
        let inside = (2 - depth..-REACH_PX).filter_map(roughness).fold(0.0, f64::max);
        // Differences that end on an edge feel a ninth of it, so one just out of reach must be seen to be told from one within.
        let found = (-REACH_PX..=REACH_PX + 1).filter_map(|distance| Some((roughness(distance)?, distance)));
        let (roughest, distance) = found.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let distance_px = usize::try_from(distance).unwrap_or(0);
        (distance <= REACH_PX && roughest > EDGE_RATIO * inside).then_some(SharpEdge { side, distance_px })
    };
    sides.into_iter().filter_map(of_side).min_by_key(|edge| edge.distance_px)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Region;

    /// Smooth texture on a marker from column 20 to 60 and row 15 to 62, on grey ground.
    fn marker(ground: f32) -> Reference {
        let value = |i: usize| {
            let (x, y) = ((i % 90) as f32, (i / 90) as f32);
            let on_marker = (20.0..=60.0).contains(&x) && (15.0..=62.0).contains(&y);
            let texture = (0.9 * x + 0.2 * y).sin() + (0.3 * x - 1.1 * y).cos() + (0.7 * x + 0.8 * y).cos();
            if on_marker { 1000.0 + 200.0 * texture } else { ground }
        };
        Reference::new(Region::whole(90, 90), (0..8100).map(value).collect(), 1).unwrap()
    }

    #[test]
    fn an_edge_is_seen_on_its_side_and_at_its_distance() {
        let edge = |x_px: f64, y_px: f64, half: usize| {
            let subset = Subset::new("a", x_px, y_px, half, half);
            sharp_edge_in(&marker(1100.0), &subset)
        };
        assert_eq!(edge(40.0, 40.0, 12), None);
        assert_eq!(edge(37.0, 40.0, 12), None, "5 px are enough");
        assert_eq!(edge(36.0, 40.0, 12), Some(SharpEdge { side: Side::Left, distance_px: 4 }));
        assert_eq!(edge(33.0, 40.0, 12), Some(SharpEdge { side: Side::Left, distance_px: 1 }));
        assert_eq!(edge(45.0, 40.0, 12), Some(SharpEdge { side: Side::Right, distance_px: 3 }));
        assert_eq!(edge(40.0, 29.0, 12), Some(SharpEdge { side: Side::Above, distance_px: 2 }));
        assert_eq!(edge(40.0, 52.0, 12), Some(SharpEdge { side: Side::Below, distance_px: 0 }));
    }

    #[test]
    fn ground_that_is_left_out_has_no_edge() {
        let subset = Subset::new("a", 33.0, 40.0, 12, 12);
        assert_eq!(sharp_edge_in(&marker(20.0), &subset), None);
    }
}
