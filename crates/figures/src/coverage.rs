use std::path::Path;

use chainwave_measurement::Estimate;

use crate::colour::{BLUE, GRAY, SKY_BLUE, VERMILLION};
use crate::drawing::{Dash, Drawing, NUMBER_MM, Stroke};
use crate::geometry::Frame;
use crate::legend::{self, Entry, Key};
use crate::plot::{BOTTOM_MARGIN_MM, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{Look, Marker, MarkerShape, Point};
use crate::{FigureError, output};

const ROW_MM: f64 = 4.2;
/// Bands around the nominal shares that count as right.
const BANDS: [(f64, f64); 2] = [(0.66, 0.70), (0.93, 0.97)];
const MARKER_68: Marker = Marker { shape: MarkerShape::Square, colour: VERMILLION, hollow: true };
const MARKER_95: Marker = Marker { shape: MarkerShape::Circle, colour: BLUE, hollow: false };

/// How often the stated intervals of one quantity hold its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct CoverageRow {
    /// Name of the quantity.
    pub quantity: String,
    /// Share of the 68 % intervals that hold the truth, from 0 to 1.
    pub within_68: Estimate,
    /// Share of the 95 % intervals.
    pub within_95: Estimate,
}

/// Draws the coverage of stated intervals, a row for each quantity; bands of 66 to 70 and 93 to 97 % are shaded.
///
/// # Errors
/// [`FigureError`] when there is no row, or a file cannot be written.
pub fn coverage(stem: &Path, rows: &[CoverageRow]) -> Result<(), FigureError> {
    output::write(stem, &layout(stem, rows)?)
}

fn layout(stem: &Path, rows: &[CoverageRow]) -> Result<Drawing, FigureError> {
    if rows.is_empty() {
        return Err(FigureError::NoPanels { stem: stem.into() });
    }
    let mut drawing = Drawing::new(Drawing::ONE_COLUMN_MM)?;
    let names: Vec<&str> = rows.iter().map(|row| row.quantity.as_str()).collect();
    let widest = names.iter().map(|name| drawing.text_width(name, NUMBER_MM)).fold(0.0, f64::max);
    let left = widest + 3.0;
    let entries = [
        Entry::new("68 % intervals", Key::Marker(MARKER_68)),
        Entry::new("95 % intervals", Key::Marker(MARKER_95)),
    ];
    let top = legend::draw(&mut drawing, &entries, (left, Drawing::ONE_COLUMN_MM), 1.0) + 1.5;
    let frame = Frame::new(left, top, Drawing::ONE_COLUMN_MM - left - 3.0, ROW_MM * rows.len() as f64);
    let y = Scale::linear(Some(Extent { low: 0.5 - rows.len() as f64, high: 0.5 }));
    let plot = Plot { frame, x: Scale::linear(Some(reach(rows))), y };
    for (low, high) in BANDS {
        plot.shade(&mut drawing, (100.0 * low, 100.0 * high), SKY_BLUE.tint(0.65));
    }
    for level in [68.0, 95.0] {
        plot.upright(&mut drawing, level, Stroke::new(0.6, GRAY, Dash::Dashed));
    }
    let points = |share: fn(&CoverageRow) -> Estimate| -> Vec<Point> {
        let point = |(i, row)| Point { x: share(row).scaled(100.0), y: Estimate::new(-(i as f64), 0.0) };
        rows.iter().enumerate().map(point).collect()
    };
    plot.series(&mut drawing, &points(|row| row.within_68), Look::Markers(MARKER_68));
    plot.series(&mut drawing, &points(|row| row.within_95), Look::Markers(MARKER_95));
    plot.named_rows(&mut drawing, "truths inside the stated interval (%)", &names);
    drawing.extend_to(frame.bottom + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

/// From a round number below everything to a little above 100 %.
fn reach(rows: &[CoverageRow]) -> Extent {
    let shares = rows.iter().flat_map(|row| [row.within_68, row.within_95]);
    let lowest = shares.map(|share| share.value - share.sigma).fold(0.6, f64::min);
    Extent { low: (1000.0 * (lowest - 0.02).max(0.0)).floor() / 10.0, high: 102.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_quantity_is_named_and_nothing_overlaps() {
        let row = |quantity: &str, inner: f64| CoverageRow {
            quantity: quantity.into(),
            within_68: Estimate::new(inner, 0.03),
            within_95: Estimate::new(0.95, 0.01),
        };
        let rows = [row("group velocity", 0.70), row("c_s, tracks", 0.31)];
        let drawing = layout(Path::new("x"), &rows).unwrap();
        drawing.assert_readable();
        let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
        assert!(texts.contains(&"group velocity".into()) && texts.contains(&"c_s, tracks".into()));
        assert!(layout(Path::new("x"), &[]).is_err());
    }
}
