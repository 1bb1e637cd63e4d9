//! Maps over gap and time beside each other, with common axes and colours.

use crate::colour::{BLACK, WHITE};
use crate::drawing::{Columns, Drawing};
use crate::geometry::PageRect;
use crate::heat_map::{self, Cells, ColourScale};
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, Labels, Plot, TITLE_MM};
use crate::scale::{Extent, Scale};
use crate::series::DataPoint;
use crate::stroke::{Dash, Stroke};
use crate::{FigureError, Style};

/// Panels beside each other in a row.
const PER_ROW: usize = 3;
const HEIGHT_MM: f64 = 58.0;
const GAP_MM: f64 = 4.0;
const LABELS: Labels = Labels { x: "gap number $n$", y: "time (ms)" };

/// One map over gap and time with curves on it.
#[derive(Debug, Clone)]
pub(crate) struct MapPanel {
    pub(crate) title: String,
    pub(crate) cells: Cells,
    pub(crate) traces: Vec<MapTrace>,
}

/// A curve on a map.
#[derive(Debug, Clone)]
pub(crate) struct MapTrace {
    pub(crate) name: &'static str,
    pub(crate) dash: Dash,
    /// Gap and time in milliseconds.
    pub(crate) points: Vec<(f64, f64)>,
}

/// The panels, or one without data where there is none.
pub(crate) fn or_empty(panels: Vec<MapPanel>) -> Vec<MapPanel> {
    if panels.is_empty() {
        vec![MapPanel { title: String::new(), cells: Cells::none(), traces: Vec::new() }]
    } else {
        panels
    }
}

/// Draws maps that share their axes and colours, in rows, with a legend above and a colour bar beside each row.
pub(crate) fn draw(
    style: &Style,
    panels: &[MapPanel],
    colours: &ColourScale,
    bar_label: &str,
) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, if panels.len() > 1 { Columns::Two } else { Columns::One })?;
    let width = drawing.width_mm;
    let (x, y) = shared_scales(panels);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let right = width - colours.bar_margin_mm(&drawing, HEIGHT_MM);
    let mut top = legend::draw(&mut drawing, &entries(panels), (left, width), 1.0);
    let n_columns = panels.len().clamp(1, PER_ROW);
    let panel_width = (right - left - GAP_MM * (n_columns - 1) as f64) / n_columns as f64;
    for (row, chunk) in panels.chunks(PER_ROW).enumerate() {
        top += TITLE_MM;
        let mut last = PageRect::new(left, top, 0.0, HEIGHT_MM);
        for (column, panel) in chunk.iter().enumerate() {
            last = PageRect::new(left + column as f64 * (panel_width + GAP_MM), top, panel_width, HEIGHT_MM);
            let title = plot::lettered(row * PER_ROW + column, panels.len(), &panel.title);
            let y_label = if column == 0 { LABELS.y } else { "" };
            draw_panel(&mut drawing, &Plot::new(last, x, y), panel, colours, Labels { y: y_label, ..LABELS });
            plot::title(&mut drawing, last, &title);
            record(&mut drawing, &title, panel, bar_label);
        }
        colours.bar(&mut drawing, last, bar_label);
        top += HEIGHT_MM + plot::bottom_margin_mm(&drawing);
    }
    drawing.extend_to(top);
    Ok(drawing)
}

fn draw_panel(drawing: &mut Drawing, plot: &Plot, panel: &MapPanel, colours: &ColourScale, labels: Labels) {
    heat_map::draw(drawing, plot, &panel.cells, colours, labels);
    for trace in &panel.traces {
        for piece in plot.pieces(&trace.points) {
            drawing.rimmed_line(&piece, trace_stroke(trace.dash), WHITE);
        }
    }
}

/// Black with a white rim is readable on every colour.
fn trace_stroke(dash: Dash) -> Stroke {
    Stroke::new(1.1, BLACK, dash)
}

fn record(drawing: &mut Drawing, title: &str, panel: &MapPanel, bar_label: &str) {
    heat_map::record(drawing, title, &panel.cells, LABELS, bar_label);
    for trace in &panel.traces {
        let points: Vec<DataPoint> = trace.points.iter().map(|&(x, y)| DataPoint::exact(x, y)).collect();
        plot::record(drawing, title, trace.name, LABELS, &points);
    }
}

/// Axes that hold every panel.
fn shared_scales(panels: &[MapPanel]) -> (Scale, Scale) {
    let union = |extents: Vec<Option<Extent>>| {
        Extent::of(extents.into_iter().flatten().flat_map(|extent| [extent.low, extent.high]))
    };
    let x = union(panels.iter().map(|panel| panel.cells.x_extent()).collect());
    let y = union(panels.iter().map(|panel| panel.cells.y_extent()).collect());
    (Scale::whole(x), Scale::linear(y))
}

fn entries(panels: &[MapPanel]) -> Vec<LegendEntry> {
    let mut entries: Vec<LegendEntry> = Vec::new();
    for trace in panels.iter().flat_map(|panel| &panel.traces).filter(|trace| !trace.points.is_empty()) {
        if entries.iter().all(|entry| entry.name != trace.name) {
            entries.push(LegendEntry::new(trace.name, LegendKey::Rimmed(trace_stroke(trace.dash))));
        }
    }
    if panels.iter().any(|panel| panel.cells.shows_blanks()) {
        entries.push(LegendEntry::new("not measured", LegendKey::Hatch));
    }
    entries
}
