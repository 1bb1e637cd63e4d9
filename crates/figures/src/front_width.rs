use std::path::Path;

use crate::colour::ordered;
use crate::drawing::{Dash, Drawing, Stroke};
use crate::geometry::Frame;
use crate::legend::{self, Entry};
use crate::plot::{self, BOTTOM_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{Series, looks};
use crate::ticks::trimmed;
use crate::{FigureError, output};

const HEIGHT_MM: f64 = 50.0;
const TITLE_MM: f64 = 5.2;
/// Room right of the second panel for the axis in cells.
const RIGHT_AXIS_MM: f64 = 11.5;

/// The leading pulse at one time, moved so that its peak lies at zero.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontPulse {
    /// The time in seconds.
    pub time_s: f64,
    /// Distance from the peak in cells, and strain there (negative in compression).
    pub profile: Vec<(f64, f64)>,
}

/// How the leading pulse widens.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontWidth {
    /// The pulse at several times, in order.
    pub pulses: Vec<FrontPulse>,
    /// Half width at half maximum in metres against time in seconds, measured or computed.
    pub hwhm: Vec<Series>,
    /// Pitch of the chain in metres, for an axis in cells.
    pub pitch_m: Option<f64>,
}

/// Draws the leading pulses aligned at their peaks, and their half width over time (the paper's Fig. 3 b).
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn front_width(stem: &Path, front: &FrontWidth) -> Result<(), FigureError> {
    output::write(stem, &layout(front)?)
}

fn layout(front: &FrontWidth) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(Drawing::TWO_COLUMNS_MM)?;
    let (pulse_x, pulse_y) = pulse_scales(&front.pulses);
    let (width_x, width_y) = width_scales(&front.hwhm);
    let margins = [pulse_y, width_y].map(|scale| plot::side_margin_mm(&drawing, &scale, HEIGHT_MM));
    let right_axis = if front.pitch_m.is_some() { RIGHT_AXIS_MM } else { 1.5 };
    let panel_width = 0.5 * (Drawing::TWO_COLUMNS_MM - margins[0] - margins[1] - right_axis - 3.0);
    let lefts = [margins[0], margins[0] + panel_width + 3.0 + margins[1]];
    let bottoms = [
        legend::draw(&mut drawing, &pulse_entries(&front.pulses), (lefts[0], lefts[1] - 3.0), 1.0),
        legend::draw(&mut drawing, &width_entries(&front.hwhm), (lefts[1], Drawing::TWO_COLUMNS_MM), 1.0),
    ];
    let top = bottoms[0].max(bottoms[1]) + TITLE_MM;
    let frames = lefts.map(|left| Frame::new(left, top, panel_width, HEIGHT_MM));
    draw_pulses(&mut drawing, &Plot { frame: frames[0], x: pulse_x, y: pulse_y }, &front.pulses);
    draw_widths(&mut drawing, &Plot { frame: frames[1], x: width_x, y: width_y }, front);
    plot::title(&mut drawing, frames[0], "(a)");
    plot::title(&mut drawing, frames[1], "(b)");
    drawing.extend_to(top + HEIGHT_MM + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

/// Offset in cells and compressive strain in percent.
fn in_percent(pulse: &FrontPulse) -> Vec<(f64, f64)> {
    pulse.profile.iter().map(|&(offset, strain)| (offset, -100.0 * strain)).collect()
}

fn pulse_scales(pulses: &[FrontPulse]) -> (Scale, Scale) {
    let points: Vec<(f64, f64)> = pulses.iter().flat_map(in_percent).collect();
    let x = Extent::of(points.iter().map(|point| point.0)).map(|extent| extent.padded(0.0));
    let y = Extent::of(points.iter().map(|point| point.1));
    (Scale::linear(x), Scale::linear(y.map(|extent| extent.including(0.0).padded(0.06))))
}

/// Time in milliseconds and width in millimetres.
fn in_milli(series: &Series) -> Series {
    series.scaled(1e3, 1e3)
}

fn width_scales(hwhm: &[Series]) -> (Scale, Scale) {
    let points = || hwhm.iter().flat_map(|series| in_milli(series).points);
    let x = Extent::of(points().map(|point| point.x.value)).map(|extent| extent.padded_from_zero(0.03));
    let y = Extent::of(points().flat_map(|point| point.y_reach()));
    (Scale::linear(x), Scale::linear(y.map(|extent| extent.padded_from_zero(0.06))))
}

fn pulse_look(index: usize, count: usize) -> Stroke {
    let dashes = [Dash::Solid, Dash::Dashed, Dash::Chain];
    Stroke::new(1.1, ordered(index, count), dashes[index % dashes.len()])
}

fn pulse_entries(pulses: &[FrontPulse]) -> Vec<Entry> {
    let name = |pulse: &FrontPulse| format!("{} ms", trimmed(1e3 * pulse.time_s, 2));
    let strokes = (0..pulses.len()).map(|index| legend::Key::Line(pulse_look(index, pulses.len())));
    pulses.iter().zip(strokes).map(|(pulse, key)| Entry { name: name(pulse), key }).collect()
}

fn width_entries(hwhm: &[Series]) -> Vec<Entry> {
    let looks = looks(hwhm.iter().map(|series| series.origin));
    hwhm.iter().zip(looks).map(|(series, look)| Entry::new(&series.name, look)).collect()
}

fn draw_pulses(drawing: &mut Drawing, plot: &Plot, pulses: &[FrontPulse]) {
    plot.level(drawing, 0.0, plot::zero_line());
    for (index, pulse) in pulses.iter().enumerate() {
        plot.line(drawing, &in_percent(pulse), pulse_look(index, pulses.len()));
    }
    plot.axes(drawing, Labels { x: "distance from the peak (cells)", y: "compressive strain (%)" });
}

fn draw_widths(drawing: &mut Drawing, plot: &Plot, front: &FrontWidth) {
    let looks = looks(front.hwhm.iter().map(|series| series.origin));
    for (series, look) in front.hwhm.iter().zip(looks) {
        plot.series(drawing, &in_milli(series).points, look);
    }
    let labels = Labels { x: "time (ms)", y: "half width at half maximum (mm)" };
    match front.pitch_m.filter(|&pitch_m| pitch_m > 0.0) {
        Some(pitch_m) => {
            plot.open_axes(drawing, labels);
            plot.right_axis(drawing, &plot.y.converted(1e-3 / pitch_m, 0.0), "half width (cells)");
        }
        None => plot.axes(drawing, labels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;
    use chainwave_measurement::Estimate;

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        let pulse = |i: f64| FrontPulse {
            time_s: 1e-3 * i * i,
            profile: (0..60).map(|k| 0.2 * f64::from(k)).map(|x| (x, -0.05 * (-x / i).exp())).collect(),
        };
        let hwhm = (1..12).map(|i| Point::measured(1e-3 * f64::from(i), Estimate::new(0.03, 1e-3)));
        let front = FrontWidth {
            pulses: (1..8).map(f64::from).map(pulse).collect(),
            hwhm: vec![Series::measured("experiment", hwhm.collect())],
            pitch_m: Some(0.03),
        };
        let drawing = layout(&front).unwrap();
        drawing.assert_readable();
        let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
        for label in ["half width (cells)", "half width at half maximum (mm)", "16 ms"] {
            assert!(texts.iter().any(|text| text == label), "{label}");
        }
    }

    #[test]
    fn without_values_both_panels_say_so() {
        let drawing = layout(&FrontWidth { pulses: vec![], hwhm: vec![], pitch_m: None }).unwrap();
        assert_eq!(drawing.text_frames().iter().filter(|(text, _)| text == "no data").count(), 2);
    }
}
