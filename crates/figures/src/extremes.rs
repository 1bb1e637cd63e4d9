//! Extreme cases: the error over its bound, one row a case with a marker for each value of its parameter.

use chainwave_measurement::Estimate;
use serde::{Deserialize, Serialize};

use crate::colour::{EXPERIMENT, GRAY, RINGS};
use crate::drawing::{Anchor, Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::{PageRect, Spot};
use crate::legend::{self, LegendEntry, LegendKey};
use crate::names::printed;
use crate::plot::{self, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, Look, MarkerShape, PlotMarker};
use crate::stroke::{Dash, Stroke};
use crate::{FigureError, Style};

/// Height of a row, less where there are many.
const ROW_MM: f64 = 4.4;
const HIGHEST_MM: f64 = 190.0;
/// Errors are drawn from this share of their bound on; an exact result stands at the edge.
const LEAST_SHARE: f64 = 1e-10;
const KINDS: [(&str, PlotMarker); 3] = [
    ("within its bound", PlotMarker { shape: MarkerShape::Circle, colour: EXPERIMENT, hollow: false }),
    ("refused with a reason", PlotMarker { shape: MarkerShape::Square, colour: EXPERIMENT, hollow: true }),
    ("failed", PlotMarker { shape: MarkerShape::Diamond, colour: RINGS, hollow: false }),
];

/// One extreme case at one value of its parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExtremeRow {
    /// What was tried: the case and, behind its last comma, the value of its parameter.
    pub name: String,
    /// The error over its bound; none where the case was refused.
    pub share_of_bound: Option<f64>,
    /// Whether it ended as expected.
    pub passed: bool,
}

impl ExtremeRow {
    /// The case and the value of its parameter.
    fn parts(&self) -> (&str, &str) {
        self.name.rsplit_once(", ").unwrap_or((&self.name, ""))
    }

    fn kind(&self) -> usize {
        match self {
            Self { passed: false, .. } => 2,
            Self { share_of_bound: None, .. } => 1,
            _ => 0,
        }
    }

    fn shown(&self) -> f64 {
        self.share_of_bound.filter(|share| share.is_finite()).unwrap_or(1.0).max(LEAST_SHARE)
    }
}

impl Draw for [ExtremeRow] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, rows: &[ExtremeRow]) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::Two)?;
    let page = drawing.width_mm;
    let mut cases: Vec<&str> = Vec::new();
    for (case, _) in rows.iter().map(ExtremeRow::parts) {
        if !cases.contains(&case) {
            cases.push(case);
        }
    }
    let em = drawing.number_mm();
    let names: Vec<String> =
        cases.iter().map(|case| drawing.fitted(&printed(case), em, 0.5 * page)).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let left = names.iter().map(|name| drawing.text_width(name, em)).fold(0.0, f64::max) + 3.0;
    let entries = KINDS.map(|(name, marker)| LegendEntry::new(name, LegendKey::Marker(marker)));
    let top = legend::draw(&mut drawing, &entries, (left, page), 1.0) + 1.5;
    let n_rows = cases.len().max(4) as f64;
    let height = (ROW_MM * n_rows).min(HIGHEST_MM);
    let frame = PageRect::new(left, top, page - left - 3.0, height);
    let y = Scale::linear(Some(Extent { low: 0.5 - n_rows, high: 0.5 }));
    let x = Scale::log((!rows.is_empty()).then(|| reach(rows)));
    let plot = Plot::new(frame, x, y);
    plot.upright(&mut drawing, 1.0, Stroke::new(0.6, GRAY, Dash::Dashed));
    let place = |row: &ExtremeRow| {
        let index = cases.iter().position(|case| *case == row.parts().0).unwrap_or(0);
        DataPoint { x: Estimate::new(row.shown(), 0.0), y: Estimate::new(-(index as f64), 0.0) }
    };
    for (kind, (name, marker)) in KINDS.iter().enumerate() {
        let points: Vec<DataPoint> = rows.iter().filter(|row| row.kind() == kind).map(place).collect();
        plot.series(&mut drawing, &points, Look::Markers(*marker));
        let labels = Labels { x: "error over its bound", y: "row from the top, negative" };
        plot::record(&mut drawing, "", name, labels, &points);
    }
    for failed in rows.iter().filter(|row| row.kind() == 2) {
        let others: Vec<Spot> =
            rows.iter().map(place).filter_map(|point| plot.spot(point.x.value, point.y.value)).collect();
        name_beside(&mut drawing, &plot, place(failed), failed.parts().1, &others);
    }
    plot.named_rows(&mut drawing, "error over its bound", &names);
    drawing.extend_to(frame.bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

/// The value at which a case failed, left or right of its marker, where neither a marker nor another name stands.
fn name_beside(drawing: &mut Drawing, plot: &Plot, point: DataPoint, value: &str, markers: &[Spot]) {
    const GAP_MM: f64 = 1.6;
    let Some((x, y)) = plot.spot(point.x.value, point.y.value) else { return };
    let (em, name) = (drawing.number_mm(), printed(value));
    let width = drawing.text_width(&name, em);
    for left in [x - GAP_MM - width, x + GAP_MM] {
        let covered = PageRect::new(left, y - 0.5 * em, width, em);
        let is_inside = covered.corners().iter().all(|corner| plot.frame.holds(*corner));
        let is_free = markers.iter().all(|marker| !covered.grown(0.7).holds(*marker))
            && drawing.text_frames().iter().all(|(_, frame)| !frame.meets(&covered));
        if is_inside && is_free {
            return drawing.text(&name, (left, y), em, Anchor::Start);
        }
    }
}

/// All shares and the bound, with room for the markers and the names of what failed.
fn reach(rows: &[ExtremeRow]) -> Extent {
    let shares = || rows.iter().map(ExtremeRow::shown);
    Extent { low: shares().fold(0.1, f64::min) / 3.0, high: 30.0 * shares().fold(1.0, f64::max) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, share_of_bound: Option<f64>, passed: bool) -> ExtremeRow {
        ExtremeRow { name: name.into(), share_of_bound, passed }
    }

    #[test]
    fn every_case_has_one_row_and_what_failed_is_named() {
        let rows = [
            row("striker velocity, velocity_m_per_s = 1e-9", Some(1e-3), true),
            row("striker velocity, velocity_m_per_s = 1e0", Some(1e-4), true),
            row("exact", Some(0.0), true),
            row("out of reach", None, true),
            row("wrong, p = 3", Some(30.0), false),
            row("not even a number", Some(f64::NAN), false),
        ];
        let drawing = layout(&Style::default(), &rows).unwrap();
        drawing.assert_readable();
        for name in ["striker velocity", "exact", "out of reach", "wrong", "not even a number", "p = 3"] {
            assert_eq!(drawing.labels().iter().filter(|label| *label == name).count(), 1, "{name}");
        }
    }

    #[test]
    fn many_cases_stay_on_a_page_and_none_says_so() {
        let rows: Vec<ExtremeRow> = (0..110)
            .map(|i| row(&format!("case {}, p = {i}", i % 40), Some(f64::from(i + 1) * 1e-3), true))
            .collect();
        let drawing = layout(&Style::default(), &rows).unwrap();
        drawing.assert_readable();
        assert_eq!(drawing.data[0].rows.len(), 110);
        assert!(layout(&Style::default(), &[]).unwrap().says("no data"));
    }
}
