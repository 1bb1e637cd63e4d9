//! How often stated intervals hold their truth, against what they promise.

use chainwave_measurement::Estimate;
use serde::{Deserialize, Serialize};

use crate::colour::{EXPERIMENT, GRAY, RINGS};
use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::legend::{self, LegendEntry, LegendKey};
use crate::names::printed;
use crate::plot::{self, Labels, Plot, draw_marker};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, MarkerShape, PlotMarker};
use crate::stroke::{Dash, Stroke};
use crate::{FigureError, Style};

const ROW_MM: f64 = 4.4;
/// Bands around the nominal shares that count as right.
const BANDS: [(f64, f64); 2] = [(0.66, 0.70), (0.93, 0.97)];
const LABEL: &str = "truths inside the stated interval (%)";
/// Name, nominal share and marker of the two intervals.
const INTERVALS: [(&str, f64, PlotMarker); 2] = [
    ("68 % intervals", 68.0, PlotMarker { shape: MarkerShape::Square, colour: RINGS, hollow: true }),
    ("95 % intervals", 95.0, PlotMarker { shape: MarkerShape::Circle, colour: EXPERIMENT, hollow: false }),
];

/// How often the stated intervals of one quantity hold its truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoverageRow {
    /// Name of the quantity.
    pub quantity: String,
    /// Share of the 68 % intervals that hold the truth, from 0 to 1.
    pub within_68: Estimate,
    /// Share of the 95 % intervals.
    pub within_95: Estimate,
}

/// How many of independent intervals of one quantity hold its truth; drawn with the binomial share's 95 % interval (Wilson).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CoverageCount {
    /// Name of the quantity.
    pub quantity: String,
    /// Number of independent intervals.
    pub n: usize,
    /// How many of the 68 % intervals hold the truth.
    pub within_68: usize,
    /// How many of the 95 % intervals.
    pub within_95: usize,
}

impl Draw for [CoverageRow] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        let bar = |share: Estimate| Bar {
            share: share.value,
            low: (share.value - share.sigma).max(0.0),
            high: (share.value + share.sigma).min(1.0),
        };
        let row = |row: &CoverageRow| (row.quantity.clone(), [row.within_68, row.within_95].map(bar));
        layout(style, &self.iter().map(row).collect::<Vec<_>>()).map(Figure::new)
    }
}

impl Draw for [CoverageCount] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        let wrong = self.iter().find(|row| row.within_68 > row.n || row.within_95 > row.n);
        if let Some(row) = wrong {
            return Err(FigureError::Value {
                figure: "coverage",
                what: row.quantity.clone(),
                expected: format!("at most {} intervals", row.n),
                found: format!("{} and {}", row.within_68, row.within_95),
            });
        }
        let row = |row: &CoverageCount| {
            (row.quantity.clone(), [row.within_68, row.within_95].map(|inside| wilson(inside, row.n)))
        };
        let rows: Vec<_> = self.iter().filter(|row| row.n > 0).map(row).collect();
        layout(style, &rows).map(Figure::new)
    }
}

/// A share with the ends of its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bar {
    share: f64,
    low: f64,
    high: f64,
}

/// The 95 % interval of a binomial share (Wilson 1927), which has a length also where all or none lie inside.
fn wilson(inside: usize, n: usize) -> Bar {
    let (n, share) = (n as f64, inside as f64 / n as f64);
    let z = Estimate::COVERAGE_95;
    let scale = 1.0 / (1.0 + z * z / n);
    let middle = scale * (share + 0.5 * z * z / n);
    let half = scale * z * (share * (1.0 - share) / n + 0.25 * z * z / (n * n)).sqrt();
    Bar { share, low: (middle - half).max(0.0), high: (middle + half).min(1.0) }
}

fn layout(style: &Style, rows: &[(String, [Bar; 2])]) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::One)?;
    let (page, em) = (drawing.width_mm, drawing.number_mm());
    let names: Vec<String> =
        rows.iter().map(|row| drawing.fitted(&printed(&row.0), em, 0.5 * page)).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let left = names.iter().map(|name| drawing.text_width(name, em)).fold(0.0, f64::max) + 3.0;
    let entries = INTERVALS.map(|(name, _, marker)| LegendEntry::new(name, LegendKey::Marker(marker)));
    let top = legend::draw(&mut drawing, &entries, (left, page), 1.0) + 1.5;
    let n_rows = rows.len().max(4) as f64;
    let frame = PageRect::new(left, top, page - left - 3.0, ROW_MM * n_rows);
    let y = Scale::linear(Some(Extent { low: 0.5 - n_rows, high: 0.5 }));
    let plot = Plot::new(frame, Scale::linear((!rows.is_empty()).then(|| reach(rows))), y);
    for (low, high) in BANDS {
        plot.shade(&mut drawing, (100.0 * low, 100.0 * high), GRAY.tint(0.25));
    }
    for (index, (name, nominal, marker)) in INTERVALS.into_iter().enumerate() {
        plot.upright(&mut drawing, nominal, Stroke::new(0.6, GRAY, Dash::Dashed));
        let bars = rows.iter().enumerate().map(|(i, (_, bars))| (-(i as f64), bars[index]));
        for (row, bar) in bars.clone() {
            if let Some(spot) = plot.spot(100.0 * bar.share, row) {
                draw_marker(&mut drawing, spot, marker);
            }
            plot.bar(&mut drawing, [(100.0 * bar.low, row), (100.0 * bar.high, row)], marker.colour);
        }
        let half = |bar: Bar| 50.0 * (bar.high - bar.low);
        let points: Vec<DataPoint> = bars
            .map(|(row, bar)| DataPoint {
                x: Estimate::new(100.0 * bar.share, half(bar)),
                y: Estimate::new(row, 0.0),
            })
            .collect();
        plot::record(&mut drawing, "", name, Labels { x: LABEL, y: "row from the top, negative" }, &points);
    }
    plot.named_rows(&mut drawing, LABEL, &names);
    drawing.extend_to(frame.bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

/// From a round number below everything to a little above 100 %.
fn reach(rows: &[(String, [Bar; 2])]) -> Extent {
    let lowest = rows.iter().flat_map(|row| row.1).map(|bar| bar.low).fold(0.6, f64::min);
    Extent { low: (1000.0 * (lowest - 0.02).max(0.0)).floor() / 10.0, high: 102.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_quantity_is_named_and_no_key_is_raw() {
        let row = |quantity: &str, inner: f64| CoverageRow {
            quantity: quantity.into(),
            within_68: Estimate::new(inner, 0.03),
            within_95: Estimate::new(0.95, 0.01),
        };
        let rows = [row("group_velocity_m_per_s", 0.70), row("c_s, tracks", 0.31)];
        let labels = rows[..].draw(&Style::default()).unwrap().labels();
        assert!(labels.contains(&"group velocity (m/s)".into()) && labels.contains(&"c_s, tracks".into()));
        let nothing: [CoverageRow; 0] = [];
        assert!(nothing.draw(&Style::default()).unwrap().labels().contains(&"no data".into()));
    }

    #[test]
    fn a_binomial_share_has_wilsons_interval() {
        // Closed form: with all of n inside, the interval is from n / (n + z^2) to 1.
        let all = wilson(30, 30);
        let z = Estimate::COVERAGE_95;
        assert!((all.low - 30.0 / (30.0 + z * z)).abs() < 1e-12 && (all.high - 1.0).abs() < 1e-12);
        let half = wilson(50, 100);
        assert!((half.low + half.high - 1.0).abs() < 1e-12 && half.low < 0.42 && half.low > 0.39);
    }

    #[test]
    fn counts_that_make_no_sense_are_refused_and_others_are_drawn() {
        let count =
            |n, within_68, within_95| CoverageCount { quantity: "HWHM".into(), n, within_68, within_95 };
        assert!([count(10, 11, 10)].draw(&Style::default()).is_err());
        let figure = [count(100, 68, 100), count(0, 0, 0)].draw(&Style::default()).unwrap();
        assert_eq!(figure.data()[0].rows.len(), 1);
        layout(&Style::default(), &[("HWHM".into(), [wilson(7, 10), wilson(10, 10)])])
            .unwrap()
            .assert_readable();
    }
}
