use std::path::Path;

use ndarray::Array2;

use crate::colour::{BLACK, BLUE, GRAY, GREEN, Rgb, VERMILLION, sequential};
use crate::drawing::{Dash, Drawing, Stroke};
use crate::geometry::Frame;
use crate::heat_map::{self, Cells, ColourScale};
use crate::legend::{self, Entry, Key};
use crate::plot::{self, BOTTOM_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale, is_drawable};
use crate::{FigureError, output};

const HEIGHT_MM: f64 = 54.0;
const TITLE_MM: f64 = 5.2;
/// Curves in the first panel.
const MOST_CURVES: usize = 4;
/// Columns of the map.
const MOST_COLUMNS: usize = 240;
/// Range of the logarithmic axes below the largest amplitude.
const RANGE: f64 = 1e-4;
const CURVES: [(Rgb, Dash); MOST_CURVES] =
    [(BLUE, Dash::Solid), (VERMILLION, Dash::Dashed), (GREEN, Dash::Chain), (BLACK, Dash::Dotted)];
const MARK_DASHES: [Dash; 3] = [Dash::Dashed, Dash::Chain, Dash::Dotted];

/// The spectrum of one gap's strain behind the leading pulse.
#[derive(Debug, Clone, PartialEq)]
pub struct GapSpectrum {
    /// Gap number.
    pub gap: usize,
    /// Frequencies in hertz.
    pub frequencies_hz: Vec<f64>,
    /// Amplitude of the strain at each frequency.
    pub amplitude: Vec<f64>,
}

/// A frequency to point out, such as the band edge or a local resonance.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyMark {
    /// Name in the legend.
    pub name: String,
    /// The frequency in hertz.
    pub frequency_hz: f64,
}

/// Spectra of the wave's tail along the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct TailSpectrum {
    /// One spectrum for each gap, in any order; their frequencies may differ.
    pub spectra: Vec<GapSpectrum>,
    /// Frequencies to point out.
    pub marks: Vec<FrequencyMark>,
    /// Upper end of the frequency axis in hertz; without it, all frequencies are shown.
    pub max_frequency_hz: Option<f64>,
}

/// Draws the spectra of up to four gaps as curves and those of all gaps as a map, with logarithmic amplitudes over four
/// decades.
///
/// # Errors
/// [`FigureError`] when a spectrum has other numbers of frequencies than of amplitudes, or a file cannot be written.
pub fn tail_spectrum(stem: &Path, tail: &TailSpectrum) -> Result<(), FigureError> {
    output::write(stem, &layout(stem, tail)?)
}

fn layout(stem: &Path, tail: &TailSpectrum) -> Result<Drawing, FigureError> {
    tail.spectra.iter().try_for_each(|spectrum| check(stem, spectrum))?;
    let curves = curves(tail);
    let mut drawing = Drawing::new(Drawing::TWO_COLUMNS_MM)?;
    let x = Scale::linear(frequency_extent(tail, &curves));
    let amplitude = amplitude_scale(&curves);
    let gaps = Scale::whole(Extent::of(curves.iter().flat_map(|c| [c.gap - 0.5, c.gap + 0.5])));
    let left = plot::side_margin_mm(&drawing, &amplitude, HEIGHT_MM);
    let map_margin = 3.0 + plot::side_margin_mm(&drawing, &gaps, HEIGHT_MM);
    let colours = ColourScale { scale: amplitude, map: sequential, beyond: (false, false) };
    let bar_margin = colours.bar_margin_mm(&drawing, HEIGHT_MM);
    let width = 0.5 * (Drawing::TWO_COLUMNS_MM - left - map_margin - bar_margin);
    let map = cells(&curves, x.extent(), amplitude);
    let mut entries = entries(tail, &curves);
    if map.shows_blanks() {
        entries.push(Entry::new("not measured", Key::Hatch));
    }
    let top = legend::draw(&mut drawing, &entries, (left, Drawing::TWO_COLUMNS_MM), 1.0) + TITLE_MM;
    let frame = Frame::new(left, top, width, HEIGHT_MM);
    draw_curves(&mut drawing, &Plot { frame, x, y: amplitude }, &curves, &tail.marks);
    plot::title(&mut drawing, frame, "(a) single gaps");
    let frame = Frame::new(left + width + map_margin, top, width, HEIGHT_MM);
    draw_map(&mut drawing, &Plot { frame, x, y: gaps }, &map, &colours);
    draw_marks(&mut drawing, &Plot { frame, x, y: gaps }, &tail.marks);
    plot::title(&mut drawing, frame, "(b) all gaps");
    drawing.extend_to(top + HEIGHT_MM + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

fn check(stem: &Path, spectrum: &GapSpectrum) -> Result<(), FigureError> {
    let (expected, found) = (spectrum.frequencies_hz.len(), spectrum.amplitude.len());
    if expected == found {
        return Ok(());
    }
    let what = format!("amplitudes of gap {}", spectrum.gap);
    Err(FigureError::Length { stem: stem.into(), what, expected, found })
}

/// A spectrum as it is drawn: points (kilohertz, amplitude) in the order of frequency, up to the wanted frequency.
struct Curve {
    gap: f64,
    points: Vec<(f64, f64)>,
}

/// The spectra that have points, in the order of their gaps.
fn curves(tail: &TailSpectrum) -> Vec<Curve> {
    let limit_khz = 1e-3 * tail.max_frequency_hz.unwrap_or(f64::INFINITY);
    let curve = |spectrum: &GapSpectrum| {
        let pairs = spectrum.frequencies_hz.iter().zip(&spectrum.amplitude);
        let mut points: Vec<(f64, f64)> = pairs
            .map(|(frequency_hz, &amplitude)| (1e-3 * frequency_hz, amplitude))
            .filter(|&(khz, amplitude)| is_drawable(khz) && is_drawable(amplitude) && khz <= limit_khz)
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Curve { gap: spectrum.gap as f64, points }
    };
    let mut curves: Vec<Curve> =
        tail.spectra.iter().map(curve).filter(|curve| !curve.points.is_empty()).collect();
    curves.sort_by(|a, b| a.gap.total_cmp(&b.gap));
    curves
}

fn frequency_extent(tail: &TailSpectrum, curves: &[Curve]) -> Option<Extent> {
    let frequencies = curves.iter().flat_map(|curve| &curve.points).map(|point| point.0);
    let limit = tail.max_frequency_hz.map(|limit_hz| 1e-3 * limit_hz).filter(|&limit| is_drawable(limit));
    Extent::of(frequencies).map(|extent| Extent { high: limit.unwrap_or(extent.high), ..extent })
}

fn amplitude_scale(curves: &[Curve]) -> Scale {
    let amplitudes = curves.iter().flat_map(|curve| &curve.points).map(|point| point.1);
    let extent = Extent::of(amplitudes.filter(|&amplitude| amplitude > 0.0));
    Scale::log(extent.map(|Extent { low, high }| Extent { low: low.max(RANGE * high), high: 1.5 * high }))
}

/// Indices of the curves shown one by one, spread evenly from the first to the last.
fn chosen(n_curves: usize) -> Vec<usize> {
    let count = n_curves.min(MOST_CURVES);
    (0..count).map(|i| i * (n_curves - 1) / (count.max(2) - 1)).collect()
}

fn curve_stroke(index: usize) -> Stroke {
    let (colour, dash) = CURVES[index % CURVES.len()];
    Stroke::new(1.0, colour, dash)
}

fn mark_stroke(index: usize) -> Stroke {
    Stroke::new(0.9, GRAY, MARK_DASHES[index % MARK_DASHES.len()])
}

fn entries(tail: &TailSpectrum, curves: &[Curve]) -> Vec<Entry> {
    let chosen = chosen(curves.len());
    let gaps = chosen.iter().enumerate().map(|(index, &curve)| {
        Entry::new(format!("gap {}", curves[curve].gap), Key::Line(curve_stroke(index)))
    });
    let marks = tail.marks.iter().enumerate();
    let marks = marks.map(|(index, mark)| Entry::new(&mark.name, Key::Line(mark_stroke(index))));
    gaps.chain(marks).collect()
}

fn draw_curves(drawing: &mut Drawing, plot: &Plot, curves: &[Curve], marks: &[FrequencyMark]) {
    for (index, mark) in marks.iter().enumerate() {
        plot.upright(drawing, 1e-3 * mark.frequency_hz, mark_stroke(index));
    }
    let chosen = chosen(curves.len());
    for (index, &curve) in chosen.iter().enumerate() {
        plot.line(drawing, &curves[curve].points, curve_stroke(index));
    }
    plot.axes(drawing, Labels { x: "frequency (kHz)", y: "strain amplitude" });
}

fn draw_map(drawing: &mut Drawing, plot: &Plot, map: &Cells, colours: &ColourScale) {
    heat_map::draw(drawing, plot, map, colours, Labels { x: "frequency (kHz)", y: "gap number n" });
    colours.bar(drawing, plot.frame, "strain amplitude");
}

/// Marks on the map: white with a dark rim, with the dashes of the first panel.
fn draw_marks(drawing: &mut Drawing, plot: &Plot, marks: &[FrequencyMark]) {
    let Some(gaps) = plot.y.extent() else { return };
    for (index, mark) in marks.iter().enumerate() {
        let khz = 1e-3 * mark.frequency_hz;
        for piece in plot.pieces(&[(khz, gaps.low), (khz, gaps.high)]) {
            drawing.rimmed_line(&piece, MARK_DASHES[index % MARK_DASHES.len()]);
        }
    }
}

/// The map: in each column the largest amplitude of its frequencies, so that no line of a spectrum is lost.
fn cells(curves: &[Curve], frequencies: Option<Extent>, amplitude: Scale) -> Cells {
    let (Some(Extent { low, high }), Some(floor)) = (frequencies, amplitude.extent()) else {
        return Cells { x_edges: Vec::new(), y_edges: Vec::new(), values: Array2::from_elem((0, 0), None) };
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
            let drawing = layout(Path::new("x"), &tail((1..=n_gaps).map(spectrum).collect())).unwrap();
            drawing.assert_readable();
            let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
            for label in ["frequency (kHz)", "strain amplitude", "band edge", "gap 1"] {
                assert!(texts.iter().any(|text| text == label), "{label}");
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
        assert!(layout(Path::new("x"), &tail(vec![short])).unwrap_err().to_string().contains("gap 3"));
        let flat = GapSpectrum { amplitude: vec![0.0; 300], ..spectrum(3) };
        let lost = GapSpectrum { amplitude: vec![f64::NAN; 300], ..spectrum(3) };
        for spectra in [vec![], vec![flat], vec![lost]] {
            let drawing = layout(Path::new("x"), &tail(spectra)).unwrap();
            assert!(drawing.text_frames().iter().any(|(text, _)| text == "no data"));
        }
        let single = GapSpectrum { gap: 2, frequencies_hz: vec![500.0], amplitude: vec![1e-3] };
        assert!(layout(Path::new("x"), &tail(vec![single])).is_ok());
    }
}
