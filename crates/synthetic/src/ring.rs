//! A body's outline: an elliptical ring whose halves stretch between the neighbours' joints.

use std::ops::Range;

use chainwave_vectors::dispatch_loop;

use crate::blur::Blur;
use crate::canvas::Canvas;
use crate::half_plane::{focused_coverage, half_plane_coverage};
use crate::marker::BodyPlace;
use crate::settings::Ring;
use crate::view::PixelView;

/// Bounds of a ring's stretch along the chain; only motions that no chain makes reach them.
const STRETCH: [f64; 2] = [0.2, 2.0];

/// Farther within an edge than any path is long.
const WELL_WITHIN_PX: f64 = 1.0e6;

/// Semi-axis of the hole of a ring that is squeezed to less than its walls: too small to be seen.
const LEAST_HOLE_PX: f64 = 1.0e-3;

/// The outline of a body: an ellipse with an elliptical hole, in pixels. Between its neighbours' joints each half of it
/// is stretched along the chain, so that bonded rings touch and never cross.
pub(crate) struct Outline {
    semi_x_px: f64,
    semi_y_px: f64,
    wall_px: f64,
}

impl Outline {
    pub(crate) fn new(ring: &Ring, scale_px_per_m: f64) -> Self {
        Self {
            semi_x_px: ring.semi_major_m * scale_px_per_m,
            semi_y_px: ring.semi_minor_m * scale_px_per_m,
            wall_px: ring.wall_m * scale_px_per_m,
        }
    }

    /// Columns that the outline may reach on either side of its centre.
    pub(crate) fn reach_px(&self) -> f64 {
        STRETCH[1] * self.semi_x_px + 2.0
    }

    /// Lays the ring over the canvas. `stretch` is the length along the chain of the left and of the right half, relative to
    /// rest.
    pub(crate) fn draw(
        &self,
        place: BodyPlace,
        stretch: [f64; 2],
        tone: f32,
        view: &PixelView,
        canvas: &mut Canvas,
    ) {
        let halves = stretch.map(|stretch| self.half(stretch, place.blur));
        match view.is_warped() {
            true => self.draw_sampled(place, &halves, tone, view, canvas),
            false => draw_upright(place.centre_px, &halves, tone, canvas),
        }
    }

    fn draw_sampled(
        &self,
        BodyPlace { centre_px, blur }: BodyPlace,
        halves: &[Half; 2],
        tone: f32,
        view: &PixelView,
        canvas: &mut Canvas,
    ) {
        let reach_px = [self.reach_px() + blur.reach_px(), self.semi_y_px + blur.reach_px()];
        let [columns, rows] = view.region(centre_px, reach_px);
        for row in canvas.drawn(rows) {
            let values = canvas.row_mut(row);
            for column in columns.clone() {
                let [x_px, y_px] = view.sight(column, row).from(centre_px).centre_px;
                let half = &halves[usize::from(x_px >= 0.0)];
                if half.meets(x_px, y_px) {
                    let covered = half.coverage(x_px, y_px) as f32;
                    values[column] += covered * (tone - values[column]);
                }
            }
        }
    }

    fn half(&self, stretch: f64, blur: Blur) -> Half {
        let semi_x_px = self.semi_x_px * stretch.clamp(STRETCH[0], STRETCH[1]);
        let hole_px = |semi_px: f64| (semi_px - self.wall_px).max(LEAST_HOLE_PX);
        Half {
            outer: Oval { semi_x_px, semi_y_px: self.semi_y_px },
            inner: Oval { semi_x_px: hole_px(semi_x_px), semi_y_px: hole_px(self.semi_y_px) },
            blur,
        }
    }
}

fn draw_upright(centre_px: [f64; 2], [left, right]: &[Half; 2], tone: f32, canvas: &mut Canvas) {
    let width = canvas.width_px as f64;
    let column = |x_px: f64| (centre_px[0] + x_px).ceil().clamp(0.0, width) as usize;
    for (row, values) in canvas.rows_mut() {
        let y_px = row as f64 - centre_px[1];
        let mut lay = |half: &Half, columns: Range<usize>| {
            let first_px = columns.start as f64 - centre_px[0];
            half.lay([first_px, y_px], tone, values.get_mut(columns).unwrap_or_default());
        };
        if let Some(reach_px) = left.reach_px(y_px) {
            lay(left, column(-reach_px)..column(-left.hole_px(y_px)));
        }
        if let Some(reach_px) = right.reach_px(y_px) {
            lay(right, column(right.hole_px(y_px))..column(reach_px));
        }
    }
}

/// The half of a ring on one side of its centre.
struct Half {
    outer: Oval,
    inner: Oval,
    blur: Blur,
}

impl Half {
    /// Columns from the centre within which a row meets the ring; `None` where it passes beside it.
    fn reach_px(&self, y_px: f64) -> Option<f64> {
        let margin_px = 1.0 + self.blur.reach_px();
        self.outer.half_chord_px(y_px.abs() - 1.0 - self.spread_px()).map(|half| half + margin_px)
    }

    /// Columns from the centre within which a row is all hole.
    fn hole_px(&self, y_px: f64) -> f64 {
        let margin_px = 1.0 + self.blur.reach_px();
        self.inner
            .half_chord_px(y_px.abs() + 1.0 + self.spread_px())
            .map_or(0.0, |half| (half - margin_px).max(0.0))
    }

    /// How far defocus carries the edges across the chain.
    fn spread_px(&self) -> f64 {
        Blur { path_px: 0.0, ..self.blur }.reach_px()
    }

    /// Whether the ring may cover some of the pixel centred at (`x_px`, `y_px`).
    fn meets(&self, x_px: f64, y_px: f64) -> bool {
        self.reach_px(y_px).is_some_and(|reach_px| x_px.abs() <= reach_px) && x_px.abs() >= self.hole_px(y_px)
    }

    /// Lays it over pixels of a row, the first of which is centred at `first_px` from the ring's centre.
    fn lay(&self, first_px: [f64; 2], tone: f32, values: &mut [f32]) {
        match (self.blur.is_focused(), self.blur.path_px == 0.0) {
            (true, true) => self.lay_focused::<false>(first_px, tone, values),
            (true, false) => self.lay_focused::<true>(first_px, tone, values),
            (false, _) => {
                for (i, value) in values.iter_mut().enumerate() {
                    let covered = self.coverage(first_px[0] + i as f64, first_px[1]) as f32;
                    *value += covered * (tone - *value);
                }
            }
        }
    }

    fn lay_focused<const MOVES: bool>(&self, [x_px, y_px]: [f64; 2], tone: f32, values: &mut [f32]) {
        dispatch_loop(
            #[inline(always)]
            || {
                for (i, value) in values.iter_mut().enumerate() {
                    let place_px = [x_px + f64::from(i as i32), y_px];
                    let covered = |oval: &Oval| {
                        let (normal, inside) = oval.edge(place_px);
                        focused_coverage::<MOVES>(normal, inside, self.blur.path_px)
                    };
                    let covered = (covered(&self.outer) - covered(&self.inner)).max(0.0) as f32;
                    *value += covered * (tone - *value);
                }
            },
        );
    }

    /// The covered fraction of the pixel centred at (`x_px`, `y_px`) from the ring's centre.
    fn coverage(&self, x_px: f64, y_px: f64) -> f64 {
        let covered = |oval: &Oval| {
            let (normal, inside) = oval.edge([x_px, y_px]);
            half_plane_coverage(normal, inside, self.blur)
        };
        let outer = covered(&self.outer);
        if outer > 0.0 { outer - covered(&self.inner) } else { 0.0 }
    }
}

/// An ellipse around the origin.
struct Oval {
    semi_x_px: f64,
    semi_y_px: f64,
}

impl Oval {
    /// Half the length of the chord at the height `y_px`; `None` where there is none. Below 0 it is the longest.
    fn half_chord_px(&self, y_px: f64) -> Option<f64> {
        let height = y_px.max(0.0) / self.semi_y_px;
        (height < 1.0).then(|| self.semi_x_px * (1.0 - height * height).sqrt())
    }

    /// Its tangent near a pixel, which stands for it there: the normal, and how far within it the pixel's centre lies. The error
    /// is that of the curvature within a pixel: about 1/(24 R) at a radius of R pixels, and as much again for each pixel's
    /// square of motion.
    #[inline(always)]
    fn edge(&self, [x_px, y_px]: [f64; 2]) -> ([f64; 2], f64) {
        let gradient = [x_px / (self.semi_x_px * self.semi_x_px), y_px / (self.semi_y_px * self.semi_y_px)];
        let level = x_px * gradient[0] + y_px * gradient[1];
        let steepness = (gradient[0] * gradient[0] + gradient[1] * gradient[1]).sqrt();
        // The centre itself has no nearest edge, and lies within.
        let is_centre = steepness == 0.0;
        let per = if is_centre { 0.0 } else { 1.0 / steepness };
        let normal = if is_centre { [0.0, 1.0] } else { gradient.map(|component| component * per) };
        (normal, if is_centre { WELL_WITHIN_PX } else { (level.sqrt() - level) * per })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hec_at_5_px_per_mm() -> Outline {
        Outline::new(&Ring { semi_major_m: 15.0e-3, semi_minor_m: 9.0e-3, wall_m: 0.4e-3 }, 5000.0)
    }

    fn drawn(centre_px: [f64; 2], stretch: [f64; 2]) -> Canvas {
        let mut canvas = Canvas::new(170, 110);
        let place = BodyPlace { centre_px, blur: Blur::default() };
        hec_at_5_px_per_mm().draw(place, stretch, 1.0, &PixelView::straight(170, 110), &mut canvas);
        canvas
    }

    #[test]
    fn the_ring_has_its_closed_form_area_wherever_it_lies() {
        let half_px = |semi_px: f64| std::f64::consts::FRAC_PI_2 * (semi_px * 45.0 - (semi_px - 2.0) * 43.0);
        for (centre_px, stretch) in [
            ([84.0, 54.0], [1.0, 1.0]),
            ([84.3, 54.0], [1.0, 1.0]),
            ([84.5, 54.5], [0.9, 1.0]),
            ([84.77, 54.21], [0.94, 1.04]),
        ] {
            let area_px = half_px(75.0 * stretch[0]) + half_px(75.0 * stretch[1]);
            let sum: f64 = drawn(centre_px, stretch).values.iter().map(|&covered| f64::from(covered)).sum();
            // 5e-4: the outer and inner curvature errors (1/24 R, R from 27 px) largely cancel in the difference.
            assert!((sum / area_px - 1.0).abs() < 5.0e-4, "{centre_px:?}: {}", sum / area_px);
        }
    }

    #[test]
    fn pixels_agree_with_counting_points() {
        let centre_px = [84.3, 54.2];
        let canvas = drawn(centre_px, [1.0, 1.0]);
        let inside = |x: f64, y: f64, a: f64, b: f64| (x / a).powi(2) + (y / b).powi(2) < 1.0;
        let n = 64;
        for (row, column) in [(54, 9), (54, 10), (54, 11), (20, 34), (21, 33), (97, 100), (98, 100), (99, 70)]
        {
            let hits = (0..n * n)
                .map(|i| ((i % n) as f64, (i / n) as f64))
                .map(|(i, j)| [(i + 0.5) / n as f64 - 0.5, (j + 0.5) / n as f64 - 0.5])
                .map(|[dx, dy]| [column as f64 + dx - centre_px[0], row as f64 + dy - centre_px[1]])
                .filter(|&[x, y]| inside(x, y, 75.0, 45.0) && !inside(x, y, 73.0, 43.0))
                .count();
            let counted = hits as f64 / (n * n) as f64;
            // 0.01: curvature 2 (1/24 R), and 1/64 of a pixel's edge for the count.
            assert!((f64::from(canvas.values[row * 170 + column]) - counted).abs() < 0.01, "{row} {column}");
        }
    }
}
