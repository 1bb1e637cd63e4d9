//! Amplitude of waves over wavenumber and frequency, with the bands of the linear chain.

use ndarray::Array2;
use serde::{Deserialize, Serialize};

use crate::colour::{BLACK, WHITE};
use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::heat_map::{self, Cells, ColourScale, edges_between};
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::DataPoint;
use crate::stroke::{Dash, Stroke};
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 62.0;
/// Range of the logarithmic colours below the largest amplitude.
const RANGE: f64 = 1e-3;
const LABELS: Labels = Labels { x: "phase from gap to gap $κ$ (rad)", y: "frequency (kHz)" };
const AMPLITUDE: &str = "strain amplitude";
const BANDS: &str = "dispersion of the linear chain";
/// Most rows of the map.
const MOST_ROWS: usize = 240;

/// Amplitude of waves over wavenumber and frequency, and dispersion curves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DispersionPanel {
    /// Phase from gap to gap in radians, increasing.
    pub kappa_rad: Vec<f64>,
    /// Frequencies in hertz, increasing.
    pub frequency_hz: Vec<f64>,
    /// Strain amplitude, shape `[kappa, frequency]`.
    pub amplitude: Array2<f64>,
    /// Phase and frequency of each band's curve, drawn dashed.
    pub bands: Vec<Vec<(f64, f64)>>,
    /// Upper end of the frequency axis in hertz.
    pub max_frequency_hz: f64,
}

impl Draw for DispersionPanel {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, panel: &DispersionPanel) -> Result<Drawing, FigureError> {
    check(panel)?;
    let mut drawing = Drawing::new(style, Columns::One)?;
    let page = drawing.width_mm;
    let map = cells(panel);
    let (x, y) = (Scale::linear(map.x_extent()), Scale::linear(map.y_extent()));
    let amplitudes = Extent::of(map.measured());
    let scale = Scale::log(amplitudes.map(|Extent { high, .. }| Extent { low: RANGE * high, high }));
    let colours = ColourScale::along(scale, style.colour_map, (amplitudes.is_some(), false));
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let width = page - left - colours.bar_margin_mm(&drawing, HEIGHT_MM);
    let stroke = Stroke::new(1.1, BLACK, Dash::Dashed);
    let entries = [LegendEntry::new(BANDS, LegendKey::Rimmed(stroke))];
    let top = legend::draw(&mut drawing, &entries, (left, page), 1.0) + 1.5;
    let plot = Plot::new(PageRect::new(left, top, width, HEIGHT_MM), x, y);
    heat_map::draw(&mut drawing, &plot, &map, &colours, LABELS);
    let in_khz =
        |band: &Vec<(f64, f64)>| band.iter().map(|&(kappa_rad, hz)| (kappa_rad, 1e-3 * hz)).collect();
    let bands: Vec<Vec<(f64, f64)>> = panel.bands.iter().map(in_khz).collect();
    for piece in bands.iter().flat_map(|band| plot.pieces(band)) {
        drawing.rimmed_line(&piece, stroke, WHITE);
    }
    colours.bar(&mut drawing, plot.frame, AMPLITUDE);
    heat_map::record(&mut drawing, "", &map, LABELS, AMPLITUDE);
    for (index, band) in bands.iter().enumerate() {
        let points: Vec<DataPoint> = band.iter().map(|&(x, y)| DataPoint::exact(x, y)).collect();
        plot::record(&mut drawing, "", &name_of(index, bands.len()), LABELS, &points);
    }
    drawing.extend_to(top + HEIGHT_MM + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

/// What a band's curve is called among the figure's numbers.
fn name_of(index: usize, n_bands: usize) -> String {
    match n_bands {
        1 => BANDS.into(),
        _ => format!("{BANDS}, band {}", index + 1),
    }
}

fn check(panel: &DispersionPanel) -> Result<(), FigureError> {
    let lengths = [
        ("rows of a map, one for each wavenumber", panel.kappa_rad.len(), panel.amplitude.nrows()),
        ("columns of a map, one for each frequency", panel.frequency_hz.len(), panel.amplitude.ncols()),
    ];
    let wrong = lengths.into_iter().find(|(_, expected, found)| expected != found);
    wrong.map_or(Ok(()), |(what, expected, found)| {
        Err(FigureError::Length { figure: "dispersion", what: what.into(), expected, found })
    })
}

/// The map up to the wanted frequency; of many frequencies, every second or third.
fn cells(panel: &DispersionPanel) -> Cells {
    let n_shown = panel.frequency_hz.partition_point(|hz| *hz <= panel.max_frequency_hz);
    let step = n_shown.div_ceil(MOST_ROWS).max(1);
    let rows: Vec<usize> = (0..n_shown).step_by(step).collect();
    let x = &panel.kappa_rad;
    let y: Vec<f64> = rows.iter().map(|row| 1e-3 * panel.frequency_hz[*row]).collect();
    let values = Array2::from_shape_fn((x.len(), rows.len()), |(column, row)| {
        Some(panel.amplitude[[column, rows[row]]]).filter(|amplitude| *amplitude > 0.0)
    });
    Cells { x_edges: edges_between(x), y_edges: edges_between(&y), values }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        let kappa_rad: Vec<f64> = (0..64).map(|row| -PI + PI / 32.0 * f64::from(row)).collect();
        let frequency_hz: Vec<f64> = (0..500).map(|bin| 5.0 * f64::from(bin)).collect();
        let curve: Vec<(f64, f64)> = kappa_rad.iter().map(|k| (*k, 570.0 * (0.5 * k).sin().abs())).collect();
        let amplitude = Array2::from_shape_fn((64, 500), |(row, bin)| {
            1e-3 / (1.0 + ((frequency_hz[bin] - curve[row].1) / 60.0).powi(2))
        });
        let optical = kappa_rad.iter().map(|k| (*k, 900.0 - 100.0 * k.sin().abs())).collect();
        let bands = vec![curve, optical];
        let panel = DispersionPanel { kappa_rad, frequency_hz, amplitude, bands, max_frequency_hz: 1200.0 };
        let drawing = layout(&Style::default(), &panel).unwrap();
        drawing.assert_readable();
        for label in ["phase from gap to gap κ (rad)", "frequency (kHz)", "strain amplitude"] {
            assert!(drawing.says(label), "{label} of {:?}", drawing.labels());
        }
        let wrong = DispersionPanel { kappa_rad: panel.kappa_rad[1..].to_vec(), ..panel };
        assert!(layout(&Style::default(), &wrong).unwrap_err().to_string().contains("expected 63"));
    }
}
