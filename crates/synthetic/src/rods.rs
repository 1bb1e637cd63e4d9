//! The rods: polished cylinders in front of the chain.

use std::ops::Range;

use crate::blur::Blur;
use crate::canvas::Canvas;
use crate::settings::Specimen;
use crate::smear::Smear;
use crate::view::PixelView;

/// Samples over the visible part of a pixel; the highlight is several pixels wide.
const SAMPLES: usize = 16;

/// Where the light source's reflection stands on the rod's front, in radii above the axis, and how wide it is.
const HIGHLIGHT: [f64; 2] = [0.35, 0.30];

/// Brightness of the rod beside the highlight, relative to it.
const SHADE: f64 = 0.25;

/// The rods as horizontal bars: what each pixel that they reach lets through and what it adds.
#[derive(Default)]
pub(crate) struct RodPixels {
    runs: Vec<RodRun>,
}

/// Neighbouring pixels of a row that the rods cover alike: in a straight view, a whole row.
struct RodRun {
    row: usize,
    columns: Range<usize>,
    part: RodPart,
}

/// How the rods are seen.
pub(crate) struct RodView {
    pub(crate) scale_px_per_m: f64,
    /// Row of the chain's axis in the ideal picture.
    pub(crate) axis_px: f64,
    pub(crate) width_px: usize,
    pub(crate) defocus_px: f64,
}

/// What a rod does to a pixel.
#[derive(Clone, Copy)]
struct RodPart {
    covered: f32,
    light: f32,
}

impl RodPixels {
    /// The rods of a chain whose axis lies at the row `axis_px` of the ideal picture, in some rows of the frame.
    pub(crate) fn new(specimen: &Specimen, rod_view: &RodView, view: &PixelView, rows: Range<usize>) -> Self {
        let RodView { scale_px_per_m, axis_px, width_px, defocus_px } = *rod_view;
        let radius_px = specimen.rods.diameter_m / 2.0 * scale_px_per_m;
        let blur = Blur { path_px: 0.0, defocus_px };
        let mut runs = Vec::new();
        for below_m in &specimen.rods.below_axis_m {
            let centre_px = axis_px + below_m * scale_px_per_m;
            let run = |row: usize, columns: Range<usize>| {
                let at_px = view.sight(columns.start, row).centre_px[1];
                let part = match blur.is_focused() {
                    true => rod_part(at_px, centre_px, radius_px, specimen.tones.rod),
                    false => soft_rod_part(at_px - centre_px, radius_px, specimen.tones.rod, blur),
                };
                Some(RodRun { row, columns, part: part? })
            };
            for row in rows.clone() {
                let pixels = if view.is_warped() { 1 } else { width_px };
                let starts = (0..width_px).step_by(pixels);
                runs.extend(starts.filter_map(|column| run(row, column..column + pixels)));
            }
        }
        Self { runs }
    }

    /// Lays the rods over the canvas.
    pub(crate) fn draw(&self, canvas: &mut Canvas) {
        let rows = canvas.rows();
        for RodRun { row, columns, part } in self.runs.iter().filter(|run| rows.contains(&run.row)) {
            for value in &mut canvas.row_mut(*row)[columns.clone()] {
                *value += part.light - part.covered * *value;
            }
        }
    }
}

/// A rod's part of a pixel whose centre looks at the height `at_px`, taking the pixel for upright; `None` where it does
/// not reach.
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

/// As [`rod_part`], `below_px` under the axis and out of focus: what the pixel collects of each line across the rod is a difference of the normal
/// distribution.
fn soft_rod_part(below_px: f64, radius_px: f64, tone: f64, blur: Blur) -> Option<RodPart> {
    let spread_px = 0.5 + blur.reach_px();
    let top = (below_px - spread_px).max(-radius_px);
    let bottom = (below_px + spread_px).min(radius_px);
    if bottom <= top {
        return None;
    }
    let n_lines = (SAMPLES as f64 * (bottom - top)).ceil();
    let line_px = (bottom - top) / n_lines;
    let across = Smear { half_px: line_px / 2.0, blur };
    let (mut covered, mut light) = (0.0, 0.0);
    for index in 0..n_lines as usize {
        let at_px = top + (index as f64 + 0.5) * line_px;
        let edge = |side: f64| across.covered_up_to(below_px + side - at_px);
        let share = edge(0.5) - edge(-0.5);
        covered += share;
        light += share * brightness(at_px / radius_px);
    }
    Some(RodPart { covered: covered as f32, light: (tone * light) as f32 })
}

/// Brightness of a polished cylinder lit from above, at `below` radii under its axis; 1 at the highlight.
fn brightness(below: f64) -> f64 {
    let from_highlight = (below + HIGHLIGHT[0]) / HIGHLIGHT[1];
    let facing = (1.0 - below * below).max(0.0).sqrt();
    SHADE * facing + (1.0 - SHADE) * libm::exp(-from_highlight * from_highlight)
}
