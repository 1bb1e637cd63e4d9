//! Spectra of the wave's tail: of single gaps as curves, of all gaps as a map, with frequencies pointed out.

use ndarray::Array2;
use serde::{Deserialize, Serialize};

use crate::colour::{BLACK, EXPERIMENT, WHITE};
use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::heat_map::{self, Cells, ColourScale};
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, Labels, Plot, TITLE_MM};
use crate::scale::{Extent, Scale, is_drawable};
use crate::series::DataPoint;
use crate::stroke::{Dash, Stroke};
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 54.0;
/// Curves in the first panel.
const MOST_CURVES: usize = 4;
/// Columns of the map.
const MOST_COLUMNS: usize = 240;
/// Range of the logarithmic axes below the largest amplitude.
const RANGE: f64 = 1e-4;
const CURVE_DASHES: [Dash; MOST_CURVES] = [Dash::Solid, Dash::Dashed, Dash::Chain, Dash::Dotted];
const SINGLE: Labels = Labels { x: "frequency (kHz)", y: "strain amplitude" };
const MAP: Labels = Labels { x: SINGLE.x, y: "gap number $n$" };
const MARK_DASHES: [Dash; 3] = [Dash::Dashed, Dash::Chain, Dash::Dotted];

/// The spectrum of one gap's strain behind the leading pulse.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GapSpectrum {
    /// Gap number.
    pub gap: usize,
    /// Frequencies in hertz.
    pub frequencies_hz: Vec<f64>,
    /// Amplitude of the strain at each frequency.
    pub amplitude: Vec<f64>,
}

/// A frequency to point out, such as the band edge or a local resonance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrequencyMark {
    /// Name in the legend.
    pub name: String,
    /// The frequency in hertz.
    pub frequency_hz: f64,
}

/// Spectra of the wave's tail along the chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TailSpectrum {
    /// One spectrum for each gap, in any order; their frequencies may differ.
    pub spectra: Vec<GapSpectrum>,
    /// Frequencies to point out.
    pub marks: Vec<FrequencyMark>,
    /// Upper end of the frequency axis in hertz; without it, all frequencies are shown.
    pub max_frequency_hz: Option<f64>,
}

impl Draw for TailSpectrum {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, tail: &TailSpectrum) -> Result<Drawing, FigureError> {
    tail.spectra.iter().try_for_each(check)?;
    let curves = curves(tail);
    let mut drawing = Drawing::new(style, Columns::Two)?;
    let page = drawing.width_mm;
    let x = Scale::linear(frequency_extent(tail, &curves));
    let amplitude = amplitude_scale(&curves);
    let gaps = Scale::whole(Extent::of(curves.iter().flat_map(|c| [c.gap - 0.5, c.gap + 0.5])));
    let left = plot::side_margin_mm(&drawing, &amplitude, HEIGHT_MM);
    let map_margin = 3.0 + plot::side_margin_mm(&drawing, &gaps, HEIGHT_MM);
    let colours = ColourScale::along(amplitude, style.colour_map, (false, false));
    let bar_margin = colours.bar_margin_mm(&drawing, HEIGHT_MM);
    let width = 0.5 * (page - left - map_margin - bar_margin);
    let map = cells(&curves, x.extent(), amplitude);
    let mut entries = entries(tail, &curves);
    if map.shows_blanks() {
        entries.push(LegendEntry::new("not measured", LegendKey::Hatch));
    }
    let top = legend::draw(&mut drawing, &entries, (left, page), 1.0) + TITLE_MM;
    let single = Plot::new(PageRect::new(left, top, width, HEIGHT_MM), x, amplitude);
    draw_curves(&mut drawing, &single, &curves, &tail.marks);
    plot::title(&mut drawing, single.frame, "(a) single gaps");
    let all = Plot::new(PageRect::new(left + width + map_margin, top, width, HEIGHT_MM), x, gaps);
    heat_map::draw(&mut drawing, &all, &map, &colours, MAP);
    colours.bar(&mut drawing, all.frame, SINGLE.y);
    draw_marks(&mut drawing, &all, &tail.marks);
    plot::title(&mut drawing, all.frame, "(b) all gaps");
    for curve in &curves {
        let points: Vec<DataPoint> = curve.points.iter().map(|&(khz, u)| DataPoint::exact(khz, u)).collect();
        plot::record(&mut drawing, "", &format!("gap {}", curve.gap), SINGLE, &points);
    }
    drawing.extend_to(top + HEIGHT_MM + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

fn check(spectrum: &GapSpectrum) -> Result<(), FigureError> {
    let (expected, found) = (spectrum.frequencies_hz.len(), spectrum.amplitude.len());
    if expected == found {
        return Ok(());
    }
    let what = format!("amplitudes of gap {}", spectrum.gap);
    Err(FigureError::Length { figure: "tail spectrum", what, expected, found })
}

/// A spectrum as it is drawn: points (kilohertz, amplitude) in the order of frequency, up to the wanted frequency.
struct GapCurve {
    gap: f64,
    points: Vec<(f64, f64)>,
}

/// The spectra that have points, in the order of their gaps.
fn curves(tail: &TailSpectrum) -> Vec<GapCurve> {
    let limit_khz = 1e-3 * tail.max_frequency_hz.unwrap_or(f64::INFINITY);
    let curve = |spectrum: &GapSpectrum| {
        let pairs = spectrum.frequencies_hz.iter().zip(&spectrum.amplitude);
        let mut points: Vec<(f64, f64)> = pairs
            .map(|(frequency_hz, &amplitude)| (1e-3 * frequency_hz, amplitude))
            .filter(|&(khz, amplitude)| is_drawable(khz) && is_drawable(amplitude) && khz <= limit_khz)
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        GapCurve { gap: spectrum.gap as f64, points }
    };
    let mut curves: Vec<GapCurve> =
        tail.spectra.iter().map(curve).filter(|curve| !curve.points.is_empty()).collect();
    curves.sort_by(|a, b| a.gap.total_cmp(&b.gap));
    curves
}

fn frequency_extent(tail: &TailSpectrum, curves: &[GapCurve]) -> Option<Extent> {
    let frequencies = curves.iter().flat_map(|curve| &curve.points).map(|point| point.0);
    let limit = tail.max_frequency_hz.map(|limit_hz| 1e-3 * limit_hz).filter(|&limit| is_drawable(limit));
    Extent::of(frequencies).map(|extent| Extent { high: limit.unwrap_or(extent.high), ..extent })
}

fn amplitude_scale(curves: &[GapCurve]) -> Scale {
    let amplitudes = curves.iter().flat_map(|curve| &curve.points).map(|point| point.1);
    let extent = Extent::of(amplitudes.filter(|&amplitude| amplitude > 0.0));
    Scale::log(extent.map(|Extent { low, high }| Extent { low: low.max(RANGE * high), high: 1.5 * high }))
}

/// Indices of the curves shown one by one, spread evenly from the first to the last.
fn chosen(n_curves: usize) -> Vec<usize> {
    let count = n_curves.min(MOST_CURVES);
    (0..count).map(|i| i * (n_curves - 1) / (count.max(2) - 1)).collect()
}

fn curve_stroke(index: usize, count: usize) -> Stroke {
    Stroke::new(1.0, EXPERIMENT.shade(index, count), CURVE_DASHES[index % CURVE_DASHES.len()])
}

fn mark_stroke(index: usize) -> Stroke {
    Stroke::new(0.8, BLACK, MARK_DASHES[index % MARK_DASHES.len()])
}

fn entries(tail: &TailSpectrum, curves: &[GapCurve]) -> Vec<LegendEntry> {
    let chosen = chosen(curves.len());
    let gaps = chosen.iter().enumerate().map(|(index, &curve)| {
        LegendEntry::new(
            format!("gap {}", curves[curve].gap),
            LegendKey::Line(curve_stroke(index, chosen.len())),
        )
    });
    let marks = tail.marks.iter().enumerate();
    let marks = marks.map(|(index, mark)| LegendEntry::new(&mark.name, LegendKey::Line(mark_stroke(index))));
    gaps.chain(marks).collect()
}

fn draw_curves(drawing: &mut Drawing, plot: &Plot, curves: &[GapCurve], marks: &[FrequencyMark]) {
    for (index, mark) in marks.iter().enumerate() {
        plot.upright(drawing, 1e-3 * mark.frequency_hz, mark_stroke(index));
    }
    let chosen = chosen(curves.len());
    for (index, &curve) in chosen.iter().enumerate() {
        plot.line(drawing, &curves[curve].points, curve_stroke(index, chosen.len()));
    }
    plot.axes(drawing, SINGLE);
}

/// Marks on the map: black with a white rim, with the dashes of the first panel.
fn draw_marks(drawing: &mut Drawing, plot: &Plot, marks: &[FrequencyMark]) {
    let Some(gaps) = plot.y.extent() else { return };
    for (index, mark) in marks.iter().enumerate() {
        let khz = 1e-3 * mark.frequency_hz;
        for piece in plot.pieces(&[(khz, gaps.low), (khz, gaps.high)]) {
            drawing.rimmed_line(&piece, mark_stroke(index), WHITE);
        }
    }
}

/// The map: in each column the largest amplitude of its frequencies, so that no line of a spectrum is lost.
fn cells(curves: &[GapCurve], frequencies: Option<Extent>, amplitude: Scale) -> Cells {
    let (Some(Extent { low, high }), Some(floor)) = (frequencies, amplitude.extent()) else {
        return Cells::none();
    };
    let longest = curves.iter().map(|curve| curve.points.len()).max().unwrap_or(1);
    let n_columns = longest.clamp(1, MOST_COLUMNS);
    let edge = |column: usize| low + (high - low) * column as f64 / n_columns as f64;
    let (first, last) = curves.first().zip(curves.last()).map_or((1.0, 1.0), |(a, b)| (a.gap, b.gap));
    let n_gaps = (last - first) as usize + 1;
    let mut values = Array2::from_elem((n_columns, n_gaps), None);
    for curve in curves {
        let row = (curve.gap - first) as usize;
        for column in 0..n_columns {
            let largest = largest_within(&curve.points, edge(column), edge(column + 1));
            values[[column, row]] = largest.map(|largest| largest.max(floor.low));
        }
    }
    Cells {
        x_edges: (0..=n_columns).map(edge).collect(),
        y_edges: (0..=n_gaps).map(|row| first - 0.5 + row as f64).collect(),
        values,
    }
}

/// The largest amplitude at frequencies in `from..to`; between samples, that of the nearest one; `None` outside the
/// spectrum.
fn largest_within(points: &[(f64, f64)], from: f64, to: f64) -> Option<f64> {
    let start = points.partition_point(|point| point.0 < from);
    let end = points.partition_point(|point| point.0 < to);
    let inside = points[start..end].iter().map(|point| point.1).reduce(f64::max);
    inside.or_else(|| {
        let middle = 0.5 * (from + to);
        let (below, above) = (start.checked_sub(1).and_then(|i| points.get(i)), points.get(end));
        match (below, above) {
            (Some(below), Some(above)) if middle - below.0 < above.0 - middle => Some(below.1),
            (Some(_), Some(above)) => Some(above.1),
            _ => None,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spectrum(gap: usize) -> GapSpectrum {
        let frequencies_hz: Vec<f64> = (0..300).map(|i| 10.0 * f64::from(i)).collect();
        let amplitude = |f: &f64| 1e-3 / (1.0 + ((f - 540.0) / 80.0).powi(2));
        GapSpectrum { gap, amplitude: frequencies_hz.iter().map(amplitude).collect(), frequencies_hz }
    }

    fn tail(spectra: Vec<GapSpectrum>) -> TailSpectrum {
        let marks = vec![FrequencyMark { name: "band edge".into(), frequency_hz: 572.0 }];
        TailSpectrum { spectra, marks, max_frequency_hz: Some(2000.0) }
    }

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        for n_gaps in [1, 3, 25] {
            let drawing = layout(&Style::default(), &tail((1..=n_gaps).map(spectrum).collect())).unwrap();
            drawing.assert_readable();
            for label in ["frequency (kHz)", "strain amplitude", "band edge", "gap 1"] {
                assert!(drawing.says(label), "{label}");
            }
        }
    }

    #[test]
    fn a_column_keeps_the_peak_and_fills_gaps_with_the_nearest_sample() {
        let points = [(0.0, 1.0), (1.0, 5.0), (1.1, 2.0), (3.0, 4.0)];
        assert_eq!(largest_within(&points, 0.9, 1.2), Some(5.0));
        assert_eq!(largest_within(&points, 1.3, 1.5), Some(2.0));
        assert_eq!(largest_within(&points, 2.5, 2.9), Some(4.0));
        assert_eq!(largest_within(&points, 3.5, 4.0), None);
    }

    #[test]
    fn degenerate_spectra_are_refused_or_empty() {
        let short = GapSpectrum { amplitude: vec![1.0], ..spectrum(3) };
        assert!(layout(&Style::default(), &tail(vec![short])).unwrap_err().to_string().contains("gap 3"));
        let flat = GapSpectrum { amplitude: vec![0.0; 300], ..spectrum(3) };
        let lost = GapSpectrum { amplitude: vec![f64::NAN; 300], ..spectrum(3) };
        for spectra in [vec![], vec![flat], vec![lost]] {
            let drawing = layout(&Style::default(), &tail(spectra)).unwrap();
            assert!(drawing.says("no data"));
        }
        let single = GapSpectrum { gap: 2, frequencies_hz: vec![500.0], amplitude: vec![1e-3] };
        assert!(layout(&Style::default(), &tail(vec![single])).is_ok());
    }
}
