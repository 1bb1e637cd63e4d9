use rand::RngExt;

use crate::scene::Canvas;
use crate::seed::{Purpose, stream};
use crate::settings::Tones;

/// Side of the square cells that hold one blot each, in pixels.
const CELL_PX: f64 = 20.0;

/// Range of the blots' standard deviations, in pixels: soft beside the speckles.
const BLOT_SIGMA_PX: [f64; 2] = [4.0, 10.0];

/// Standard deviations after which a blot is left out.
const REACH_SIGMA: f64 = 4.0;

/// Draws the backdrop: soft blots that are fixed in the laboratory, so that a view from another stage position sees
/// another part of the same wall. `origin_px` is where the chain's origin lies in the picture.
pub(crate) fn draw(tones: &Tones, origin_px: [f64; 2], canvas: &mut Canvas) {
    canvas.values.fill(tones.backdrop as f32);
    let reach_px = REACH_SIGMA * BLOT_SIGMA_PX[1];
    let cells = |origin_px: f64, size_px: usize| {
        let cell = |at_px: f64| ((at_px - origin_px) / CELL_PX).floor() as i64;
        cell(-reach_px)..=cell(size_px as f64 + reach_px)
    };
    for row in cells(origin_px[1], canvas.height_px()) {
        for column in cells(origin_px[0], canvas.width_px) {
            Blot::in_cell(column, row, tones.blot).draw(origin_px, canvas);
        }
    }
    for value in &mut canvas.values {
        *value = value.max(0.0);
    }
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

    fn profile(&self, distance_px: f64) -> f64 {
        libm::exp(-0.5 * (distance_px / self.sigma_px).powi(2))
    }
}
