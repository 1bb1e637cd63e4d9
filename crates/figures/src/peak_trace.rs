//! When the leading pulse of each gap peaks, the line or curve that explains it, and what is left.

use chainwave_measurement::Estimate;
use serde::{Deserialize, Serialize};

use crate::colour::{BLACK, EXPERIMENT};
use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, BARE_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, Look, MarkerShape, PlotMarker};
use crate::stroke::{Dash, Stroke};
use crate::ticks::{fixed, with_uncertainty};
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 48.0;
const RESIDUAL_HEIGHT_MM: f64 = 20.0;
const RIGHT_AXIS_MM: f64 = 13.5;
const MARKER: PlotMarker = PlotMarker { shape: MarkerShape::Circle, colour: EXPERIMENT, hollow: false };
const PEAKS: Labels = Labels { x: "time (ms)", y: "gap number $n$" };
const RESIDUALS: Labels = Labels { x: "time (ms)", y: "residual (µs)" };

/// The straight line through peak positions against peak times: gap n peaks at `t_at_gap_zero_s + n pitch / c_g`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PeakFit {
    /// Group velocity in metres per second.
    pub group_velocity_m_per_s: Estimate,
    /// Peak time of the line at gap number 0, in seconds.
    pub t_at_gap_zero_s: f64,
}

/// When the leading pulse of each gap peaks, with a straight line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PeakTrace {
    /// Gap number and peak time in seconds.
    pub peaks: Vec<(f64, Estimate)>,
    /// Pitch of the chain in metres.
    pub pitch_m: f64,
    /// The fitted line; without it there is no panel of residuals.
    pub fit: Option<PeakFit>,
}

/// When the leading pulse of each gap peaks, with the curve of a pulse whose speed varies along the chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PeakCurve {
    /// Gap number and peak time in seconds.
    pub peaks: Vec<(f64, Estimate)>,
    /// Pitch of the chain in metres.
    pub pitch_m: f64,
    /// Mean group velocity in metres per second.
    pub group_velocity_m_per_s: Estimate,
    /// By how much the velocity varies along the chain, relative to its mean.
    pub variation: Estimate,
    /// Gap number and time in seconds along the fitted curve, in the order of gaps.
    pub curve: Vec<(f64, f64)>,
}

impl Draw for PeakTrace {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, &Explained::by_line(style, self)?).map(Figure::new)
    }
}

impl Draw for PeakCurve {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, &Explained::by_curve(style, self)?).map(Figure::new)
    }
}

/// Peaks and what explains them: gap number and time in milliseconds along a line, with its name.
struct Explained {
    /// Gap number and time in milliseconds.
    peaks: Vec<(f64, Estimate)>,
    pitch_m: f64,
    line: Vec<(f64, f64)>,
    name: String,
}

impl Explained {
    fn by_line(style: &Style, trace: &PeakTrace) -> Result<Self, FigureError> {
        let mut explained = Self::new(&trace.peaks, trace.pitch_m)?;
        let gaps = Extent::of(explained.peaks.iter().map(|(gap, _)| *gap)).map(|extent| extent.padded(0.06));
        if let (Some(fit), Some(gaps)) = (trace.fit, gaps) {
            positive("group_velocity_m_per_s", fit.group_velocity_m_per_s.value)?;
            let slowness = trace.pitch_m / fit.group_velocity_m_per_s.value;
            let time_ms = |gap: f64| 1e3 * (fit.t_at_gap_zero_s + gap * slowness);
            explained.line = [gaps.low, gaps.high].map(|gap| (gap, time_ms(gap))).to_vec();
            explained.name = velocity_name(style, fit.group_velocity_m_per_s);
        }
        Ok(explained)
    }

    fn by_curve(style: &Style, curve: &PeakCurve) -> Result<Self, FigureError> {
        positive("group_velocity_m_per_s", curve.group_velocity_m_per_s.value)?;
        let mut explained = Self::new(&curve.peaks, curve.pitch_m)?;
        explained.line = curve.curve.iter().map(|&(gap, t_s)| (gap, 1e3 * t_s)).collect();
        let variation = style.decimals(&fixed(100.0 * curve.variation.value, 1));
        let velocity = velocity_name(style, curve.group_velocity_m_per_s);
        explained.name = format!("{velocity}, varies by {variation} %");
        Ok(explained)
    }

    fn new(peaks: &[(f64, Estimate)], pitch_m: f64) -> Result<Self, FigureError> {
        positive("pitch_m", pitch_m)?;
        let known = peaks.iter().filter(|(gap, time)| gap.is_finite() && time.value.is_finite());
        let peaks = known.map(|(gap, time)| (*gap, time.scaled(1e3))).collect();
        Ok(Self { peaks, pitch_m, line: Vec::new(), name: String::new() })
    }

    /// Time of the line at a gap, between its points; none outside of them.
    fn time_at(&self, gap: f64) -> Option<f64> {
        let pair = self.line.windows(2).find(|pair| pair[0].0 <= gap && gap <= pair[1].0)?;
        let share = if pair[1].0 > pair[0].0 { (gap - pair[0].0) / (pair[1].0 - pair[0].0) } else { 0.0 };
        Some(pair[0].1 + share * (pair[1].1 - pair[0].1))
    }

    /// Time in milliseconds, and measured minus explained time in microseconds.
    fn residuals(&self) -> Vec<DataPoint> {
        let residual = |&(gap, time): &(f64, Estimate)| {
            let left = Estimate::new(time.value - self.time_at(gap)?, time.sigma);
            Some(DataPoint::measured(time.value, left.scaled(1e3)))
        };
        self.peaks.iter().filter_map(residual).collect()
    }

    fn scales(&self) -> (Scale, Scale) {
        let x = Extent::of(self.peaks.iter().map(|(_, time)| time.value)).map(|extent| extent.padded(0.05));
        let y = Extent::of(self.peaks.iter().map(|(gap, _)| *gap)).map(|extent| extent.padded(0.06));
        (Scale::linear(x), Scale::whole(y))
    }
}

fn velocity_name(style: &Style, velocity: Estimate) -> String {
    let number = style.decimals(&with_uncertainty(velocity.value, velocity.sigma));
    format!("$c_g$ = {number} m/s")
}

fn positive(what: &str, value: f64) -> Result<(), FigureError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    let (expected, found) = ("a positive number".into(), value.to_string());
    Err(FigureError::Value { figure: "peak trace", what: what.into(), expected, found })
}

fn layout(style: &Style, trace: &Explained) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::One)?;
    let page = drawing.width_mm;
    let (x, y) = trace.scales();
    let (is_explained, residuals) = (!trace.line.is_empty(), trace.residuals());
    let reach = Extent::of(residuals.iter().flat_map(DataPoint::y_reach));
    let residual_y = Scale::linear(reach.map(|extent| extent.including(0.0).padded(0.1)));
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM).max(plot::side_margin_mm(
        &drawing,
        &residual_y,
        RESIDUAL_HEIGHT_MM,
    ));
    let width = page - left - RIGHT_AXIS_MM;
    let mut entries = vec![LegendEntry::new("peaks", LegendKey::Marker(MARKER))];
    if is_explained {
        entries.push(LegendEntry::new(&trace.name, LegendKey::Line(fit_stroke())));
    }
    let top = legend::draw(&mut drawing, &entries, (left, page), 1.0) + 1.5;
    let upper = Plot::new(PageRect::new(left, top, width, HEIGHT_MM), x, y);
    draw_peaks(&mut drawing, &upper, trace, if is_explained { "" } else { PEAKS.x });
    let mut bottom = upper.frame.bottom;
    if is_explained {
        let frame = PageRect::new(left, bottom + BARE_MARGIN_MM, width, RESIDUAL_HEIGHT_MM);
        let lower = Plot::new(frame, x, residual_y);
        lower.level(&mut drawing, 0.0, fit_stroke());
        lower.series(&mut drawing, &residuals, Look::Markers(MARKER));
        lower.axes(&mut drawing, RESIDUALS);
        plot::record(&mut drawing, "residuals", "peaks", RESIDUALS, &residuals);
        bottom = frame.bottom;
    }
    drawing.extend_to(bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

fn fit_stroke() -> Stroke {
    Stroke::new(1.0, BLACK, Dash::Solid)
}

fn draw_peaks(drawing: &mut Drawing, plot: &Plot, trace: &Explained, x_label: &str) {
    let line: Vec<(f64, f64)> = trace.line.iter().map(|&(gap, t_ms)| (t_ms, gap)).collect();
    plot.line(drawing, &line, fit_stroke());
    let point = |&(gap, time): &(f64, Estimate)| DataPoint { x: time, y: Estimate::new(gap, 0.0) };
    let points: Vec<DataPoint> = trace.peaks.iter().map(point).collect();
    plot.series(drawing, &points, Look::Markers(MARKER));
    plot.open_axes(drawing, Labels { x: x_label, ..PEAKS });
    plot.right_axis(drawing, &plot.y.converted(1e3 * trace.pitch_m, 0.0), "distance $n a$ (mm)");
    plot::record(drawing, "", "peaks", PEAKS, &points);
    let line: Vec<DataPoint> = line.iter().map(|&(t_ms, gap)| DataPoint::exact(t_ms, gap)).collect();
    plot::record(drawing, "", &trace.name, PEAKS, &line);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace() -> PeakTrace {
        let peaks = (1..=25).map(|n| (f64::from(n), Estimate::new(5e-4 + 0.03 * f64::from(n) / 52.0, 2e-6)));
        let fit = PeakFit { group_velocity_m_per_s: Estimate::new(52.0, 0.04), t_at_gap_zero_s: 5e-4 };
        PeakTrace { peaks: peaks.collect(), pitch_m: 0.03, fit: Some(fit) }
    }

    fn drawn(trace: &PeakTrace) -> Result<Drawing, FigureError> {
        let style = Style::default();
        layout(&style, &Explained::by_line(&style, trace)?)
    }

    #[test]
    fn the_fit_is_stated_with_its_uncertainty_and_nothing_overlaps() {
        let drawing = drawn(&trace()).unwrap();
        drawing.assert_readable();
        for label in ["c_g = 52.000 ± 0.040 m/s", "residual (µs)", "gap number n", "distance n a (mm)"] {
            assert!(drawing.says(label), "{label}: {:?}", drawing.labels());
        }
    }

    #[test]
    fn residuals_of_exact_times_are_zero() {
        let residuals = Explained::by_line(&Style::default(), &trace()).unwrap().residuals();
        assert_eq!(residuals.len(), 25);
        // Rounding of times of some milliseconds, in microseconds.
        assert!(residuals.iter().all(|point| point.y.value.abs() < 1e-9 && point.y.sigma > 1.9));
    }

    #[test]
    fn a_pulse_that_slows_down_is_explained_by_its_curve_and_told_with_its_variation() {
        let time_s = |n: f64| 5e-4 + 5.8e-4 * n + 2e-6 * n * n;
        let curve = PeakCurve {
            peaks: (1..=25).map(f64::from).map(|n| (n, Estimate::new(time_s(n), 2e-6))).collect(),
            pitch_m: 0.03,
            group_velocity_m_per_s: Estimate::new(47.0, 0.3),
            variation: Estimate::new(0.069, 0.004),
            curve: (1..=25).map(f64::from).map(|n| (n, time_s(n))).collect(),
        };
        let style = Style::default();
        let explained = Explained::by_curve(&style, &curve).unwrap();
        assert!(explained.residuals().iter().all(|point| point.y.value.abs() < 1e-9));
        let drawing = layout(&style, &explained).unwrap();
        drawing.assert_readable();
        assert!(drawing.says("c_g = 47.00 ± 0.30 m/s, varies by 6.9 %"), "{:?}", drawing.labels());
    }

    #[test]
    fn degenerate_inputs_are_refused_or_empty() {
        assert!(drawn(&PeakTrace { pitch_m: 0.0, ..trace() }).is_err());
        assert!(drawn(&PeakTrace { peaks: vec![], ..trace() }).unwrap().says("no data"));
        assert!(drawn(&PeakTrace { fit: None, ..trace() }).is_ok());
    }
}
