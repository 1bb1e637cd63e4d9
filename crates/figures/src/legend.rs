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

/// A name in lines, and their sign.
struct Entry {
    lines: Vec<String>,
    key: LegendKey,
}

impl Entry {
    /// A name that is wider than the legend goes on in the next line: cut short it would say something else.
    fn of(drawing: &Drawing, entry: &LegendEntry, room: f64) -> Self {
        let room = room - key_mm(entry.key) - KEY_GAP_MM;
        Self { lines: drawing.wrapped(&entry.name, drawing.label_mm(), room), key: entry.key }
    }

    fn width(&self, drawing: &Drawing) -> f64 {
        let lines = self.lines.iter().map(|line| drawing.text_width(line, drawing.label_mm()));
        key_mm(self.key) + KEY_GAP_MM + lines.fold(0.0, f64::max)
    }
}

/// Draws the legend in rows between `left` and `right`, from `top` down, where no data lie; gives its lower edge.
pub(crate) fn draw(
    drawing: &mut Drawing,
    entries: &[LegendEntry],
    (left, right): (f64, f64),
    top: f64,
) -> f64 {
    let room = right - left - RIGHT_MARGIN_MM;
    let (em, row_mm) = (drawing.label_mm(), ROW_EM * drawing.label_mm());
    let entries: Vec<Entry> = entries.iter().map(|entry| Entry::of(drawing, entry, room)).collect();
    let (starts, n_columns) = places(drawing, &entries, room);
    let mut top = top;
    for row in entries.chunks(n_columns) {
        for (entry, start) in row.iter().zip(&starts) {
            let (x, y) = (left + start, top + 0.5 * row_mm);
            draw_key(drawing, entry.key, PageRect::new(x, y - 1.1, key_mm(entry.key), 2.2));
            for (index, line) in entry.lines.iter().enumerate() {
                let at = (x + key_mm(entry.key) + KEY_GAP_MM, y + index as f64 * row_mm);
                drawing.text(line, at, em, Anchor::Start);
            }
        }
        top += row_mm * row.iter().map(|entry| entry.lines.len()).max().unwrap_or(0) as f64;
    }
    top
}

/// Start of each column, and how many there are: as many as fit, each as wide as its widest entry.
fn places(drawing: &Drawing, entries: &[Entry], room: f64) -> (Vec<f64>, usize) {
    let widths: Vec<f64> = entries.iter().map(|entry| entry.width(drawing)).collect();
    let widest = |column: usize, n_columns: usize| {
        widths.iter().skip(column).step_by(n_columns).copied().fold(0.0, f64::max) + ENTRY_GAP_MM
    };
    let total = |n_columns: usize| (0..n_columns).map(|column| widest(column, n_columns)).sum::<f64>();
    let fits = |n_columns: &usize| total(*n_columns) - ENTRY_GAP_MM <= room;
    let n_columns = (1..=entries.len()).rev().find(fits).unwrap_or(1);
    let start = |column: usize| (0..column).map(|before| widest(before, n_columns)).sum::<f64>();
    ((0..n_columns).map(start).collect(), n_columns)
}

fn key_mm(key: LegendKey) -> f64 {
    if matches!(key, LegendKey::Marker(_)) { 2.0 } else { KEY_MM }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::Columns;
    use crate::stroke::Dash;
    use crate::style::Style;

    #[test]
    fn a_long_name_goes_on_in_the_next_line_with_its_numbers_whole() {
        let mut drawing = Drawing::new(&Style::default(), Columns::One).unwrap();
        let key = LegendKey::Line(Stroke::new(1.0, BLACK, Dash::Solid));
        let name = "fit, $c_g$ = 33.1234 +- 0.0017 m/s, of the peaks in gaps 3 to 9 of all recordings";
        let entries = [LegendEntry::new(name, key), LegendEntry::new("experiment", key)];
        let room = drawing.width_mm;
        let bottom = draw(&mut drawing, &entries, (0.0, room), 1.0);
        drawing.extend_to(bottom);
        drawing.assert_readable();
        let labels = drawing.labels();
        assert!(labels.len() == 3 && labels.concat().contains("33.1234") && !labels.concat().contains('…'));
    }

    #[test]
    fn no_number_is_cut() {
        let drawing = Drawing::new(&Style::default(), Columns::One).unwrap();
        let label = "error −0,00123 ± 0,00045 mm";
        for room_mm in 1..40 {
            let kept = drawing.fitted(label, drawing.label_mm(), f64::from(room_mm));
            let kept = kept.trim_end_matches('…');
            assert!(label.starts_with(kept), "{kept}");
            let next = label[kept.len()..].chars().next();
            let is_whole = !kept.ends_with(|letter: char| letter.is_ascii_digit() || letter == ',')
                || next.is_none_or(|letter| letter == ' ');
            assert!(is_whole, "{kept}");
        }
    }
}
