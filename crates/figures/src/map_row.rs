use crate::FigureError;
use crate::drawing::{Dash, Drawing};
use crate::geometry::Frame;
use crate::heat_map::{self, Cells, ColourScale};
use crate::legend::{self, Entry, Key};
use crate::plot::{self, BOTTOM_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};

/// Panels beside each other in a row.
const PER_ROW: usize = 3;
const HEIGHT_MM: f64 = 58.0;
const GAP_MM: f64 = 4.0;
const TITLE_MM: f64 = 5.2;

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

/// Draws maps that share their axes and colours, in rows, with a legend above and a colour bar beside each row.
pub(crate) fn draw(
    panels: &[MapPanel],
    colours: &ColourScale,
    bar_label: &str,
) -> Result<Drawing, FigureError> {
    let width = if panels.len() > 1 { Drawing::TWO_COLUMNS_MM } else { Drawing::ONE_COLUMN_MM };
    let mut drawing = Drawing::new(width)?;
    let (x, y) = shared_scales(panels);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let right = width - colours.bar_margin_mm(&drawing, HEIGHT_MM);
    let mut top = legend::draw(&mut drawing, &entries(panels), (left, width), 1.0);
    let n_columns = panels.len().min(PER_ROW);
    let panel_width = (right - left - GAP_MM * (n_columns - 1) as f64) / n_columns as f64;
    for (row, chunk) in panels.chunks(PER_ROW).enumerate() {
        top += TITLE_MM;
        let mut last = Frame::new(left, top, 0.0, HEIGHT_MM);
        for (column, panel) in chunk.iter().enumerate() {
            last = Frame::new(left + column as f64 * (panel_width + GAP_MM), top, panel_width, HEIGHT_MM);
            let title = plot::lettered(row * PER_ROW + column, panels.len(), &panel.title);
            let y_label = if column == 0 { "time (ms)" } else { "" };
            let labels = Labels { x: "gap number n", y: y_label };
            draw_panel(&mut drawing, &Plot { frame: last, x, y }, panel, colours, labels);
            plot::title(&mut drawing, last, &title);
        }
        colours.bar(&mut drawing, last, bar_label);
        top += HEIGHT_MM + BOTTOM_MARGIN_MM;
    }
    drawing.extend_to(top);
    Ok(drawing)
}

fn draw_panel(drawing: &mut Drawing, plot: &Plot, panel: &MapPanel, colours: &ColourScale, labels: Labels) {
    heat_map::draw(drawing, plot, &panel.cells, colours, labels);
    for trace in &panel.traces {
        for piece in plot.pieces(&trace.points) {
            drawing.rimmed_line(&piece, trace.dash);
        }
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

fn entries(panels: &[MapPanel]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for trace in panels.iter().flat_map(|panel| &panel.traces).filter(|trace| !trace.points.is_empty()) {
        if entries.iter().all(|entry| entry.name != trace.name) {
            entries.push(Entry::new(trace.name, Key::Rimmed(trace.dash)));
        }
    }
    if panels.iter().any(|panel| panel.cells.shows_blanks()) {
        entries.push(Entry::new("not measured", Key::Hatch));
    }
    entries
}
