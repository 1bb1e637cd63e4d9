//! Strain over the chain at several times, with the wave's front shaded (the paper's Fig. 2 d-f).

use serde::{Deserialize, Serialize};

use crate::colour::FRONT;
use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, Labels, Plot, TITLE_MM};
use crate::scale::{Extent, Scale};
use crate::series::{Series, looks};
use crate::ticks::trimmed;
use crate::{FigureError, Style};

const PER_ROW: usize = 3;
const HEIGHT_MM: f64 = 44.0;
const GAP_MM: f64 = 4.0;
const LABELS: Labels = Labels { x: "gap number $n$", y: "compressive strain $−u_n$ (%)" };

/// Strain over the chain at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProfilePanel {
    /// The time in seconds.
    pub time_s: f64,
    /// Strain u_n (negative in compression) against gap number, measured or computed.
    pub series: Vec<Series>,
    /// First and last gap of the front, which is shaded.
    pub front: Option<(f64, f64)>,
}

impl Draw for [ProfilePanel] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, panels: &[ProfilePanel]) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, if panels.len() > 1 { Columns::Two } else { Columns::One })?;
    let width = drawing.width_mm;
    let drawn: Vec<ProfilePanel> = panels.iter().map(in_percent).collect();
    let (x, y) = shared_scales(&drawn);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let mut top = legend::draw(&mut drawing, &entries(panels), (left, width), 1.0);
    let n_columns = panels.len().clamp(1, PER_ROW);
    let panel_width = (width - 1.5 - left - GAP_MM * (n_columns - 1) as f64) / n_columns as f64;
    if panels.is_empty() {
        top += TITLE_MM;
        Plot::new(PageRect::new(left, top, panel_width, HEIGHT_MM), x, y).axes(&mut drawing, LABELS);
        drawing.extend_to(top + HEIGHT_MM + plot::bottom_margin_mm(&drawing));
    }
    for (row, chunk) in drawn.chunks(PER_ROW).enumerate() {
        top += TITLE_MM;
        for (column, panel) in chunk.iter().enumerate() {
            let start = left + column as f64 * (panel_width + GAP_MM);
            let frame = PageRect::new(start, top, panel_width, HEIGHT_MM);
            let time_ms = style.decimals(&trimmed(1e3 * panel.time_s, 2));
            let name = format!("$t$ = {time_ms} ms");
            let title = plot::lettered(row * PER_ROW + column, panels.len(), &name);
            let y_label = if column == 0 { LABELS.y } else { "" };
            draw_panel(&mut drawing, &Plot::new(frame, x, y), panel, &title, y_label);
            plot::title(&mut drawing, frame, &title);
        }
        top += HEIGHT_MM + plot::bottom_margin_mm(&drawing);
        drawing.extend_to(top);
    }
    Ok(drawing)
}

/// Percent, positive in compression.
fn in_percent(panel: &ProfilePanel) -> ProfilePanel {
    let series = panel.series.iter().map(|series| series.scaled(1.0, -100.0)).collect();
    ProfilePanel { series, ..panel.clone() }
}

fn shared_scales(panels: &[ProfilePanel]) -> (Scale, Scale) {
    let points = || panels.iter().flat_map(|panel| &panel.series).flat_map(|series| &series.points);
    let x = Extent::of(points().map(|point| point.x.value));
    let y = Extent::of(points().flat_map(|point| point.y_reach()));
    let y = y.map(|extent| extent.including(0.0).padded(0.06));
    (Scale::whole(x.map(|extent| extent.padded(0.03))), Scale::linear(y))
}

fn draw_panel(drawing: &mut Drawing, plot: &Plot, panel: &ProfilePanel, title: &str, y_label: &str) {
    if let Some(front) = panel.front {
        plot.shade(drawing, front, FRONT);
    }
    plot.level(drawing, 0.0, plot::zero_line());
    plot.all(drawing, title, LABELS, &panel.series, &looks(&panel.series));
    plot.axes(drawing, Labels { y: y_label, ..LABELS });
}

/// The names of the panel with the most series, and the front.
fn entries(panels: &[ProfilePanel]) -> Vec<LegendEntry> {
    let fullest = panels.iter().map(|panel| &panel.series).max_by_key(|series| series.len());
    let series = fullest.map(Vec::as_slice).unwrap_or_default();
    let looks = looks(series);
    let mut entries: Vec<LegendEntry> =
        series.iter().zip(looks).map(|(series, look)| LegendEntry::new(&series.name, look)).collect();
    if panels.iter().any(|panel| panel.front.is_some()) {
        entries.push(LegendEntry::new("front", LegendKey::Area(FRONT)));
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DataPoint;
    use chainwave_measurement::Estimate;

    fn panel(time_s: f64) -> ProfilePanel {
        let strain = |n: f64| -0.05 * (-0.1 * (n - 8.0).powi(2)).exp();
        let gaps = || (1..=25).map(f64::from);
        let measured = gaps().map(|n| DataPoint::measured(n, Estimate::new(strain(n), 1e-3))).collect();
        let series = vec![
            Series::measured("experiment", measured),
            Series::model("discrete elements", gaps().map(|n| (n, strain(n)))),
        ];
        ProfilePanel { time_s, series, front: Some((8.0, 13.0)) }
    }

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        for count in 1..=5 {
            let drawing = layout(&Style::default(), &vec![panel(2.73e-3); count]).unwrap();
            drawing.assert_readable();
            assert!(drawing.labels().iter().any(|label| label.ends_with("t = 2.73 ms")));
            assert!(drawing.says("experiment") && drawing.says("front"));
            // Each panel shows both series, and gives their numbers.
            assert_eq!(drawing.data.len(), 2 * count);
        }
    }

    #[test]
    fn empty_panels_say_so() {
        assert!(layout(&Style::default(), &[]).unwrap().says("no data"));
        let empty = ProfilePanel { time_s: f64::NAN, series: Vec::new(), front: Some((1.0, f64::NAN)) };
        let drawing = layout(&Style::default(), &[empty]).unwrap();
        assert!(drawing.says("no data"));
    }
}
