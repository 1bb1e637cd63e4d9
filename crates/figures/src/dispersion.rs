use std::path::Path;

use ndarray::ArrayView2;

use crate::colour::sequential;
use crate::drawing::{Dash, Drawing};
use crate::geometry::Frame;
use crate::heat_map::{self, Cells, ColourScale, edges_between};
use crate::legend::{self, Entry, Key};
use crate::plot::{self, BOTTOM_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::{FigureError, output};

const HEIGHT_MM: f64 = 62.0;
/// Range of the logarithmic colours below the largest amplitude.
const RANGE: f64 = 1e-3;
/// Most rows of the map.
const MOST_ROWS: usize = 240;

/// Amplitude of waves over wavenumber and frequency, and a dispersion curve.
#[derive(Debug, Clone, Copy)]
pub struct DispersionPanel<'a> {
    /// Phase from gap to gap in radians, increasing.
    pub kappa_rad: &'a [f64],
    /// Frequencies in hertz, increasing.
    pub frequency_hz: &'a [f64],
    /// Strain amplitude, shape `[kappa, frequency]`.
    pub amplitude: ArrayView2<'a, f64>,
    /// Phase and frequency of the curve, drawn dashed.
    pub curve: &'a [(f64, f64)],
    /// Upper end of the frequency axis in hertz.
    pub max_frequency_hz: f64,
}

/// Draws a map over wavenumber and frequency with logarithmic colours over three decades; waves that run back stand left of 0.
///
/// # Errors
/// [`FigureError`] when the map's shape does not fit its axes, or a file cannot be written.
pub fn dispersion(stem: &Path, panel: &DispersionPanel) -> Result<(), FigureError> {
    output::write(stem, &layout(stem, panel)?)
}

fn layout(stem: &Path, panel: &DispersionPanel) -> Result<Drawing, FigureError> {
    check(stem, panel)?;
    let mut drawing = Drawing::new(Drawing::ONE_COLUMN_MM)?;
    let map = cells(panel);
    let (x, y) = (Scale::linear(map.x_extent()), Scale::linear(map.y_extent()));
    let amplitudes = Extent::of(map.measured());
    let scale = Scale::log(amplitudes.map(|Extent { high, .. }| Extent { low: RANGE * high, high }));
    let colours = ColourScale { scale, map: sequential, beyond: (amplitudes.is_some(), false) };
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let width = Drawing::ONE_COLUMN_MM - left - colours.bar_margin_mm(&drawing, HEIGHT_MM);
    let entries = [Entry::new("dispersion of the linear chain", Key::Rimmed(Dash::Dashed))];
    let top = legend::draw(&mut drawing, &entries, (left, Drawing::ONE_COLUMN_MM), 1.0) + 1.5;
    let plot = Plot { frame: Frame::new(left, top, width, HEIGHT_MM), x, y };
    heat_map::draw(
        &mut drawing,
        &plot,
        &map,
        &colours,
        Labels { x: "phase from gap to gap (rad)", y: "frequency (kHz)" },
    );
    let curve: Vec<(f64, f64)> = panel.curve.iter().map(|&(kappa_rad, hz)| (kappa_rad, 1e-3 * hz)).collect();
    for piece in plot.pieces(&curve) {
        drawing.rimmed_line(&piece, Dash::Dashed);
    }
    colours.bar(&mut drawing, plot.frame, "strain amplitude");
    drawing.extend_to(top + HEIGHT_MM + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

fn check(stem: &Path, panel: &DispersionPanel) -> Result<(), FigureError> {
    let lengths = [
        ("rows of a map, one for each wavenumber", panel.kappa_rad.len(), panel.amplitude.nrows()),
        ("columns of a map, one for each frequency", panel.frequency_hz.len(), panel.amplitude.ncols()),
    ];
    let wrong = lengths.into_iter().find(|(_, expected, found)| expected != found);
    wrong.map_or(Ok(()), |(what, expected, found)| {
        Err(FigureError::Length { stem: stem.into(), what: what.into(), expected, found })
    })
}

/// The map up to the wanted frequency; of many frequencies, every second or third.
fn cells(panel: &DispersionPanel) -> Cells {
    let n_shown = panel.frequency_hz.partition_point(|hz| *hz <= panel.max_frequency_hz);
    let step = n_shown.div_ceil(MOST_ROWS).max(1);
    let rows: Vec<usize> = (0..n_shown).step_by(step).collect();
    let x = panel.kappa_rad;
    let y: Vec<f64> = rows.iter().map(|row| 1e-3 * panel.frequency_hz[*row]).collect();
    let values = ndarray::Array2::from_shape_fn((x.len(), rows.len()), |(column, row)| {
        Some(panel.amplitude[[column, rows[row]]]).filter(|amplitude| *amplitude > 0.0)
    });
    Cells { x_edges: edges_between(x), y_edges: edges_between(&y), values }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;
    use std::f64::consts::PI;

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        let kappa_rad: Vec<f64> = (0..64).map(|row| -PI + PI / 32.0 * f64::from(row)).collect();
        let frequency_hz: Vec<f64> = (0..500).map(|bin| 5.0 * f64::from(bin)).collect();
        let curve: Vec<(f64, f64)> = kappa_rad.iter().map(|k| (*k, 570.0 * (0.5 * k).sin().abs())).collect();
        let amplitude = Array2::from_shape_fn((64, 500), |(row, bin)| {
            1e-3 / (1.0 + ((frequency_hz[bin] - curve[row].1) / 60.0).powi(2))
        });
        let panel = DispersionPanel {
            kappa_rad: &kappa_rad,
            frequency_hz: &frequency_hz,
            amplitude: amplitude.view(),
            curve: &curve,
            max_frequency_hz: 1200.0,
        };
        let drawing = layout(Path::new("x"), &panel).unwrap();
        drawing.assert_readable();
        let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
        for label in ["phase from gap to gap (rad)", "frequency (kHz)", "strain amplitude"] {
            assert!(texts.iter().any(|text| text == label), "{label} of {texts:?}");
        }
        let wrong = DispersionPanel { kappa_rad: &kappa_rad[1..], ..panel };
        assert!(layout(Path::new("x"), &wrong).unwrap_err().to_string().contains("expected 63"));
    }
}
