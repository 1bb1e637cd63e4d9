//! Normalised residuals over gaps and time.

use ndarray::Array2;
use serde::{Deserialize, Serialize};

use crate::drawing::Drawing;
use crate::figure::{Draw, Figure};
use crate::heat_map::{Cells, ColourScale, Summary, check_times};
use crate::map_row::{self, MapPanel};
use crate::{FigureError, Style};

/// One map of normalised residuals over gaps and time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResidualMapPanel {
    /// Title, such as `strain`.
    pub title: String,
    /// Sample times in seconds, increasing.
    pub times_s: Vec<f64>,
    /// (measured - model) / sigma, shape `[gap, time]`, from gap 1; `None` where nothing was measured.
    pub residual: Array2<Option<f64>>,
}

impl Draw for [ResidualMapPanel] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, panels: &[ResidualMapPanel]) -> Result<Drawing, FigureError> {
    panels
        .iter()
        .try_for_each(|panel| check_times("residual map", &panel.times_s, &panel.residual.view()))?;
    let maps: Vec<MapPanel> = panels
        .iter()
        .map(|panel| MapPanel {
            title: panel.title.clone(),
            cells: Cells::over_time(&panel.times_s, &panel.residual.view(), 1.0, Summary::Middle),
            traces: Vec::new(),
        })
        .collect();
    let values: Vec<f64> = maps.iter().flat_map(|map| map.cells.measured()).collect();
    map_row::draw(
        style,
        &map_row::or_empty(maps),
        &ColourScale::symmetric(&values),
        "(measured − model) / $σ$",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_are_symmetric_and_nothing_overlaps() {
        let times_s = [0.0, 1e-3, 2e-3];
        let residual = Array2::from_shape_fn((4, 3), |(n, i)| (n != i).then_some(n as f64 - 7.0 * i as f64));
        let panel = ResidualMapPanel { title: "strain".into(), times_s: times_s.into(), residual };
        let drawing = layout(&Style::default(), &[panel]).unwrap();
        drawing.assert_readable();
        assert!(drawing.says("10") && drawing.says("−10"), "{:?}", drawing.labels());
        assert!(drawing.says("not measured"));
        assert!(layout(&Style::default(), &[]).unwrap().says("no data"));
    }
}
