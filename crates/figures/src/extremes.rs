use std::path::Path;

use chainwave_measurement::Estimate;

use crate::colour::{BLUE, GRAY, VERMILLION};
use crate::drawing::{Dash, Drawing, NUMBER_MM, Stroke};
use crate::geometry::Frame;
use crate::legend::{self, Entry, Key};
use crate::plot::{BOTTOM_MARGIN_MM, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{Look, Marker, MarkerShape, Point};
use crate::{FigureError, output};

const ROW_MM: f64 = 3.4;
/// Errors are drawn from this share of their bound on; an exact result stands at the edge.
const LEAST_SHARE: f64 = 1e-10;
const PASSED: Marker = Marker { shape: MarkerShape::Circle, colour: BLUE, hollow: false };
const REFUSED: Marker = Marker { shape: MarkerShape::Square, colour: BLUE, hollow: true };
const FAILED: Marker = Marker { shape: MarkerShape::Diamond, colour: VERMILLION, hollow: false };

/// One extreme case.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtremeRow {
    /// What was tried.
    pub name: String,
    /// The error over its bound; none where the case was refused.
    pub share_of_bound: Option<f64>,
    /// Whether it ended as expected.
    pub passed: bool,
}

/// Draws extreme cases, a row for each: the error over its bound on a logarithmic axis; a refusal stands at the bound.
///
/// # Errors
/// [`FigureError`] when there is no row, or a file cannot be written.
pub fn extremes(stem: &Path, rows: &[ExtremeRow]) -> Result<(), FigureError> {
    output::write(stem, &layout(stem, rows)?)
}

fn layout(stem: &Path, rows: &[ExtremeRow]) -> Result<Drawing, FigureError> {
    if rows.is_empty() {
        return Err(FigureError::NoPanels { stem: stem.into() });
    }
    let mut drawing = Drawing::new(Drawing::TWO_COLUMNS_MM)?;
    let room_mm = 0.5 * Drawing::TWO_COLUMNS_MM;
    let names: Vec<String> = rows.iter().map(|row| drawing.fitted(&row.name, NUMBER_MM, room_mm)).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let left = names.iter().map(|name| drawing.text_width(name, NUMBER_MM)).fold(0.0, f64::max) + 3.0;
    let entries = [
        Entry::new("within its bound", Key::Marker(PASSED)),
        Entry::new("refused with a reason", Key::Marker(REFUSED)),
        Entry::new("failed", Key::Marker(FAILED)),
    ];
    let top = legend::draw(&mut drawing, &entries, (left, Drawing::TWO_COLUMNS_MM), 1.0) + 1.5;
    let frame = Frame::new(left, top, Drawing::TWO_COLUMNS_MM - left - 3.0, ROW_MM * rows.len() as f64);
    let y = Scale::linear(Some(Extent { low: 0.5 - rows.len() as f64, high: 0.5 }));
    let plot = Plot { frame, x: Scale::log(Some(reach(rows))), y };
    plot.upright(&mut drawing, 1.0, Stroke::new(0.6, GRAY, Dash::Dashed));
    for (marker, points) in sorted(rows) {
        plot.series(&mut drawing, &points, Look::Markers(marker));
    }
    plot.named_rows(&mut drawing, "error over its bound", &names);
    drawing.extend_to(frame.bottom + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

/// The rows' points by their marker.
fn sorted(rows: &[ExtremeRow]) -> [(Marker, Vec<Point>); 3] {
    let mut points = [(PASSED, Vec::new()), (REFUSED, Vec::new()), (FAILED, Vec::new())];
    for (i, row) in rows.iter().enumerate() {
        let kind = match row {
            ExtremeRow { passed: false, .. } => 2,
            ExtremeRow { share_of_bound: None, .. } => 1,
            _ => 0,
        };
        let y = Estimate::new(-(i as f64), 0.0);
        points[kind].1.push(Point { x: Estimate::new(shown(row), 0.0), y });
    }
    points
}

fn shown(row: &ExtremeRow) -> f64 {
    row.share_of_bound.filter(|share| share.is_finite()).unwrap_or(1.0).max(LEAST_SHARE)
}

/// All shares and the bound, with room for the markers.
fn reach(rows: &[ExtremeRow]) -> Extent {
    let shares = || rows.iter().map(shown);
    Extent { low: shares().fold(0.1, f64::min) / 3.0, high: 3.0 * shares().fold(1.0, f64::max) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_is_named_and_nothing_overlaps() {
        let row = |name: &str, share_of_bound: Option<f64>, passed: bool| ExtremeRow {
            name: name.into(),
            share_of_bound,
            passed,
        };
        let rows = [
            row("striker velocity, velocity_m_per_s = 1e-9", Some(1e-3), true),
            row("exact", Some(0.0), true),
            row("out of reach", None, true),
            row("wrong", Some(30.0), false),
            row("not even a number", Some(f64::NAN), false),
        ];
        let drawing = layout(Path::new("x"), &rows).unwrap();
        drawing.assert_readable();
        let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
        assert!(rows.iter().all(|row| texts.contains(&row.name)), "{texts:?}");
        assert!(layout(Path::new("x"), &[]).is_err());
    }
}
