//! A frame of a recording with the subsets that lie on it.

use serde::{Deserialize, Serialize};

use crate::colour::{BLACK, CHAIN, Rgb};
use crate::drawing::{Anchor, Columns, Drawing, Raster};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::plot::{self, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::DataPoint;
use crate::stroke::{Dash, Stroke};
use crate::{FigureError, Style};

/// A frame in gray with subsets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkedFrame {
    /// Columns and rows of the frame, in pixels.
    pub size_px: [usize; 2],
    /// Columns and rows of the picture, which may be smaller.
    pub picture_px: [usize; 2],
    /// Gray levels of the picture, row by row from the top.
    pub grays: Vec<u8>,
    /// What is marked.
    pub subsets: Vec<MarkedSubset>,
}

/// A rectangle of pixels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkedSubset {
    /// What is written above it.
    pub name: String,
    /// Column and row of its centre; the middle of the top left pixel is (0, 0).
    pub centre_px: [f64; 2],
    /// Columns on each side of the centre, and rows above and below.
    pub half_px: [usize; 2],
}

impl Draw for MarkedFrame {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

const LABELS: Labels = Labels { x: "column (px)", y: "row (px)" };
/// The largest and the least height of the frame on the page.
const HEIGHTS_MM: (f64, f64) = (15.0, 120.0);
/// Between a subset and its name.
const GAP_MM: f64 = 0.6;
const WIDTH_PT: f64 = 0.9;

fn layout(style: &Style, frame: &MarkedFrame) -> Result<Drawing, FigureError> {
    let [width_px, height_px] = frame.picture_px;
    let (expected, found) = (width_px * height_px, frame.grays.len());
    if expected != found || expected == 0 {
        return Err(FigureError::Length {
            figure: "marked frame",
            what: "gray levels".into(),
            expected,
            found,
        });
    }
    let mut drawing = Drawing::new(style, Columns::Two)?;
    let extent = |n: usize| Extent { low: -0.5, high: n as f64 - 0.5 };
    let [columns, rows] = frame.size_px.map(|n| extent(n.max(1)));
    let (x, y) = (Scale::linear(Some(columns)), Scale::linear(Some(rows)).downwards());
    let left = plot::side_margin_mm(&drawing, &y, HEIGHTS_MM.1);
    let widest = drawing.width_mm - left - 1.5;
    let ratio = (rows.high - rows.low) / (columns.high - columns.low);
    let height = (widest * ratio).clamp(HEIGHTS_MM.0, HEIGHTS_MM.1);
    let size = PageRect::new(left, 1.5, widest.min((height / ratio).max(HEIGHTS_MM.0)), height);
    let plot = Plot::new(size, x, y);
    let pixels = frame.grays.iter().map(|&gray| Rgb(gray, gray, gray)).collect();
    drawing.picture(size, Raster { width_px, height_px, pixels });
    for subset in &frame.subsets {
        draw_subset(&mut drawing, &plot, subset);
    }
    plot.map_axes(&mut drawing, LABELS);
    let centres: Vec<DataPoint> = frame
        .subsets
        .iter()
        .map(|subset| DataPoint::exact(subset.centre_px[0], subset.centre_px[1]))
        .collect();
    plot::record(&mut drawing, "", "centres of subsets", LABELS, &centres);
    drawing.extend_to(size.bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

/// The outline of a subset, and its name where there is room above it.
fn draw_subset(drawing: &mut Drawing, plot: &Plot, subset: &MarkedSubset) {
    let half = subset.half_px.map(|half| half as f64 + 0.5);
    let corner =
        |along: f64, down: f64| (subset.centre_px[0] + along * half[0], subset.centre_px[1] + down * half[1]);
    let outline =
        [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0)];
    for piece in plot.pieces(&outline) {
        drawing.rimmed_line(&piece, Stroke::new(WIDTH_PT, CHAIN, Dash::Solid), BLACK);
    }
    let em_mm = drawing.number_mm();
    let top = corner(0.0, -1.0);
    let Some((middle, edge)) = plot.spot(top.0, top.1) else { return };
    let fits = edge - GAP_MM - em_mm > plot.frame.top;
    let wide = drawing.text_width(&subset.name, em_mm);
    let room = plot.frame.left + 0.5 * wide < middle && middle < plot.frame.right - 0.5 * wide;
    if fits && room {
        let plate = PageRect::new(middle - 0.5 * wide - 0.4, edge - GAP_MM - em_mm, wide + 0.8, em_mm);
        drawing.fill(plate, CHAIN);
        drawing.text(&subset.name, (middle, edge - GAP_MM - 0.5 * em_mm), em_mm, Anchor::Middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> MarkedFrame {
        let subset = |n: usize| MarkedSubset {
            name: n.to_string(),
            centre_px: [60.0 + 90.0 * n as f64, 48.0],
            half_px: [16, 16],
        };
        MarkedFrame {
            size_px: [512, 96],
            picture_px: [256, 48],
            grays: (0..256 * 48).map(|i| (i % 251) as u8).collect(),
            subsets: (0..5).map(subset).collect(),
        }
    }

    #[test]
    fn subsets_are_named_and_nothing_overlaps() {
        let drawing = layout(&Style::default(), &frame()).unwrap();
        drawing.assert_readable();
        for label in ["column (px)", "row (px)", "0", "4"] {
            assert!(drawing.says(label), "{label} of {:?}", drawing.labels());
        }
        assert_eq!(drawing.data[0].rows.len(), 5);
    }

    #[test]
    fn a_picture_of_another_size_is_refused_and_no_subset_is_no_failure() {
        let short = MarkedFrame { grays: vec![0; 7], ..frame() };
        assert!(layout(&Style::default(), &short).unwrap_err().to_string().contains("expected 12288"));
        assert!(layout(&Style::default(), &MarkedFrame { subsets: Vec::new(), ..frame() }).is_ok());
        let tall =
            MarkedFrame { size_px: [20, 4000], picture_px: [20, 4000], grays: vec![9; 80_000], ..frame() };
        assert!(layout(&Style::default(), &tall).is_ok());
    }
}
