//! Maps of a field over the pixels of an image, each with its own colours.

use ndarray::Array2;
use serde::{Deserialize, Serialize};

use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::heat_map::{self, Cells, ColourScale, edges_between};
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, Labels, Plot, TITLE_MM};
use crate::scale::Scale;
use crate::{FigureError, Style};

/// Maps over the pixels of an image, as it is seen: columns to the right, rows downwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FieldMap {
    /// Columns of the points in pixels, increasing.
    pub x_px: Vec<f64>,
    /// Rows of the points in pixels, increasing.
    pub y_px: Vec<f64>,
    /// The maps.
    pub panels: Vec<FieldPanel>,
}

/// One map of a field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FieldPanel {
    /// Quantity and unit, such as `displacement u (px)`.
    pub title: String,
    /// Shape `[row, column]`; `None` where nothing was measured.
    pub values: Array2<Option<f64>>,
}

impl Draw for FieldMap {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

/// Most maps beside each other.
const MOST_PER_ROW: usize = 5;
/// The largest height of a map.
const HEIGHT_MM: f64 = 70.0;
const LABELS: Labels = Labels { x: "column (px)", y: "row (px)" };
const GAP_MM: f64 = 6.0;
/// Most columns and rows of a map; of a finer one every second or third point is drawn.
const MOST_CELLS: usize = 200;
/// Share of the values at each end that may lie beyond the colours: points at an edge can be far off.
const BEYOND: f64 = 0.02;

fn layout(style: &Style, field: &FieldMap) -> Result<Drawing, FigureError> {
    field.panels.iter().try_for_each(|panel| check(field, panel))?;
    let mut drawing = Drawing::new(style, Columns::Two)?;
    let page = drawing.width_mm;
    let cells: Vec<Cells> = field.panels.iter().map(|panel| cells_of(field, panel)).collect();
    let Some(first) = cells.first() else {
        let frame = PageRect::new(5.0, 5.0, page - 10.0, HEIGHT_MM);
        Plot::new(frame, Scale::linear(None), Scale::linear(None))
            .axes(&mut drawing, Labels { x: "", y: "" });
        drawing.extend_to(HEIGHT_MM + 10.0);
        return Ok(drawing);
    };
    let colours: Vec<ColourScale> =
        cells.iter().map(|cells| colours_of(style, cells.measured().collect())).collect();
    let (x, y) = (Scale::linear(first.x_extent()), Scale::linear(first.y_extent()).downwards());
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let bars: Vec<f64> = colours.iter().map(|scale| scale.bar_margin_mm(&drawing, HEIGHT_MM)).collect();
    let bar = bars.into_iter().fold(0.0, f64::max);
    let beside = left + bar + GAP_MM;
    let (per_row, size) = arrangement(field, page, beside);
    let mut top = legend::draw(&mut drawing, &entries(&cells), (left, page), 1.0);
    for (row, chunk) in field.panels.chunks(per_row).enumerate() {
        top += TITLE_MM;
        for (column, panel) in chunk.iter().enumerate() {
            let index = row * per_row + column;
            let frame = PageRect::new(left + column as f64 * (beside + size[0]), top, size[0], size[1]);
            heat_map::draw(&mut drawing, &Plot::new(frame, x, y), &cells[index], &colours[index], LABELS);
            let title = plot::lettered(index, field.panels.len(), &panel.title);
            plot::title(&mut drawing, frame, &title);
            heat_map::record(&mut drawing, &title, &cells[index], LABELS, &panel.title);
            colours[index].bar(&mut drawing, frame, "");
        }
        top += size[1] + plot::bottom_margin_mm(&drawing);
    }
    drawing.extend_to(top);
    Ok(drawing)
}

/// How many maps stand beside each other, and their width and height when each takes `beside` for its axes: as many as
/// make the maps largest.
fn arrangement(field: &FieldMap, page: f64, beside: f64) -> (usize, [f64; 2]) {
    let fitting = |per_row: usize| {
        let width = (page + GAP_MM) / per_row as f64 - beside;
        (per_row, panel_size(field, [width, HEIGHT_MM]))
    };
    let most = field.panels.len().clamp(1, MOST_PER_ROW);
    let first = fitting(1);
    (2..=most).map(fitting).fold(first, |best, next| {
        // a second and third map in a row is worth some of their size
        let gain = next.1[0] * next.0 as f64 / (best.1[0] * best.0 as f64);
        if next.1[0] >= 20.0 && gain > 0.6 { next } else { best }
    })
}

/// Width and height of a map in the room there is: pixels are as wide as high, but in a very long image.
fn panel_size(field: &FieldMap, [width, height]: [f64; 2]) -> [f64; 2] {
    let reach =
        |places: &[f64]| edges_between(places).last().zip(edges_between(places).first()).map(|(b, a)| b - a);
    let ratio = reach(&field.y_px).zip(reach(&field.x_px)).map_or(1.0, |(rows, columns)| rows / columns);
    let ratio = ratio.clamp(0.25, 4.0);
    if ratio * width <= height { [width, ratio * width] } else { [height / ratio, height] }
}

/// Colours over all values but the outermost; around zero where values have both signs.
fn colours_of(style: &Style, values: Vec<f64>) -> ColourScale {
    let share =
        |sign: f64| values.iter().filter(|&&value| sign * value > 0.0).count() as f64 / values.len() as f64;
    let has_both_signs = share(1.0) > BEYOND && share(-1.0) > BEYOND;
    if has_both_signs {
        ColourScale::signed(values, BEYOND)
    } else {
        ColourScale::covering(values, BEYOND, style.colour_map)
    }
}

fn check(field: &FieldMap, panel: &FieldPanel) -> Result<(), FigureError> {
    let lengths = [
        ("rows of a map, one for each row of points", field.y_px.len(), panel.values.nrows()),
        ("columns of a map, one for each column of points", field.x_px.len(), panel.values.ncols()),
    ];
    let wrong = lengths.into_iter().find(|(_, expected, found)| expected != found);
    wrong.map_or(Ok(()), |(what, expected, found)| {
        Err(FigureError::Length { figure: "field map", what: what.into(), expected, found })
    })
}

/// The cells, from the lowest row of the picture upwards.
fn cells_of(field: &FieldMap, panel: &FieldPanel) -> Cells {
    let step = field.x_px.len().max(field.y_px.len()).div_ceil(MOST_CELLS).max(1);
    let places = |all: &[f64]| all.iter().copied().step_by(step).collect::<Vec<f64>>();
    let (x, y) = (places(&field.x_px), places(&field.y_px));
    let values = Array2::from_shape_fn((x.len(), y.len()), |(column, row)| {
        panel.values[[(y.len() - 1 - row) * step, column * step]]
    });
    let mut y_edges = edges_between(&y);
    y_edges.reverse();
    Cells { x_edges: edges_between(&x), y_edges, values }
}

fn entries(cells: &[Cells]) -> Vec<LegendEntry> {
    let blanks = cells.iter().any(Cells::shows_blanks);
    blanks.then(|| LegendEntry::new("not measured", LegendKey::Hatch)).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_run_downwards_and_nothing_overlaps() {
        let (x_px, y_px): (Vec<f64>, Vec<f64>) = (
            (0..40).map(|i| 20.0 + 10.0 * f64::from(i)).collect(),
            (0..30).map(|i| 20.0 + 10.0 * f64::from(i)).collect(),
        );
        let values = Array2::from_shape_fn((30, 40), |(row, column)| {
            (row != 3).then_some(row as f64 - 0.1 * column as f64)
        });
        let titles = ["displacement u (px)", "strain xx (%)", "strain yy (%)"];
        let panel = |title: &str| FieldPanel { title: title.into(), values: values.clone() };
        let field = FieldMap { x_px, y_px, panels: titles.map(panel).into() };
        let cells = cells_of(&field, &field.panels[0]);
        assert_eq!(cells.values[[0, 0]], Some(29.0));
        assert_eq!((cells.y_edges[0], cells.y_edges[30]), (315.0, 15.0));
        layout(&Style::default(), &field).unwrap().assert_readable();
    }

    fn of_nothing() -> Drawing {
        layout(&Style::default(), &FieldMap { x_px: Vec::new(), y_px: Vec::new(), panels: Vec::new() })
            .unwrap()
    }

    #[test]
    fn what_does_not_fit_is_refused_and_what_is_empty_says_so() {
        let lost = Array2::from_elem((2, 3), None);
        let panels = vec![FieldPanel { title: "u".into(), values: lost }];
        let of = |x_px: &[f64], y_px: &[f64]| {
            let field = FieldMap { x_px: x_px.into(), y_px: y_px.into(), panels: panels.clone() };
            layout(&Style::default(), &field)
        };
        assert!(of(&[0.0, 1.0], &[0.0, 1.0]).unwrap_err().to_string().contains("expected 2"));
        let drawing = of(&[0.0, 1.0, 2.0], &[0.0, 1.0]).unwrap();
        assert!(drawing.says("no data"));
        assert!(of_nothing().says("no data"));
    }
}
