//! The wall behind the chain: soft blots, fixed in the laboratory.

use rand::RngExt;

use crate::blur::Blur;
use crate::canvas::Canvas;
use crate::seed::{Purpose, stream};
use crate::settings::Tones;
use crate::view::PixelView;

/// Side of the square cells that hold one blot each, in pixels.
const CELL_PX: f64 = 20.0;

/// Range of the blots' standard deviations, in pixels: soft beside the speckles.
const BLOT_SIGMA_PX: [f64; 2] = [4.0, 10.0];

/// Standard deviations after which a blot is left out.
const REACH_SIGMA: f64 = 4.0;

/// How the backdrop is seen.
#[derive(Clone, Copy)]
pub(crate) struct Prospect {
    /// Where the chain's origin lies in the ideal picture.
    pub(crate) origin_px: [f64; 2],
    /// How much larger than stated the picture is.
    pub(crate) magnification: f64,
    pub(crate) blur: Blur,
}

/// Draws the backdrop: soft blots that are fixed in the laboratory, so that a view from another stage position sees
/// another part of the same wall.
pub(crate) fn draw(tones: &Tones, prospect: &Prospect, view: &PixelView, canvas: &mut Canvas) {
    canvas.drawn_mut().fill(tones.backdrop as f32);
    let Prospect { origin_px, magnification, .. } = *prospect;
    let [columns, rows] = seen(view, canvas);
    let reach_px = REACH_SIGMA * prospect.blur.widened(BLOT_SIGMA_PX[1] * magnification).0;
    let cells = |origin_px: f64, [low_px, high_px]: [f64; 2]| {
        let cell = |at_px: f64| ((at_px - origin_px) / (CELL_PX * magnification)).floor() as i64;
        cell(low_px - reach_px)..=cell(high_px + reach_px)
    };
    let mut along_x = Vec::new();
    for row in cells(origin_px[1], rows) {
        for column in cells(origin_px[0], columns) {
            let blot = Blot::in_cell(column, row, tones.blot).seen(prospect);
            match view.is_warped() {
                true => blot.draw_sampled(view, canvas),
                false => blot.draw(canvas, &mut along_x),
            }
        }
    }
    for value in canvas.drawn_mut() {
        *value = value.max(0.0);
    }
}

/// Lowest and highest column, and lowest and highest row, of the ideal picture that the drawn part of the frame shows.
fn seen(view: &PixelView, canvas: &Canvas) -> [[f64; 2]; 2] {
    let drawn = canvas.rows();
    if !view.is_warped() {
        return [[0.0, canvas.width_px as f64], [drawn.start as f64, drawn.end as f64]];
    }
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for row in drawn {
        for column in 0..canvas.width_px {
            for (bounds, at_px) in bounds.iter_mut().zip(view.sight(column, row).centre_px) {
                *bounds = [bounds[0].min(at_px), bounds[1].max(at_px)];
            }
        }
    }
    bounds
}

/// One soft spot: as drawn from its cell, in pixels from the chain's origin; as seen, in pixels of the ideal picture.
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

    /// The blot in the ideal picture.
    fn seen(self, Prospect { origin_px, magnification, blur }: &Prospect) -> Self {
        let (sigma_px, lowered) = blur.widened(self.sigma_px * magnification);
        Self {
            x_px: self.x_px * magnification + origin_px[0],
            y_px: self.y_px * magnification + origin_px[1],
            sigma_px,
            height: self.height * lowered * lowered,
        }
    }

    /// `along_x` is scratch.
    fn draw(&self, canvas: &mut Canvas, along_x: &mut Vec<f64>) {
        let reach_px = REACH_SIGMA * self.sigma_px;
        let pixels = |at_px: f64, limit: usize| {
            let inside = |edge_px: f64| edge_px.ceil().clamp(0.0, limit as f64) as usize;
            inside(at_px - reach_px)..inside(at_px + reach_px)
        };
        let span = pixels(self.x_px, canvas.width_px);
        along_x.clear();
        along_x.extend(span.clone().map(|column| self.profile(column as f64 - self.x_px)));
        for row in canvas.drawn(pixels(self.y_px, canvas.height_px())) {
            let along_y = self.height * self.profile(row as f64 - self.y_px);
            for (value, along_x) in canvas.row_mut(row)[span.clone()].iter_mut().zip(&*along_x) {
                *value += (along_y * along_x) as f32;
            }
        }
    }

    /// As [`Blot::draw`], where pixels look elsewhere than an ideal camera's.
    fn draw_sampled(&self, view: &PixelView, canvas: &mut Canvas) {
        let centre_px = [self.x_px, self.y_px];
        let [columns, rows] = view.region(centre_px, [REACH_SIGMA * self.sigma_px; 2]);
        for row in canvas.drawn(rows) {
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
