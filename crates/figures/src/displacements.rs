use std::path::Path;

use chainwave_measurement::Estimate;

use crate::colour::{BLACK, VERMILLION, ordered};
use crate::drawing::{Dash, Drawing, Stroke};
use crate::geometry::{Frame, Spot};
use crate::legend::{self, Entry, Key};
use crate::plot::{self, BOTTOM_MARGIN_MM, Labels, Plot, draw_marker};
use crate::scale::{Extent, Scale};
use crate::series::{Marker, MarkerShape};
use crate::{FigureError, output};

const HEIGHT_MM: f64 = 62.0;
const LOST: Marker = Marker { shape: MarkerShape::Cross, colour: VERMILLION, hollow: false };

/// The motion of one body.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMotion {
    /// Number of the body.
    pub body: usize,
    /// Time in seconds and displacement in metres; `None` where the body was not measured.
    pub samples: Vec<(f64, Option<Estimate>)>,
    /// A model's time in seconds and displacement in metres, which may be empty.
    pub model: Vec<(f64, f64)>,
}

/// The motion of one coordinate of a followed point.
#[derive(Debug, Clone, PartialEq)]
pub struct PointMotion {
    /// Name of the point and of its coordinate.
    pub name: String,
    /// Time in seconds and displacement in pixels; `None` where the point was lost.
    pub samples: Vec<(f64, Option<Estimate>)>,
}

/// A curve in the units of the axes.
struct Curve {
    name: String,
    samples: Vec<(f64, Option<Estimate>)>,
    model: Vec<(f64, f64)>,
}

/// Draws the displacements of bodies over time with 95 % bands, a cross where a body was lost, and a model as a dashed
/// line.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn displacements(stem: &Path, bodies: &[BodyMotion]) -> Result<(), FigureError> {
    output::write(stem, &layout(&curves_of(bodies), "displacement (mm)")?)
}

/// Draws how far points moved in the picture over time, with 95 % bands and a cross where a point was lost.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn tracks(stem: &Path, points: &[PointMotion]) -> Result<(), FigureError> {
    let in_milliseconds = |&(t_s, x_px): &(f64, Option<Estimate>)| (1e3 * t_s, x_px);
    let curve = |point: &PointMotion| Curve {
        name: point.name.clone(),
        samples: point.samples.iter().map(in_milliseconds).collect(),
        model: Vec::new(),
    };
    output::write(stem, &layout(&points.iter().map(curve).collect::<Vec<_>>(), "displacement (px)")?)
}

/// Times in milliseconds and displacements in millimetres.
fn curves_of(bodies: &[BodyMotion]) -> Vec<Curve> {
    let curve = |body: &BodyMotion| Curve {
        name: format!("body {}", body.body),
        samples: body.samples.iter().map(|(t_s, x_m)| (1e3 * t_s, x_m.map(|x_m| x_m.scaled(1e3)))).collect(),
        model: body.model.iter().map(|&(t_s, x_m)| (1e3 * t_s, 1e3 * x_m)).collect(),
    };
    bodies.iter().map(curve).collect()
}

fn layout(curves: &[Curve], of_displacement: &str) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(Drawing::TWO_COLUMNS_MM)?;
    let (x, y) = scales(curves);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let top = legend::draw(&mut drawing, &entries(curves), (left, Drawing::TWO_COLUMNS_MM), 1.0) + 1.5;
    let frame = Frame::new(left, top, Drawing::TWO_COLUMNS_MM - left - 2.0, HEIGHT_MM);
    let plot = Plot { frame, x, y };
    plot.level(&mut drawing, 0.0, plot::zero_line());
    for (index, curve) in curves.iter().enumerate() {
        draw_band(&mut drawing, &plot, curve, ordered(index, curves.len()).tint(0.35));
    }
    for (index, curve) in curves.iter().enumerate() {
        plot.line(&mut drawing, &line_of(curve), curve_stroke(index, curves.len()));
        plot.line(&mut drawing, &curve.model, model_stroke());
    }
    for loss in curves.iter().flat_map(losses) {
        if let Some(spot) = plot.spot(loss.0, loss.1).filter(|&spot| frame.holds(spot)) {
            draw_marker(&mut drawing, spot, LOST);
        }
    }
    plot.axes(&mut drawing, Labels { x: "time (ms)", y: of_displacement });
    drawing.extend_to(frame.bottom + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

/// A curve's points, not a number where it was not measured.
fn line_of(curve: &Curve) -> Vec<(f64, f64)> {
    curve.samples.iter().map(|(t, x)| (*t, x.map_or(f64::NAN, |x| x.value))).collect()
}

/// Time and the two ends of the 95 % interval, for each run of measured samples.
fn bands(curve: &Curve) -> impl Iterator<Item = Vec<(f64, f64, f64)>> + '_ {
    let ends = |&(t, x): &(f64, Option<Estimate>)| {
        let half = |sigma: f64| Estimate::COVERAGE_95 * if sigma > 0.0 { sigma } else { 0.0 };
        x.map(|x| (t, x.value - half(x.sigma), x.value + half(x.sigma)))
    };
    let runs = curve.samples.split(|(_, x)| x.is_none());
    runs.map(move |run| run.iter().filter_map(ends).collect())
}

/// The last measured sample before each loss.
fn losses(curve: &Curve) -> Vec<(f64, f64)> {
    let lost = |pair: &&[(f64, Option<Estimate>)]| pair[0].1.is_some() && pair[1].1.is_none();
    let last_seen = curve.samples.windows(2).filter(lost);
    last_seen.filter_map(|pair| pair[0].1.map(|x| (pair[0].0, x.value))).collect()
}

fn scales(curves: &[Curve]) -> (Scale, Scale) {
    let ends = || curves.iter().flat_map(bands).flatten();
    let models = || curves.iter().flat_map(|curve| &curve.model);
    let x = Extent::of(ends().map(|(t, ..)| t).chain(models().map(|(t, _)| *t)));
    let reach = ends().flat_map(|(_, low, high)| [low, high]);
    let y = Extent::of(reach.chain(models().map(|(_, x)| *x)));
    (Scale::linear(x), Scale::linear(y.map(|extent| extent.padded(0.05))))
}

fn curve_stroke(index: usize, count: usize) -> Stroke {
    Stroke::new(1.2, ordered(index, count), Dash::Solid)
}

fn model_stroke() -> Stroke {
    Stroke::new(0.7, BLACK, Dash::Dashed)
}

fn entries(curves: &[Curve]) -> Vec<Entry> {
    let line = |index| Key::Line(curve_stroke(index, curves.len()));
    let mut entries: Vec<Entry> =
        curves.iter().enumerate().map(|(index, curve)| Entry::new(curve.name.clone(), line(index))).collect();
    if curves.iter().any(|curve| !curve.model.is_empty()) {
        entries.push(Entry::new("model", Key::Line(model_stroke())));
    }
    if curves.iter().any(|curve| !losses(curve).is_empty()) {
        entries.push(Entry::new("lost", Key::Marker(LOST)));
    }
    entries
}

fn draw_band(drawing: &mut Drawing, plot: &Plot, curve: &Curve, fill: crate::colour::Rgb) {
    for band in bands(curve) {
        let lower = band.iter().filter_map(|&(t, low, _)| plot.spot(t, low));
        let upper = band.iter().rev().filter_map(|&(t, _, high)| plot.spot(t, high));
        let border: Vec<Spot> = lower.chain(upper).collect();
        if border.len() > 3 {
            drawing.area(border, fill);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(body: usize, lost: std::ops::Range<i32>) -> BodyMotion {
        let x_m = |i: i32| 1e-3 * (0.1 * f64::from(i)).tanh();
        let sample = |i| (1e-5 * f64::from(i), (!lost.contains(&i)).then(|| Estimate::new(x_m(i), 1e-5)));
        BodyMotion { body, samples: (0..100).map(sample).collect(), model: vec![(0.0, 0.0), (1e-3, 1e-3)] }
    }

    fn losses_of(lost: std::ops::Range<i32>) -> Vec<(f64, f64)> {
        losses(&curves_of(&[motion(1, lost)])[0])
    }

    #[test]
    fn each_loss_is_marked_once_where_the_body_was_last_seen() {
        assert_eq!(losses_of(0..0), []);
        assert_eq!(losses_of(0..5), []);
        let marked = losses_of(40..60);
        assert_eq!(marked.len(), 1);
        // One multiplication by 1000 may round in the last digit.
        assert!((marked[0].0 - 0.39).abs() < 1e-12);
    }

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        let bodies: Vec<BodyMotion> = (1..=26).map(|body| motion(body, 40..60)).collect();
        let drawing = layout(&curves_of(&bodies), "displacement (mm)").unwrap();
        drawing.assert_readable();
        let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
        for label in ["time (ms)", "displacement (mm)", "body 26", "lost", "model"] {
            assert!(texts.iter().any(|text| text == label), "{label}");
        }
    }

    #[test]
    fn bodies_never_seen_leave_an_empty_panel() {
        let unseen = BodyMotion { body: 1, samples: vec![(0.0, None), (1.0, None)], model: vec![] };
        for bodies in [vec![], vec![unseen]] {
            let drawing = layout(&curves_of(&bodies), "displacement (mm)").unwrap();
            assert!(drawing.text_frames().iter().any(|(text, _)| text == "no data"));
        }
    }
}
