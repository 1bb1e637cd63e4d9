//! A marker: a flat, speckled rectangle, laid over a frame.

use std::sync::OnceLock;

use crate::blur::{Blur, MOST_DEFOCUS_PX};
use crate::canvas::Canvas;
use crate::sampled::Sampled;
use crate::smear::Smear;
use crate::speckle::{AxisIntegrals, Pattern};
use crate::view::{PixelView, Sight};

/// Where a body is in the ideal picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyPlace {
    /// Its centre (column, row) in the middle of the exposure.
    pub(crate) centre_px: [f64; 2],
    /// What blurs it.
    pub(crate) blur: Blur,
}

/// A flat rectangle, speckled or not. Bodies move along the rows only, so the rows' integrals are kept until the
/// camera moves or loses its focus.
pub(crate) struct Plate {
    pattern: Pattern,
    row_px: f64,
    /// While its centre is in that row, in focus.
    rows: AxisIntegrals,
    /// For a view that is not straight: in focus, and out of it.
    sampled: [OnceLock<Sampled>; 2],
    tone: f64,
    speckle_depth: f64,
}

impl Plate {
    /// A plate of a tone, whose speckles take `speckle_depth` of it away; at rest its centre is in the row `row_px`.
    pub(crate) fn new(pattern: Pattern, row_px: f64, tone: f64, speckle_depth: f64) -> Self {
        let rows = pattern.rows(row_px, Blur::default());
        Self { row_px, rows, pattern, sampled: [OnceLock::new(), OnceLock::new()], tone, speckle_depth }
    }

    /// Lays the plate over the canvas; `depths` is scratch.
    pub(crate) fn draw(
        &self,
        place: BodyPlace,
        view: &PixelView,
        canvas: &mut Canvas,
        depths: &mut Vec<f64>,
    ) {
        match view.is_warped() {
            true => self.draw_sampled(place, view, canvas),
            false => self.draw_upright(place, canvas, depths),
        }
    }

    fn draw_upright(&self, place: BodyPlace, canvas: &mut Canvas, depths: &mut Vec<f64>) {
        let [column_px, row_px] = place.centre_px;
        let is_at_rest = row_px.total_cmp(&self.row_px).is_eq() && place.blur.is_focused();
        let moved = (!is_at_rest).then(|| self.pattern.rows(row_px, place.blur));
        let rows = moved.as_ref().unwrap_or(&self.rows);
        let columns = self.pattern.columns(column_px, place.blur);
        let seen = rows.seen(&canvas.rows());
        self.pattern.add_up(&columns, rows, seen.clone(), depths);
        let first = columns.first_px.clamp(0, canvas.width_px as i64);
        let hidden = (first - columns.first_px) as usize;
        for (at, depths) in seen.zip(depths.chunks_exact(columns.n_pixels())) {
            let height = rows.covered[at];
            let row = (rows.first_px + at as i64) as usize;
            let pixels = canvas.row_mut(row)[first as usize..].iter_mut();
            for ((value, width), depth) in
                pixels.zip(columns.covered.iter().skip(hidden)).zip(depths.iter().skip(hidden))
            {
                self.lay(value, width * height, *depth);
            }
        }
    }

    fn draw_sampled(&self, place: BodyPlace, view: &PixelView, canvas: &mut Canvas) {
        let blur = place.blur;
        let [focused, soft] = &self.sampled;
        let sampled = match blur.is_focused() {
            true => focused.get_or_init(|| Sampled::new(&self.pattern, 0.0)),
            false => soft.get_or_init(|| Sampled::new(&self.pattern, MOST_DEFOCUS_PX)),
        };
        let across = Smear { half_px: self.pattern.half_width_px, blur };
        let down = Smear { half_px: self.pattern.half_height_px, blur: Blur { path_px: 0.0, ..blur } };
        let half_px = [across.half_px + across.spread_px(), down.half_px + down.spread_px()];
        let [columns, rows] = view.region(place.centre_px, half_px);
        for row in canvas.drawn(rows) {
            let values = canvas.row_mut(row);
            for column in columns.clone() {
                let sight = view.sight(column, row).from(place.centre_px);
                let covered = sight.covered([across, down]);
                if covered > 0.0 {
                    let depth = covered * sampled.mean_depth(&sight, blur);
                    self.lay(&mut values[column], covered, depth);
                }
            }
        }
    }

    fn lay(&self, value: &mut f32, covered: f64, depth: f64) {
        let light = self.tone * covered - self.speckle_depth * depth;
        *value += (light - covered * f64::from(*value)) as f32;
    }
}

impl Sight {
    /// The share of the pixel that a rectangle around the origin covers, taking the pixel for upright.
    fn covered(&self, sides: [Smear; 2]) -> f64 {
        let size_px = [self.across_px[0].abs(), self.down_px[1].abs()];
        let share = |axis: usize| {
            let edge = |side: f64| sides[axis].covered_up_to(self.centre_px[axis] + side * size_px[axis]);
            (edge(0.5) - edge(-0.5)) / size_px[axis]
        };
        share(0) * share(1)
    }
}
