//! How the leading pulse widens: its right halves aligned at their peaks, and its half width over time (the paper's Fig. 3 b).

use serde::{Deserialize, Serialize};

use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, Labels, Plot, TITLE_MM};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, Series, looks};
use crate::stroke::{Dash, Stroke};
use crate::ticks::trimmed;
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 50.0;
/// Height of the single panel with its inset.
const TALL_MM: f64 = 58.0;
/// Room right of the second panel for the axis in cells.
const RIGHT_AXIS_MM: f64 = 11.5;
const PULSES: Labels = Labels { x: "distance from the peak (cells)", y: "compressive strain $−u$ (%)" };
const WIDTHS: Labels = Labels { x: "time (ms)", y: "half width at half maximum (mm)" };

/// The leading pulse at one time, moved so that its peak lies at zero.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrontPulse {
    /// The time in seconds.
    pub time_s: f64,
    /// Distance from the peak in cells, and strain there (negative in compression).
    pub profile: Vec<(f64, f64)>,
}

/// How the leading pulse widens, as two panels: pulses, and half widths with a second axis in cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrontWidth {
    /// The pulse at several times, in order.
    pub pulses: Vec<FrontPulse>,
    /// Half width at half maximum in metres against time in seconds, measured or computed.
    pub hwhm: Vec<Series>,
    /// Pitch of the chain in metres, for an axis in cells.
    pub pitch_m: Option<f64>,
}

/// How the leading pulse widens, as the paper's Fig. 3 b shows it: the right halves of the pulses, with the half widths in an
/// inset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RightHalves(pub FrontWidth);

impl Draw for FrontWidth {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        two_panels(style, self).map(Figure::new)
    }
}

impl Draw for RightHalves {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        with_inset(style, &self.0).map(Figure::new)
    }
}

fn two_panels(style: &Style, front: &FrontWidth) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::Two)?;
    let page = drawing.width_mm;
    let profiles = profiles(&front.pulses, f64::NEG_INFINITY);
    let (pulse_x, pulse_y) = pulse_scales(&profiles);
    let hwhm: Vec<Series> = front.hwhm.iter().map(in_milli).collect();
    let (width_x, width_y) = width_scales(&hwhm);
    let margins = [pulse_y, width_y].map(|scale| plot::side_margin_mm(&drawing, &scale, HEIGHT_MM));
    let right_axis = if front.pitch_m.is_some() { RIGHT_AXIS_MM } else { 1.5 };
    let panel_width = 0.5 * (page - margins[0] - margins[1] - right_axis - 3.0);
    let lefts = [margins[0], margins[0] + panel_width + 3.0 + margins[1]];
    let pulse_entries = pulse_entries(style, &front.pulses);
    let bottoms = [
        legend::draw(&mut drawing, &pulse_entries, (lefts[0], lefts[1] - 3.0), 1.0),
        legend::draw(&mut drawing, &width_entries(&hwhm), (lefts[1], page), 1.0),
    ];
    let top = bottoms[0].max(bottoms[1]) + TITLE_MM;
    let frames = lefts.map(|left| PageRect::new(left, top, panel_width, HEIGHT_MM));
    let pulses = Plot::new(frames[0], pulse_x, pulse_y);
    draw_pulses(&mut drawing, &pulses, front, &profiles, "(a)");
    let widths = Plot::new(frames[1], width_x, width_y);
    widths.all(&mut drawing, "(b)", WIDTHS, &hwhm, &looks(&hwhm));
    match front.pitch_m.filter(|&pitch_m| pitch_m > 0.0) {
        Some(pitch_m) => {
            widths.open_axes(&mut drawing, WIDTHS);
            let in_cells = widths.y.converted(1e-3 / pitch_m, 0.0);
            widths.right_axis(&mut drawing, &in_cells, "half width (cells)");
        }
        None => widths.axes(&mut drawing, WIDTHS),
    }
    plot::title(&mut drawing, frames[0], "(a)");
    plot::title(&mut drawing, frames[1], "(b)");
    drawing.extend_to(top + HEIGHT_MM + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

fn with_inset(style: &Style, front: &FrontWidth) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::One)?;
    let profiles = profiles(&front.pulses, 0.0);
    let (x, y) = pulse_scales(&profiles);
    let hwhm: Vec<Series> = front.hwhm.iter().map(in_milli).collect();
    let (left, page) = (plot::side_margin_mm(&drawing, &y, TALL_MM), drawing.width_mm);
    let times = legend::draw(&mut drawing, &pulse_entries(style, &front.pulses), (left, page), 1.0);
    let top = legend::draw(&mut drawing, &width_entries(&hwhm), (left, page), times) + 1.5;
    let frame = PageRect::new(left, top, page - left - 1.5, TALL_MM);
    // Broad pulses leave no place for the inset unless the axis reaches above them.
    let size = (0.56 * frame.width(), 0.58 * TALL_MM);
    let lines = |plot: &Plot| profiles.iter().flat_map(|profile| plot.pieces(profile)).collect::<Vec<_>>();
    let heights = [1.0, 1.3, 1.7, 2.5].map(|factor| Plot::new(frame, x, y.with_headroom(factor)));
    let fitting = heights.into_iter().find(|plot| plot.has_place(size, &lines(plot)));
    let plot = fitting.unwrap_or(heights[3]);
    draw_pulses(&mut drawing, &plot, front, &profiles, "pulses");
    let labels = Labels { y: "HWHM (mm)", ..WIDTHS };
    if let Some(inset) = plot.inset(&mut drawing, width_scales(&hwhm), size, &lines(&plot)) {
        inset.all(&mut drawing, "inset", labels, &hwhm, &looks(&hwhm));
        inset.axes(&mut drawing, labels);
    }
    drawing.extend_to(frame.bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

/// Offset in cells from `first` on and compressive strain in percent, for each pulse.
fn profiles(pulses: &[FrontPulse], first: f64) -> Vec<Vec<(f64, f64)>> {
    let drawn = |pulse: &FrontPulse| {
        let shown = right_of(&pulse.profile, first);
        shown.into_iter().map(|(offset, strain)| (offset, -100.0 * strain)).collect()
    };
    pulses.iter().map(drawn).collect()
}

/// The part of a profile at offsets from `first` on, with the point on its border between two samples.
fn right_of(profile: &[(f64, f64)], first: f64) -> Vec<(f64, f64)> {
    let inside = profile.iter().copied().filter(|point| point.0 >= first);
    let across = profile.windows(2).find(|pair| pair[0].0 < first && first < pair[1].0);
    let border = across.map(|pair| {
        let share = (first - pair[0].0) / (pair[1].0 - pair[0].0);
        (first, pair[0].1 + share * (pair[1].1 - pair[0].1))
    });
    border.into_iter().chain(inside).collect()
}

fn pulse_scales(profiles: &[Vec<(f64, f64)>]) -> (Scale, Scale) {
    let x = Extent::of(profiles.iter().flatten().map(|point| point.0)).map(|extent| extent.padded(0.0));
    let y = Extent::of(profiles.iter().flatten().map(|point| point.1));
    (Scale::linear(x), Scale::linear(y.map(|extent| extent.including(0.0).padded(0.06))))
}

/// Time in milliseconds and width in millimetres.
fn in_milli(series: &Series) -> Series {
    series.scaled(1e3, 1e3)
}

fn width_scales(hwhm: &[Series]) -> (Scale, Scale) {
    let points = || hwhm.iter().flat_map(|series| &series.points);
    let x = Extent::of(points().map(|point| point.x.value)).map(|extent| extent.padded_from_zero(0.03));
    let y = Extent::of(points().flat_map(DataPoint::y_reach));
    (Scale::linear(x), Scale::linear(y.map(|extent| extent.padded_from_zero(0.06))))
}

fn pulse_stroke(style: &Style, index: usize, count: usize) -> Stroke {
    let dashes = [Dash::Solid, Dash::Dashed, Dash::Chain];
    Stroke::new(1.2, style.colour_map.ordered(index, count), dashes[index % dashes.len()])
}

fn pulse_entries(style: &Style, pulses: &[FrontPulse]) -> Vec<LegendEntry> {
    let entry = |(index, pulse): (usize, &FrontPulse)| {
        let name = format!("{} ms", style.decimals(&trimmed(1e3 * pulse.time_s, 2)));
        LegendEntry::new(name, LegendKey::Line(pulse_stroke(style, index, pulses.len())))
    };
    pulses.iter().enumerate().map(entry).collect()
}

fn width_entries(hwhm: &[Series]) -> Vec<LegendEntry> {
    hwhm.iter().zip(looks(hwhm)).map(|(series, look)| LegendEntry::new(&series.name, look)).collect()
}

fn draw_pulses(
    drawing: &mut Drawing,
    plot: &Plot,
    front: &FrontWidth,
    profiles: &[Vec<(f64, f64)>],
    panel: &str,
) {
    plot.level(drawing, 0.0, plot::zero_line());
    for (index, (profile, pulse)) in profiles.iter().zip(&front.pulses).enumerate() {
        let stroke = pulse_stroke(&drawing.style, index, profiles.len());
        plot.line(drawing, profile, stroke);
        let points: Vec<DataPoint> = profile.iter().map(|&(x, y)| DataPoint::exact(x, y)).collect();
        plot::record(drawing, panel, &format!("t = {} s", pulse.time_s), PULSES, &points);
    }
    plot.axes(drawing, PULSES);
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Estimate;

    fn front() -> FrontWidth {
        let pulse = |i: f64| FrontPulse {
            time_s: 1e-3 * i * i,
            profile: (-30..60)
                .map(|k| 0.2 * f64::from(k) + 0.1)
                .map(|x| (x, -0.05 * (-x.abs() / i).exp()))
                .collect(),
        };
        let hwhm = (1..12).map(|i| DataPoint::measured(1e-3 * f64::from(i), Estimate::new(0.03, 1e-3)));
        FrontWidth {
            pulses: (1..8).map(f64::from).map(pulse).collect(),
            hwhm: vec![Series::measured("experiment", hwhm.collect())],
            pitch_m: Some(0.03),
        }
    }

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        let drawing = two_panels(&Style::default(), &front()).unwrap();
        drawing.assert_readable();
        for label in ["half width (cells)", "half width at half maximum (mm)", "16 ms"] {
            assert!(drawing.says(label), "{label}");
        }
    }

    #[test]
    fn right_halves_begin_at_the_peak_and_the_widths_stand_in_the_inset() {
        let drawing = with_inset(&Style::default(), &front()).unwrap();
        drawing.assert_readable();
        assert!(drawing.says("HWHM (mm)") && drawing.says("distance from the peak (cells)"));
        let first = &drawing.data[0].rows[0];
        // Between the samples at -0.1 and 0.1 cells both have the strain of 0.1 cells.
        assert!(first.x.value.abs() < 1e-12);
        assert!((first.y.value - 5.0 * (-0.1_f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn without_values_both_panels_say_so() {
        let nothing = FrontWidth { pulses: vec![], hwhm: vec![], pitch_m: None };
        for drawing in [two_panels(&Style::default(), &nothing), with_inset(&Style::default(), &nothing)] {
            let labels = drawing.unwrap().labels();
            assert_eq!(labels.iter().filter(|label| *label == "no data").count(), 2);
        }
    }
}
