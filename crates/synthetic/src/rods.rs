use std::ops::Range;

use crate::canvas::Canvas;
use crate::settings::{Camera, Specimen};
use crate::view::View;

/// Samples over the visible part of a pixel; the highlight is several pixels wide.
const SAMPLES: usize = 16;

/// Where the light source's reflection stands on the rod's front, in radii above the axis, and how wide it is.
const HIGHLIGHT: [f64; 2] = [0.35, 0.30];

/// Brightness of the rod beside the highlight, relative to it.
const SHADE: f64 = 0.25;

/// The rods as horizontal bars: what each pixel that they reach lets through and what it adds.
pub(crate) struct RodPixels {
    runs: Vec<RodRun>,
}

/// Neighbouring pixels of a row that the rods cover alike: in a straight view, a whole row.
struct RodRun {
    row: usize,
    columns: Range<usize>,
    part: RodPart,
}

/// What a rod does to a pixel.
#[derive(Clone, Copy)]
struct RodPart {
    covered: f32,
    light: f32,
}

impl RodPixels {
    /// The rods of a chain whose axis lies at the row `axis_px` of the ideal picture.
    pub(crate) fn new(specimen: &Specimen, camera: &Camera, axis_px: f64, view: &View) -> Self {
        let radius_px = specimen.rods.diameter_m / 2.0 * camera.scale_px_per_m;
        let mut runs = Vec::new();
        for below_m in &specimen.rods.below_axis_m {
            let centre_px = axis_px + below_m * camera.scale_px_per_m;
            let run = |row: usize, columns: Range<usize>| {
                let at_px = view.sight(columns.start, row).centre_px[1];
                let part = rod_part(at_px, centre_px, radius_px, specimen.tones.rod)?;
                Some(RodRun { row, columns, part })
            };
            for row in 0..camera.height_px {
                let pixels = if view.is_warped() { 1 } else { camera.width_px };
                let starts = (0..camera.width_px).step_by(pixels);
                runs.extend(starts.filter_map(|column| run(row, column..column + pixels)));
            }
        }
        Self { runs }
    }

    /// Lays the rods over the canvas.
    pub(crate) fn draw(&self, canvas: &mut Canvas) {
        for RodRun { row, columns, part } in &self.runs {
            for value in &mut canvas.row_mut(*row)[columns.clone()] {
                *value += part.light - part.covered * *value;
            }
        }
    }
}

/// A rod's part of a pixel whose centre looks at the height `at_px`, taking the pixel for upright; `None` where it does not
/// reach.
fn rod_part(at_px: f64, centre_px: f64, radius_px: f64, tone: f64) -> Option<RodPart> {
    let top = (at_px - 0.5 - centre_px).max(-radius_px);
    let bottom = (at_px + 0.5 - centre_px).min(radius_px);
    let covered = bottom - top;
    if covered <= 0.0 {
        return None;
    }
    let sample = |index: usize| top + (index as f64 + 0.5) / SAMPLES as f64 * covered;
    let mean = (0..SAMPLES).map(|index| brightness(sample(index) / radius_px)).sum::<f64>() / SAMPLES as f64;
    Some(RodPart { covered: covered as f32, light: (tone * covered * mean) as f32 })
}

/// Brightness of a polished cylinder lit from above, at `below` radii under its axis; 1 at the highlight.
fn brightness(below: f64) -> f64 {
    let from_highlight = (below + HIGHLIGHT[0]) / HIGHLIGHT[1];
    let facing = (1.0 - below * below).max(0.0).sqrt();
    SHADE * facing + (1.0 - SHADE) * libm::exp(-from_highlight * from_highlight)
}
