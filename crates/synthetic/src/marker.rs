use std::sync::OnceLock;

use crate::canvas::Canvas;
use crate::sampled::Sampled;
use crate::smear::Smear;
use crate::speckle::{Axis, Pattern};
use crate::view::{Sight, View};

/// Where a body is in the ideal picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// Its centre (column, row) in the middle of the exposure.
    pub(crate) centre_px: [f64; 2],
    /// How far it moves along the chain during the exposure.
    pub(crate) blur_px: f64,
}

/// A flat rectangle, speckled or not. Bodies move along the rows only, so the rows' integrals are computed once.
pub(crate) struct Plate {
    pattern: Pattern,
    rows: Axis,
    /// For a view that is not straight.
    sampled: OnceLock<Sampled>,
    tone: f64,
    speckle_depth: f64,
}

impl Plate {
    /// A plate of a tone, whose speckles take `speckle_depth` of it away; its centre stays in the row `row_px`.
    pub(crate) fn new(pattern: Pattern, row_px: f64, tone: f64, speckle_depth: f64) -> Self {
        Self { rows: pattern.rows(row_px), pattern, sampled: OnceLock::new(), tone, speckle_depth }
    }

    /// Lays the plate over the canvas; `depths` is scratch.
    pub(crate) fn draw(&self, place: Place, view: &View, canvas: &mut Canvas, depths: &mut Vec<f64>) {
        match view.is_warped() {
            true => self.draw_sampled(place, view, canvas),
            false => self.draw_upright(place, canvas, depths),
        }
    }

    fn draw_upright(&self, place: Place, canvas: &mut Canvas, depths: &mut Vec<f64>) {
        let columns = self.pattern.columns(place.centre_px[0], place.blur_px);
        self.pattern.add_up(&columns, &self.rows, depths);
        let first = columns.first_px.clamp(0, canvas.width_px as i64);
        let hidden = (first - columns.first_px) as usize;
        let top = self.rows.first_px;
        for ((row, height), depths) in
            (top..).zip(&self.rows.covered).zip(depths.chunks_exact(columns.n_pixels()))
        {
            let Some(row) = usize::try_from(row).ok().filter(|&row| row < canvas.height_px()) else {
                continue;
            };
            let pixels = canvas.row_mut(row)[first as usize..].iter_mut();
            for ((value, width), depth) in
                pixels.zip(columns.covered.iter().skip(hidden)).zip(depths.iter().skip(hidden))
            {
                self.lay(value, width * height, *depth);
            }
        }
    }

    fn draw_sampled(&self, place: Place, view: &View, canvas: &mut Canvas) {
        let sampled = self.sampled.get_or_init(|| Sampled::new(&self.pattern));
        let across = Smear { half_px: self.pattern.half_width_px, blur_px: place.blur_px };
        let down = Smear { half_px: self.pattern.half_height_px, blur_px: 0.0 };
        let half_px = [across.half_px + across.spread_px(), down.half_px];
        let [columns, rows] = view.region(place.centre_px, half_px);
        for row in rows {
            let values = canvas.row_mut(row);
            for column in columns.clone() {
                let sight = view.sight(column, row).from(place.centre_px);
                let covered = sight.covered([across, down]);
                if covered > 0.0 {
                    let depth = covered * sampled.mean_depth(&sight, place.blur_px);
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
