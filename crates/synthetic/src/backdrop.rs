use rand::RngExt;

use crate::canvas::Canvas;
use crate::seed::{Purpose, stream};
use crate::settings::Tones;
use crate::view::View;

/// Side of the square cells that hold one blot each, in pixels.
const CELL_PX: f64 = 20.0;

/// Range of the blots' standard deviations, in pixels: soft beside the speckles.
const BLOT_SIGMA_PX: [f64; 2] = [4.0, 10.0];

/// Standard deviations after which a blot is left out.
const REACH_SIGMA: f64 = 4.0;

/// Draws the backdrop: soft blots that are fixed in the laboratory, so that a view from another stage position sees
/// another part of the same wall. `origin_px` is where the chain's origin lies in the ideal picture.
pub(crate) fn draw(tones: &Tones, origin_px: [f64; 2], view: &View, canvas: &mut Canvas) {
    canvas.values.fill(tones.backdrop as f32);
    let [columns, rows] = seen(view, canvas);
    let reach_px = REACH_SIGMA * BLOT_SIGMA_PX[1];
    let cells = |origin_px: f64, [low_px, high_px]: [f64; 2]| {
        let cell = |at_px: f64| ((at_px - origin_px) / CELL_PX).floor() as i64;
        cell(low_px - reach_px)..=cell(high_px + reach_px)
    };
    for row in cells(origin_px[1], rows) {
        for column in cells(origin_px[0], columns) {
            let blot = Blot::in_cell(column, row, tones.blot);
            match view.is_warped() {
                true => blot.draw_sampled(origin_px, view, canvas),
                false => blot.draw(origin_px, canvas),
            }
        }
    }
    for value in &mut canvas.values {
        *value = value.max(0.0);
    }
}

/// Lowest and highest column, and lowest and highest row, of the ideal picture that the frame shows.
fn seen(view: &View, canvas: &Canvas) -> [[f64; 2]; 2] {
    let size_px = [canvas.width_px, canvas.height_px()];
    if !view.is_warped() {
        return size_px.map(|size_px| [0.0, size_px as f64]);
    }
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for row in 0..size_px[1] {
        for column in 0..size_px[0] {
            for (bounds, at_px) in bounds.iter_mut().zip(view.sight(column, row).centre_px) {
                *bounds = [bounds[0].min(at_px), bounds[1].max(at_px)];
            }
        }
    }
    bounds
}

/// One soft spot, in pixels from the chain's origin.
struct Blot {
    x_px: f64,
    y_px: f64,
    sigma_px: f64,
    height: f64,
}

impl Blot {
    fn in_cell(column: i64, row: i64, largest: f64) -> Self {
        let mut random = stream(Purpose::Backdrop, column.cast_unsigned(), row.cast_unsigned());
        Self {
            x_px: (column as f64 + random.random::<f64>()) * CELL_PX,
            y_px: (row as f64 + random.random::<f64>()) * CELL_PX,
            sigma_px: random.random_range(BLOT_SIGMA_PX[0]..BLOT_SIGMA_PX[1]),
            height: largest * random.random_range(-1.0..1.0),
        }
    }

    fn draw(&self, origin_px: [f64; 2], canvas: &mut Canvas) {
        let [x_px, y_px] = [self.x_px + origin_px[0], self.y_px + origin_px[1]];
        let reach_px = REACH_SIGMA * self.sigma_px;
        let pixels = |at_px: f64, limit: usize| {
            let inside = |edge_px: f64| edge_px.ceil().clamp(0.0, limit as f64) as usize;
            inside(at_px - reach_px)..inside(at_px + reach_px)
        };
        for row in pixels(y_px, canvas.height_px()) {
            let span = pixels(x_px, canvas.width_px);
            let along_y = self.height * self.profile(row as f64 - y_px);
            for (value, column) in canvas.row_mut(row)[span.clone()].iter_mut().zip(span) {
                *value += (along_y * self.profile(column as f64 - x_px)) as f32;
            }
        }
    }

    /// As [`Blot::draw`], where pixels look elsewhere than an ideal camera's.
    fn draw_sampled(&self, origin_px: [f64; 2], view: &View, canvas: &mut Canvas) {
        let centre_px = [self.x_px + origin_px[0], self.y_px + origin_px[1]];
        let [columns, rows] = view.region(centre_px, [REACH_SIGMA * self.sigma_px; 2]);
        for row in rows {
            let values = canvas.row_mut(row);
            for column in columns.clone() {
                let [x_px, y_px] = view.sight(column, row).from(centre_px).centre_px;
                values[column] += (self.height * self.profile(x_px.hypot(y_px))) as f32;
            }
        }
    }

    fn profile(&self, distance_px: f64) -> f64 {
        libm::exp(-0.5 * (distance_px / self.sigma_px).powi(2))
    }
}
