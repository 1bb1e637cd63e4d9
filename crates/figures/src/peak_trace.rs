use std::path::Path;

use chainwave_measurement::Estimate;

use crate::colour::{BLUE, VERMILLION};
use crate::drawing::{Dash, Drawing, Stroke};
use crate::geometry::Frame;
use crate::legend::{self, Entry, Key};
use crate::plot::{self, BARE_MARGIN_MM, BOTTOM_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{Look, Marker, MarkerShape, Point};
use crate::ticks::with_uncertainty;
use crate::{FigureError, output};

const HEIGHT_MM: f64 = 48.0;
const RESIDUAL_HEIGHT_MM: f64 = 20.0;
const RIGHT_AXIS_MM: f64 = 13.5;
const MARKER: Marker = Marker { shape: MarkerShape::Circle, colour: BLUE, hollow: false };

/// The straight line through peak positions against peak times: gap n peaks at `t_at_gap_zero_s + n pitch / c_g`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakFit {
    /// Group velocity in metres per second.
    pub group_velocity_m_per_s: Estimate,
    /// Peak time of the line at gap number 0, in seconds.
    pub t_at_gap_zero_s: f64,
}

/// When the leading pulse of each gap peaks.
#[derive(Debug, Clone, PartialEq)]
pub struct PeakTrace {
    /// Gap number and peak time in seconds.
    pub peaks: Vec<(f64, Estimate)>,
    /// Pitch of the chain in metres.
    pub pitch_m: f64,
    /// The fitted line; without it there is no panel of residuals.
    pub fit: Option<PeakFit>,
}

/// Draws peak positions against peak times with the fitted line, and the residuals of the times below.
///
/// # Errors
/// [`FigureError`] when the pitch or the group velocity is not a positive number, or a file cannot be written.
pub fn peak_trace(stem: &Path, trace: &PeakTrace) -> Result<(), FigureError> {
    output::write(stem, &layout(stem, trace)?)
}

fn layout(stem: &Path, trace: &PeakTrace) -> Result<Drawing, FigureError> {
    positive(stem, "pitch_m", trace.pitch_m)?;
    if let Some(fit) = trace.fit {
        positive(stem, "group_velocity_m_per_s", fit.group_velocity_m_per_s.value)?;
    }
    let mut drawing = Drawing::new(Drawing::ONE_COLUMN_MM)?;
    let (x, y) = scales(trace);
    let residuals = trace.fit.map(|fit| residuals(trace, fit)).unwrap_or_default();
    let residual_y = residual_scale(&residuals);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM).max(plot::side_margin_mm(
        &drawing,
        &residual_y,
        RESIDUAL_HEIGHT_MM,
    ));
    let width = Drawing::ONE_COLUMN_MM - left - RIGHT_AXIS_MM;
    let top = legend::draw(&mut drawing, &entries(trace), (left, Drawing::ONE_COLUMN_MM), 1.0) + 1.5;
    let upper = Plot { frame: Frame::new(left, top, width, HEIGHT_MM), x, y };
    let x_label = if trace.fit.is_some() { "" } else { "time (ms)" };
    draw_peaks(&mut drawing, &upper, trace, x_label);
    let mut bottom = upper.frame.bottom;
    if trace.fit.is_some() {
        let frame = Frame::new(left, bottom + BARE_MARGIN_MM, width, RESIDUAL_HEIGHT_MM);
        draw_residuals(&mut drawing, &Plot { frame, x, y: residual_y }, &residuals);
        bottom = frame.bottom;
    }
    drawing.extend_to(bottom + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

fn positive(stem: &Path, what: &str, value: f64) -> Result<(), FigureError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    let (expected, found) = ("a positive number".into(), value.to_string());
    Err(FigureError::Value { stem: stem.into(), what: what.into(), expected, found })
}

fn scales(trace: &PeakTrace) -> (Scale, Scale) {
    let peaks = || trace.peaks.iter().filter(|(gap, time)| gap.is_finite() && time.value.is_finite());
    let x = Extent::of(peaks().map(|(_, time)| 1e3 * time.value)).map(|extent| extent.padded(0.05));
    let y = Extent::of(peaks().map(|(gap, _)| *gap)).map(|extent| extent.padded(0.06));
    (Scale::linear(x), Scale::whole(y))
}

/// Time in milliseconds, and measured minus fitted time in microseconds.
fn residuals(trace: &PeakTrace, fit: PeakFit) -> Vec<Point> {
    let fitted_s = |gap: f64| fit.t_at_gap_zero_s + gap * trace.pitch_m / fit.group_velocity_m_per_s.value;
    let residual = |gap: f64, time: Estimate| Estimate::new(time.value - fitted_s(gap), time.sigma);
    let point =
        |&(gap, time): &(f64, Estimate)| Point::measured(1e3 * time.value, residual(gap, time).scaled(1e6));
    trace.peaks.iter().map(point).collect()
}

fn residual_scale(residuals: &[Point]) -> Scale {
    let reach = Extent::of(residuals.iter().flat_map(Point::y_reach));
    Scale::linear(reach.map(|extent| extent.including(0.0).padded(0.1)))
}

fn entries(trace: &PeakTrace) -> Vec<Entry> {
    let mut entries = vec![Entry::new("peaks", Key::Marker(MARKER))];
    if let Some(fit) = trace.fit {
        let Estimate { value, sigma } = fit.group_velocity_m_per_s;
        let name = format!("group velocity {} m/s", with_uncertainty(value, sigma));
        entries.push(Entry::new(name, Key::Line(fit_stroke())));
    }
    entries
}

fn fit_stroke() -> Stroke {
    Stroke::new(1.0, VERMILLION, Dash::Solid)
}

fn draw_peaks(drawing: &mut Drawing, plot: &Plot, trace: &PeakTrace, x_label: &str) {
    if let (Some(fit), Some(gaps)) = (trace.fit, plot.y.extent()) {
        let time_ms =
            |gap: f64| 1e3 * (fit.t_at_gap_zero_s + gap * trace.pitch_m / fit.group_velocity_m_per_s.value);
        let line = [(time_ms(gaps.low), gaps.low), (time_ms(gaps.high), gaps.high)];
        plot.line(drawing, &line, fit_stroke());
    }
    let point = |&(gap, time): &(f64, Estimate)| Point { x: time.scaled(1e3), y: Estimate::new(gap, 0.0) };
    let points: Vec<Point> = trace.peaks.iter().map(point).collect();
    plot.series(drawing, &points, Look::Markers(MARKER));
    plot.open_axes(drawing, Labels { x: x_label, y: "gap number n" });
    plot.right_axis(drawing, &plot.y.converted(1e3 * trace.pitch_m, 0.0), "distance n a (mm)");
}

fn draw_residuals(drawing: &mut Drawing, plot: &Plot, residuals: &[Point]) {
    plot.level(drawing, 0.0, fit_stroke());
    plot.series(drawing, residuals, Look::Markers(MARKER));
    plot.axes(drawing, Labels { x: "time (ms)", y: "residual (µs)" });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace() -> PeakTrace {
        let peaks = (1..=25).map(|n| (f64::from(n), Estimate::new(5e-4 + 0.03 * f64::from(n) / 52.0, 2e-6)));
        let fit = PeakFit { group_velocity_m_per_s: Estimate::new(52.0, 0.04), t_at_gap_zero_s: 5e-4 };
        PeakTrace { peaks: peaks.collect(), pitch_m: 0.03, fit: Some(fit) }
    }

    #[test]
    fn the_fit_is_stated_with_its_uncertainty_and_nothing_overlaps() {
        let drawing = layout(Path::new("x"), &trace()).unwrap();
        drawing.assert_readable();
        let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
        for label in
            ["group velocity 52.000 ± 0.040 m/s", "residual (µs)", "gap number n", "distance n a (mm)"]
        {
            assert!(texts.iter().any(|text| text == label), "{label}: {texts:?}");
        }
    }

    #[test]
    fn residuals_of_exact_times_are_zero() {
        let trace = trace();
        let residuals = residuals(&trace, trace.fit.unwrap());
        // Rounding of times of some milliseconds, in microseconds.
        assert!(residuals.iter().all(|point| point.y.value.abs() < 1e-9 && point.y.sigma > 1.9));
    }

    #[test]
    fn degenerate_inputs_are_refused_or_empty() {
        let stem = Path::new("x");
        assert!(layout(stem, &PeakTrace { pitch_m: 0.0, ..trace() }).is_err());
        let drawing = layout(stem, &PeakTrace { peaks: vec![], ..trace() }).unwrap();
        assert!(drawing.text_frames().iter().any(|(text, _)| text == "no data"));
        assert!(layout(stem, &PeakTrace { fit: None, ..trace() }).is_ok());
    }
}
