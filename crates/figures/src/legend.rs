use crate::colour::{BLANK, Rgb, sequential};
use crate::drawing::{Anchor, Dash, Drawing, LABEL_MM, Stroke};
use crate::geometry::Frame;
use crate::plot::draw_marker;
use crate::series::{Look, Marker};

/// The sign before a name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Key {
    Line(Stroke),
    Marker(Marker),
    Area(Rgb),
    /// A white line with a dark rim, as on maps.
    Rimmed(Dash),
    /// Hatching.
    Hatch,
}

impl From<Look> for Key {
    fn from(look: Look) -> Self {
        match look {
            Look::Line(stroke) => Self::Line(stroke),
            Look::Markers(marker) => Self::Marker(marker),
        }
    }
}

/// A line of the legend.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    pub(crate) name: String,
    pub(crate) key: Key,
}

impl Entry {
    pub(crate) fn new(name: impl Into<String>, key: impl Into<Key>) -> Self {
        Self { name: name.into(), key: key.into() }
    }
}

const ROW_MM: f64 = 4.2;
const KEY_MM: f64 = 6.0;
const KEY_GAP_MM: f64 = 1.2;
/// Kept free before the right border, since viewers of SVG may have a wider typeface.
const RIGHT_MARGIN_MM: f64 = 2.0;
const ENTRY_GAP_MM: f64 = 3.6;

/// Draws the legend in rows between `left` and `right`, from `top` down, where no data lie; gives its lower edge.
pub(crate) fn draw(drawing: &mut Drawing, entries: &[Entry], (left, right): (f64, f64), top: f64) -> f64 {
    let room = right - left - RIGHT_MARGIN_MM;
    let entries: Vec<Entry> = entries.iter().map(|entry| fitted(drawing, entry, room)).collect();
    let (starts, n_rows) = places(drawing, &entries, room);
    for (entry, (start, row)) in entries.iter().zip(starts) {
        let (x, y) = (left + start, top + (row as f64 + 0.5) * ROW_MM);
        draw_key(drawing, entry.key, Frame::new(x, y - 1.1, key_mm(entry), 2.2));
        drawing.text(&entry.name, (x + key_mm(entry) + KEY_GAP_MM, y), LABEL_MM, Anchor::Start);
    }
    top + n_rows as f64 * ROW_MM
}

/// Start and row of each entry, and the number of rows: as many columns as fit, each as wide as its widest entry.
fn places(drawing: &Drawing, entries: &[Entry], room: f64) -> (Vec<(f64, usize)>, usize) {
    let width = |entry: &Entry| key_mm(entry) + KEY_GAP_MM + drawing.text_width(&entry.name, LABEL_MM);
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

fn fitted(drawing: &Drawing, entry: &Entry, room: f64) -> Entry {
    let name = drawing.fitted(&entry.name, LABEL_MM, room - key_mm(entry) - KEY_GAP_MM);
    Entry { name, key: entry.key }
}

fn key_mm(entry: &Entry) -> f64 {
    if matches!(entry.key, Key::Marker(_)) { 2.0 } else { KEY_MM }
}

fn draw_key(drawing: &mut Drawing, key: Key, frame: Frame) {
    let (middle, y) = frame.centre();
    let line = [(frame.left, y), (frame.right, y)];
    match key {
        Key::Line(stroke) => drawing.line(&line, stroke),
        Key::Rimmed(dash) => {
            drawing.fill(frame, sequential(0.3));
            drawing.rimmed_line(&[(frame.left + 0.6, y), (frame.right - 0.5, y)], dash);
        }
        Key::Marker(marker) => draw_marker(drawing, (middle, y), marker),
        Key::Area(fill) => drawing.fill(frame, fill),
        Key::Hatch => {
            drawing.fill(frame, BLANK);
            drawing.hatch(frame);
        }
    }
}
