use std::path::Path;

use ndarray::ArrayView2;

use crate::colour::diverging;
use crate::drawing::Drawing;
use crate::heat_map::{Cells, ColourScale, Summary, check_times};
use crate::map_row::{self, MapPanel};
use crate::{FigureError, output};

/// One map of normalised residuals over gaps and time.
#[derive(Debug, Clone, Copy)]
pub struct ResidualMapPanel<'a> {
    /// Title, such as `strain`.
    pub title: &'a str,
    /// Sample times in seconds, increasing.
    pub times_s: &'a [f64],
    /// (measured - model) / sigma, shape `[gap, time]`, from gap 1; `None` where nothing was measured.
    pub residual: ArrayView2<'a, Option<f64>>,
}

/// Draws maps of normalised residuals; the colours are symmetric around zero and reach at least 3 sigma to each side.
///
/// With many samples, a cell shows one of its neighbouring samples, since their mean would scatter less than sigma says.
///
/// # Errors
/// As [`crate::strain_map`].
pub fn residual_map(stem: &Path, panels: &[ResidualMapPanel]) -> Result<(), FigureError> {
    output::write(stem, &layout(stem, panels)?)
}

fn layout(stem: &Path, panels: &[ResidualMapPanel]) -> Result<Drawing, FigureError> {
    if panels.is_empty() {
        return Err(FigureError::NoPanels { stem: stem.into() });
    }
    panels.iter().try_for_each(|panel| check_times(stem, panel.times_s, &panel.residual))?;
    let maps: Vec<MapPanel> = panels
        .iter()
        .map(|panel| MapPanel {
            title: panel.title.into(),
            cells: Cells::over_time(panel.times_s, &panel.residual, 1.0, Summary::Middle),
            traces: Vec::new(),
        })
        .collect();
    let values: Vec<f64> = maps.iter().flat_map(|map| map.cells.measured()).collect();
    map_row::draw(&maps, &ColourScale::symmetric(&values, diverging), "(measured − model) / σ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    #[test]
    fn the_colours_are_symmetric_and_nothing_overlaps() {
        let times_s = [0.0, 1e-3, 2e-3];
        let residual = Array2::from_shape_fn((4, 3), |(n, i)| (n != i).then_some(n as f64 - 7.0 * i as f64));
        let panel = ResidualMapPanel { title: "strain", times_s: &times_s, residual: residual.view() };
        let drawing = layout(Path::new("x"), &[panel]).unwrap();
        drawing.assert_readable();
        let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
        assert!(texts.contains(&"10".into()) && texts.contains(&"−10".into()), "{texts:?}");
        assert!(texts.contains(&"not measured".into()));
    }
}
