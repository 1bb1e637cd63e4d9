use crate::scene::Canvas;
use crate::settings::Specimen;

/// Samples over the visible part of a pixel; the highlight is several pixels wide.
const SAMPLES: usize = 16;

/// Where the light source's reflection stands on the rod's front, in radii above the axis, and how wide it is.
const HIGHLIGHT: [f64; 2] = [0.35, 0.30];

/// Brightness of the rod beside the highlight, relative to it.
const SHADE: f64 = 0.25;

/// The rods as horizontal bars: what each row lets through and what it adds.
pub(crate) struct RodRows {
    rows: Vec<RodRow>,
}

struct RodRow {
    row: usize,
    covered: f32,
    light: f32,
}

impl RodRows {
    /// The rods of a chain whose axis lies at the row `axis_px`, on `height_px` rows.
    pub(crate) fn new(specimen: &Specimen, scale_px_per_m: f64, axis_px: f64, height_px: usize) -> Self {
        let radius_px = specimen.rods.diameter_m / 2.0 * scale_px_per_m;
        let rod_rows = |below_m: &f64| {
            let centre_px = axis_px + below_m * scale_px_per_m;
            (0..height_px).filter_map(move |row| rod_row(row, centre_px, radius_px, specimen.tones.rod))
        };
        Self { rows: specimen.rods.below_axis_m.iter().flat_map(rod_rows).collect() }
    }

    /// Lays the rods over the canvas.
    pub(crate) fn draw(&self, canvas: &mut Canvas) {
        for rod in &self.rows {
            for value in canvas.row_mut(rod.row) {
                *value += rod.light - rod.covered * *value;
            }
        }
    }
}

/// A rod's part of a row; `None` where it does not reach.
fn rod_row(row: usize, centre_px: f64, radius_px: f64, tone: f64) -> Option<RodRow> {
    let top = (row as f64 - 0.5 - centre_px).max(-radius_px);
    let bottom = (row as f64 + 0.5 - centre_px).min(radius_px);
    let covered = bottom - top;
    if covered <= 0.0 {
        return None;
    }
    let sample = |index: usize| top + (index as f64 + 0.5) / SAMPLES as f64 * covered;
    let mean = (0..SAMPLES).map(|index| brightness(sample(index) / radius_px)).sum::<f64>() / SAMPLES as f64;
    Some(RodRow { row, covered: covered as f32, light: (tone * covered * mean) as f32 })
}

/// Brightness of a polished cylinder lit from above, at `below` radii under its axis; 1 at the highlight.
fn brightness(below: f64) -> f64 {
    let from_highlight = (below + HIGHLIGHT[0]) / HIGHLIGHT[1];
    let facing = (1.0 - below * below).max(0.0).sqrt();
    SHADE * facing + (1.0 - SHADE) * libm::exp(-from_highlight * from_highlight)
}
