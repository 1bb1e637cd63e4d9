//! Walls of any shape over time, drawn as chains of straight pieces.

use ndarray::{Array4, Axis};

use crate::SyntheticError;
use crate::blur::Blur;
use crate::canvas::Canvas;
use crate::half_plane::half_plane_coverage;
use crate::marker::BodyPlace;
use crate::view::{PixelView, Sight};

/// The bodies' shapes over time, for rings that breathe and ovalise: each body's wall as a closed line of points.
///
/// Between samples the points move in straight lines; the error is h^2/8 max|x''| for samples h apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Shapes {
    /// Sample times in seconds after the impact, increasing.
    pub times_s: Vec<f64>,
    /// Points of the wall's centreline from the body's centre, which moves as the trajectory says: shape
    /// `[body, time, point, 2]` with (x along the chain, y down), in metres.
    pub centreline_m: Array4<f64>,
    /// Wall thickness, in metres.
    pub wall_m: f64,
}

/// A straight piece of a wall, in pixels.
struct WallSegment {
    from_px: [f64; 2],
    to_px: [f64; 2],
}

impl Shapes {
    pub(crate) fn check(&self, n_bodies: usize) -> Result<(), SyntheticError> {
        let (bodies, times, points, components) = self.centreline_m.dim();
        let require = |holds: bool, expected: &'static str, found: String| match holds {
            true => Ok(()),
            false => Err(SyntheticError::Motion { expected, found }),
        };
        let shape = (bodies, times, components) == (n_bodies, self.times_s.len(), 2);
        let expected = "centrelines of shape [body, time, point, 2] as the specimen has bodies";
        require(shape, expected, format!("{:?}", self.centreline_m.dim()))?;
        require(
            times > 0 && points >= 3,
            "at least one time and three points",
            format!("{times}, {points}"),
        )?;
        let increasing = self.times_s.windows(2).all(|pair| pair[0] < pair[1]);
        require(increasing, "increasing times", "a time that is not above the one before it".into())?;
        let finite = self.times_s.iter().chain(&self.centreline_m).all(|value| value.is_finite());
        require(finite, "finite numbers", "NaN or infinity".into())?;
        let wall = self.wall_m > 0.0 && self.wall_m.is_finite();
        require(wall, "a wall thickness above 0", self.wall_m.to_string())
    }

    /// Largest distance of a wall from its body's centre along the chain, in metres.
    pub(crate) fn reach_m(&self) -> f64 {
        let along = self.centreline_m.index_axis(Axis(3), 0);
        along.iter().fold(0.0_f64, |reach_m, x_m| reach_m.max(x_m.abs())) + self.wall_m
    }

    /// Lays a body's wall over the canvas. Before the first sample and after the last it has their shape.
    pub(crate) fn draw(&self, wall: &Wall, view: &PixelView, canvas: &mut Canvas) {
        let half_px = self.wall_m * wall.scale_px_per_m / 2.0;
        let mut covered = Canvas::new(canvas.width_px, canvas.height_px());
        covered.draw_in(canvas.rows());
        for piece in self.pieces(wall) {
            piece.cover(half_px, wall.place.blur, view, &mut covered);
        }
        for (value, &covered) in canvas.drawn_mut().iter_mut().zip(&*covered.drawn_mut()) {
            *value += covered * (wall.tone - *value);
        }
    }

    fn pieces(&self, wall: &Wall) -> Vec<WallSegment> {
        let after = self.times_s.partition_point(|&sample_s| sample_s <= wall.time_s);
        let (before, after) = (after.saturating_sub(1), after.min(self.times_s.len() - 1));
        let step_s = self.times_s[after] - self.times_s[before];
        let share = if step_s > 0.0 { (wall.time_s - self.times_s[before]) / step_s } else { 0.0 };
        let n_points = self.centreline_m.dim().2;
        let point_px = |point: usize| {
            [0, 1].map(|axis| {
                let at_m = |sample: usize| self.centreline_m[[wall.body, sample, point % n_points, axis]];
                let mean_m = (1.0 - share) * at_m(before) + share * at_m(after);
                wall.place.centre_px[axis] + wall.scale_px_per_m * mean_m
            })
        };
        (0..n_points)
            .map(|point| WallSegment { from_px: point_px(point), to_px: point_px(point + 1) })
            .collect()
    }
}

/// What of a body's wall is to be drawn.
pub(crate) struct Wall {
    pub(crate) body: usize,
    pub(crate) place: BodyPlace,
    pub(crate) time_s: f64,
    pub(crate) scale_px_per_m: f64,
    pub(crate) tone: f32,
}

impl WallSegment {
    /// Raises `covered` to the piece's own coverage where that is more: pieces meet at their ends and overlap nowhere else.
    fn cover(&self, half_px: f64, blur: Blur, view: &PixelView, covered: &mut Canvas) {
        let centre_px = [0, 1].map(|axis| (self.from_px[axis] + self.to_px[axis]) / 2.0);
        let reach_px = |axis: usize| (self.to_px[axis] - self.from_px[axis]).abs() / 2.0 + half_px + 1.0;
        let spread_px = [blur, Blur { path_px: 0.0, ..blur }].map(Blur::reach_px);
        let [columns, rows] =
            view.region(centre_px, [reach_px(0) + spread_px[0], reach_px(1) + spread_px[1]]);
        for row in covered.drawn(rows) {
            let covered = covered.row_mut(row);
            for column in columns.clone() {
                let share = self.coverage(&view.sight(column, row), half_px, blur) as f32;
                let covered = &mut covered[column];
                *covered = covered.max(share);
            }
        }
    }

    /// The share of a pixel within `half_px` of the piece, with the piece's bounds replaced by straight edges.
    fn coverage(&self, sight: &Sight, half_px: f64, blur: Blur) -> f64 {
        let apart = self.nearest(sight.centre_px);
        let distance = apart[0].hypot(apart[1]);
        let along = [self.to_px[1] - self.from_px[1], self.from_px[0] - self.to_px[0]];
        let length = along[0].hypot(along[1]);
        let normal = if distance > 1.0e-9 {
            apart.map(|component| component / distance)
        } else if length > 0.0 {
            along.map(|component| component / length)
        } else {
            [1.0, 0.0]
        };
        let within = |inside: f64| half_plane_coverage(normal, inside, blur);
        within(half_px - distance) - within(-half_px - distance)
    }

    /// From the piece's nearest point to a point.
    fn nearest(&self, at_px: [f64; 2]) -> [f64; 2] {
        let piece = [self.to_px[0] - self.from_px[0], self.to_px[1] - self.from_px[1]];
        let from = [at_px[0] - self.from_px[0], at_px[1] - self.from_px[1]];
        let square = piece[0] * piece[0] + piece[1] * piece[1];
        let share = if square > 0.0 {
            ((from[0] * piece[0] + from[1] * piece[1]) / square).clamp(0.0, 1.0)
        } else {
            0.0
        };
        [from[0] - share * piece[0], from[1] - share * piece[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle of 30 px in 128 pieces, its wall 2 px.
    fn circle() -> Shapes {
        let angle = |point: usize| point as f64 * std::f64::consts::TAU / 128.0;
        let point = |(_, _, point, axis): (usize, usize, usize, usize)| match axis {
            0 => 0.030 * angle(point).cos(),
            _ => 0.030 * angle(point).sin(),
        };
        Shapes {
            times_s: vec![0.0],
            centreline_m: Array4::from_shape_fn((1, 1, 128, 2), point),
            wall_m: 2.0e-3,
        }
    }

    #[test]
    fn a_circular_wall_has_its_closed_form_area_at_rest_and_in_motion() {
        for (blur_px, defocus_px) in [(0.0, 0.0), (0.8, 0.0), (0.0, 1.2)] {
            let mut canvas = Canvas::new(100, 90);
            let blur = Blur { path_px: blur_px, defocus_px };
            let place = BodyPlace { centre_px: [49.3, 44.8], blur };
            let wall = Wall { body: 0, place, time_s: 0.0, scale_px_per_m: 1000.0, tone: 1.0 };
            circle().draw(&wall, &PixelView::straight(100, 90), &mut canvas);
            let area_px: f64 = canvas.values.iter().map(|&covered| f64::from(covered)).sum();
            let ring_px = std::f64::consts::TAU * 30.0 * 2.0;
            // 0.3 %: where pieces meet at 2.8 degrees, the larger coverage stands for the union.
            assert!((area_px / ring_px - 1.0).abs() < 3.0e-3, "{blur_px}: {}", area_px / ring_px);
        }
    }

    #[test]
    fn a_shape_of_another_chain_is_refused() {
        assert!(circle().check(1).is_ok());
        assert!(circle().check(2).is_err());
        assert!(Shapes { wall_m: 0.0, ..circle() }.check(1).is_err());
        assert!(Shapes { times_s: vec![f64::NAN], ..circle() }.check(1).is_err());
    }
}
