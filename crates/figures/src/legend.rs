//! The legend: a sign and a name for each thing drawn, in as many columns as fit.

use crate::colour::{BLACK, BLANK, Rgb, WHITE};
use crate::drawing::{Anchor, Drawing};
use crate::geometry::PageRect;
use crate::plot::draw_marker;
use crate::series::{Look, PlotMarker};
use crate::stroke::Stroke;

/// The sign before a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LegendKey {
    Line(Stroke),
    Marker(PlotMarker),
    Area(Rgb),
    /// A line with the ground around it, such as its interval.
    Band(Stroke, Rgb),
    /// A black line with a white rim, as on maps.
    Rimmed(Stroke),
    /// Hatching.
    Hatch,
}

impl From<Look> for LegendKey {
    fn from(look: Look) -> Self {
        match look {
            Look::Line(stroke) => Self::Line(stroke),
            Look::Markers(marker) => Self::Marker(marker),
        }
    }
}

/// A line of the legend.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LegendEntry {
    pub(crate) name: String,
    pub(crate) key: LegendKey,
}

impl LegendEntry {
    pub(crate) fn new(name: impl Into<String>, key: impl Into<LegendKey>) -> Self {
        Self { name: name.into(), key: key.into() }
    }
}

/// Height of a row in em of its names.
const ROW_EM: f64 = 1.49;
const KEY_MM: f64 = 6.0;
const KEY_GAP_MM: f64 = 1.2;
/// Kept free before the right border.
const RIGHT_MARGIN_MM: f64 = 1.0;
const ENTRY_GAP_MM: f64 = 3.6;

/// Draws the legend in rows between `left` and `right`, from `top` down, where no data lie; gives its lower edge.
pub(crate) fn draw(
    drawing: &mut Drawing,
    entries: &[LegendEntry],
    (left, right): (f64, f64),
    top: f64,
) -> f64 {
    let room = right - left - RIGHT_MARGIN_MM;
    let (em, row_mm) = (drawing.label_mm(), ROW_EM * drawing.label_mm());
    let entries: Vec<LegendEntry> = entries.iter().map(|entry| fitted(drawing, entry, room)).collect();
    let (starts, n_rows) = places(drawing, &entries, room);
    for (entry, (start, row)) in entries.iter().zip(starts) {
        let (x, y) = (left + start, top + (row as f64 + 0.5) * row_mm);
        draw_key(drawing, entry.key, PageRect::new(x, y - 1.1, key_mm(entry), 2.2));
        drawing.text(&entry.name, (x + key_mm(entry) + KEY_GAP_MM, y), em, Anchor::Start);
    }
    top + n_rows as f64 * row_mm
}

/// Start and row of each entry, and the number of rows: as many columns as fit, each as wide as its widest entry.
fn places(drawing: &Drawing, entries: &[LegendEntry], room: f64) -> (Vec<(f64, usize)>, usize) {
    let width = |entry: &LegendEntry| {
        key_mm(entry) + KEY_GAP_MM + drawing.text_width(&entry.name, drawing.label_mm())
    };
    let widths: Vec<f64> = entries.iter().map(width).collect();
    let widest = |column: usize, n_columns: usize| {
        widths.iter().skip(column).step_by(n_columns).copied().fold(0.0, f64::max) + ENTRY_GAP_MM
    };
    let total = |n_columns: usize| (0..n_columns).map(|column| widest(column, n_columns)).sum::<f64>();
    let fits = |n_columns: &usize| total(*n_columns) - ENTRY_GAP_MM <= room;
    let n_columns = (1..=entries.len()).rev().find(fits).unwrap_or(1);
    let start = |column: usize| (0..column).map(|before| widest(before, n_columns)).sum::<f64>();
    let place = |i: usize| (start(i % n_columns), i / n_columns);
    ((0..entries.len()).map(place).collect(), entries.len().div_ceil(n_columns))
}

fn fitted(drawing: &Drawing, entry: &LegendEntry, room: f64) -> LegendEntry {
    let name = drawing.fitted(&entry.name, drawing.label_mm(), room - key_mm(entry) - KEY_GAP_MM);
    LegendEntry { name, key: entry.key }
}

fn key_mm(entry: &LegendEntry) -> f64 {
    if matches!(entry.key, LegendKey::Marker(_)) { 2.0 } else { KEY_MM }
}

fn draw_key(drawing: &mut Drawing, key: LegendKey, frame: PageRect) {
    let (middle, y) = frame.centre();
    let line = [(frame.left, y), (frame.right, y)];
    match key {
        LegendKey::Line(stroke) => drawing.line(&line, stroke),
        LegendKey::Band(stroke, ground) => {
            drawing.fill(frame, ground);
            drawing.line(&line, stroke);
        }
        LegendKey::Rimmed(stroke) => {
            drawing.fill(frame, BLACK.tint(0.2));
            drawing.rimmed_line(&[(frame.left + 0.6, y), (frame.right - 0.5, y)], stroke, WHITE);
        }
        LegendKey::Marker(marker) => draw_marker(drawing, (middle, y), marker),
        LegendKey::Area(fill) => drawing.fill(frame, fill),
        LegendKey::Hatch => {
            drawing.fill(frame, BLANK);
            drawing.hatch(frame, |_, _| true);
        }
    }
}
