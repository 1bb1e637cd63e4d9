//! Displacements of bodies, or of points followed in a picture, over time, with their intervals and what a model leaves.

use chainwave_measurement::{ChainMotion, Estimate};
use serde::{Deserialize, Serialize};

use crate::colour::{CHAIN, EXPERIMENT, GRAY, RINGS, Rgb};
use crate::drawing::{Anchor, Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::{PageRect, Spot};
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, BARE_MARGIN_MM, Labels, Plot, draw_marker};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, MarkerShape, PlotMarker};
use crate::stroke::{Dash, Stroke};
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 62.0;
const RESIDUAL_HEIGHT_MM: f64 = 26.0;
/// Room between a frame and the names right of it.
const NAME_GAP_MM: f64 = 3.0;
/// The names take this share of the page at most.
const WIDEST_NAME: f64 = 0.2;
const LOST: PlotMarker = PlotMarker { shape: MarkerShape::Cross, colour: RINGS, hollow: false };

/// The axis of times that are known.
const MILLISECONDS: &str = "time (ms)";

/// The motion of one body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyMotion {
    /// Number of the body.
    pub body: usize,
    /// Time in seconds and displacement in metres; `None` where the body was not measured.
    pub samples: Vec<(f64, Option<Estimate>)>,
    /// A model's time in seconds, increasing, and displacement in metres, which may be empty.
    pub model: Vec<(f64, f64)>,
}

impl BodyMotion {
    /// The motion of some bodies spread over a chain, without a model. Recordings end a frame apart, so up to three missing samples at
    /// the end are no loss.
    pub fn spread_over(motion: &ChainMotion) -> Vec<Self> {
        spread(motion.n_bodies())
            .map(|row| Self { body: row + 1, samples: samples_of(motion, row), model: Vec::new() })
            .collect()
    }
}

impl RecordingMotion {
    /// Some of many, spread over them in their order.
    pub fn spread_over(all: &[Self]) -> Vec<Self> {
        spread(all.len()).map(|at| all[at].clone()).collect()
    }
}

/// Five of so many, with the first and the last, keep a figure readable.
fn spread(n: usize) -> impl Iterator<Item = usize> {
    (0..5.min(n)).map(move |k| k * (n - 1) / 4.min(n - 1).max(1))
}

fn samples_of(motion: &ChainMotion, row: usize) -> Vec<(f64, Option<Estimate>)> {
    let row = motion.displacement_m.row(row);
    let mut samples: Vec<_> = motion.times_s.iter().copied().zip(row.iter().copied()).collect();
    let missing = samples.iter().rev().take_while(|(_, sample)| sample.is_none()).count();
    if missing <= 3 {
        samples.truncate(samples.len() - missing);
    }
    samples
}

/// The motion of one coordinate of a followed point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointMotion {
    /// Name of the point and of its coordinate.
    pub name: String,
    /// Time in seconds, or number of the frame, and displacement in pixels; `None` where the point was lost.
    pub samples: Vec<(f64, Option<Estimate>)>,
    /// Whether frames are counted, for want of a frame rate.
    #[serde(default)]
    pub in_frames: bool,
}

/// The motion of the camera in one recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingMotion {
    /// Name of the recording.
    pub recording: String,
    /// Time in seconds and motion in metres; `None` where it is not known.
    pub samples: Vec<(f64, Option<Estimate>)>,
}

/// A curve in the units of the axes.
struct MotionCurve {
    name: String,
    samples: Vec<(f64, Option<Estimate>)>,
    model: Vec<(f64, f64)>,
}

impl Draw for [BodyMotion] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, &curves_of(self), [MILLISECONDS, "mm"]).map(Figure::new)
    }
}

impl Draw for [PointMotion] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        let in_frames = self.iter().any(|point| point.in_frames);
        let (factor, time) = if in_frames { (1.0, "frame") } else { (1e3, MILLISECONDS) };
        let scaled = |&(t, x_px): &(f64, Option<Estimate>)| (factor * t, x_px);
        let curve = |point: &PointMotion| MotionCurve {
            name: point.name.clone(),
            samples: point.samples.iter().map(scaled).collect(),
            model: Vec::new(),
        };
        layout(style, &self.iter().map(curve).collect::<Vec<_>>(), [time, "px"]).map(Figure::new)
    }
}

impl Draw for [RecordingMotion] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        let curve = |one: &RecordingMotion| {
            let is_known = |sample: &&(f64, Option<Estimate>)| sample.1.is_some();
            let known = one.samples.iter().rposition(|sample| is_known(&sample)).map_or(0, |last| last + 1);
            let scaled = |(t_s, x_m): &(f64, Option<Estimate>)| (1e3 * t_s, x_m.map(|x_m| x_m.scaled(1e6)));
            let samples = one.samples[..known].iter().skip_while(|sample| !is_known(sample)).map(scaled);
            MotionCurve { name: one.recording.clone(), samples: samples.collect(), model: Vec::new() }
        };
        layout(style, &self.iter().map(curve).collect::<Vec<_>>(), [MILLISECONDS, "µm"]).map(Figure::new)
    }
}

/// Times in milliseconds and displacements in millimetres.
fn curves_of(bodies: &[BodyMotion]) -> Vec<MotionCurve> {
    let curve = |body: &BodyMotion| MotionCurve {
        name: format!("body {}", body.body),
        samples: body.samples.iter().map(|(t_s, x_m)| (1e3 * t_s, x_m.map(|x_m| x_m.scaled(1e3)))).collect(),
        model: body.model.iter().map(|&(t_s, x_m)| (1e3 * t_s, 1e3 * x_m)).collect(),
    };
    bodies.iter().map(curve).collect()
}

fn layout(style: &Style, curves: &[MotionCurve], [time, unit]: [&str; 2]) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::Two)?;
    let page = drawing.width_mm;
    let (x, y) = scales(curves);
    let residuals: Vec<Vec<(f64, f64)>> = curves.iter().map(residuals).collect();
    let has_model = residuals.iter().any(|one| !one.is_empty());
    let residual_y = Extent::of(residuals.iter().flatten().map(|point| point.1));
    let residual_y = Scale::linear(residual_y.map(|extent| extent.including(0.0).padded(0.05)));
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM).max(plot::side_margin_mm(
        &drawing,
        &residual_y,
        RESIDUAL_HEIGHT_MM,
    ));
    let em = drawing.number_mm();
    let names: Vec<String> =
        curves.iter().map(|curve| drawing.fitted(&curve.name, em, WIDEST_NAME * page)).collect();
    let widest = names.iter().map(|name| drawing.text_width(name, em)).fold(0.0, f64::max);
    let width = page - left - NAME_GAP_MM - widest - 1.0;
    let top = legend::draw(&mut drawing, &entries(curves), (left, page), 1.0) + 1.5;
    let plot = Plot::new(PageRect::new(left, top, width, HEIGHT_MM), x, y);
    draw_motions(&mut drawing, &plot, curves);
    name_curves(&mut drawing, &plot, curves, &names);
    let label = format!("displacement ({unit})");
    let labels = Labels { x: time, y: &label };
    plot.axes(&mut drawing, Labels { x: if has_model { "" } else { labels.x }, ..labels });
    record(&mut drawing, curves, labels);
    let mut bottom = plot.frame.bottom;
    if has_model {
        let frame = PageRect::new(left, bottom + BARE_MARGIN_MM, width, RESIDUAL_HEIGHT_MM);
        let lower = Plot::new(frame, x, residual_y);
        for (index, residual) in residuals.iter().enumerate() {
            lower.line(&mut drawing, residual, thin(index, curves.len()));
        }
        lower.level(&mut drawing, 0.0, model_stroke());
        let label = format!("residual ({unit})");
        lower.axes(&mut drawing, Labels { y: &label, ..labels });
        bottom = frame.bottom;
    }
    drawing.extend_to(bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

fn draw_motions(drawing: &mut Drawing, plot: &Plot, curves: &[MotionCurve]) {
    plot.level(drawing, 0.0, plot::zero_line());
    for (index, curve) in curves.iter().enumerate() {
        draw_band(drawing, plot, curve, colour(index, curves.len()).tint(0.3));
    }
    for (index, curve) in curves.iter().enumerate() {
        plot.line(drawing, &line_of(curve), Stroke::new(1.2, colour(index, curves.len()), Dash::Solid));
        plot.line(drawing, &curve.model, model_stroke());
    }
    for loss in curves.iter().flat_map(losses) {
        if let Some(spot) = plot.spot(loss.0, loss.1).filter(|&spot| plot.frame.holds(spot)) {
            draw_marker(drawing, spot, LOST);
        }
    }
}

/// Keeps the numbers for the figure's table.
fn record(drawing: &mut Drawing, curves: &[MotionCurve], labels: Labels) {
    for curve in curves {
        let measured = curve.samples.iter().filter_map(|(t, x)| Some(DataPoint::measured(*t, (*x)?)));
        plot::record(drawing, "", &curve.name, labels, &measured.collect::<Vec<_>>());
        let model: Vec<DataPoint> = curve.model.iter().map(|&(t, x)| DataPoint::exact(t, x)).collect();
        if !model.is_empty() {
            plot::record(drawing, "", &format!("{}, chain model", curve.name), labels, &model);
        }
    }
}

/// Each curve's name right of the frame at the height of its last value, joined to it by a thin line; of very
/// many curves, every second or third.
fn name_curves(drawing: &mut Drawing, plot: &Plot, curves: &[MotionCurve], names: &[String]) {
    let em = drawing.number_mm();
    let row_mm = 1.3 * em;
    let last = |curve: &MotionCurve| curve.samples.iter().rev().find_map(|(t, x)| plot.spot(*t, (*x)?.value));
    let mut ends: Vec<(f64, &String)> =
        curves.iter().zip(names).filter_map(|(curve, name)| Some((last(curve)?.1, name))).collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let n_fitting = (plot.frame.height() / row_mm).floor().max(1.0) as usize;
    let stride = ends.len().div_ceil(n_fitting).max(1);
    let ends: Vec<(f64, &String)> = ends.into_iter().step_by(stride).collect();
    let blocks: Vec<(f64, f64)> = ends.iter().map(|(y, _)| (*y, row_mm)).collect();
    let places = plot::spread(&blocks, (plot.frame.top, plot.frame.bottom), 0.0);
    for ((end, name), y) in ends.iter().zip(places) {
        let right = plot.frame.right;
        drawing.segment(
            (right + 0.3, *end),
            (right + NAME_GAP_MM - 0.6, y),
            Stroke::new(0.5, GRAY, Dash::Solid),
        );
        drawing.text(name, (right + NAME_GAP_MM, y), em, Anchor::Start);
    }
}

/// A curve's points, not a number where it was not measured.
fn line_of(curve: &MotionCurve) -> Vec<(f64, f64)> {
    curve.samples.iter().map(|(t, x)| (*t, x.map_or(f64::NAN, |x| x.value))).collect()
}

/// Measured less modelled displacement, where both are known; the model between its samples along a straight line.
fn residuals(curve: &MotionCurve) -> Vec<(f64, f64)> {
    let model_at = |t: f64| {
        let after = curve.model.partition_point(|sample| sample.0 < t);
        let (to, from) = (curve.model.get(after)?, curve.model.get(after.saturating_sub(1))?);
        if to.0 <= from.0 {
            return (to.0 <= t).then_some(to.1);
        }
        Some(from.1 + (t - from.0) / (to.0 - from.0) * (to.1 - from.1))
    };
    if curve.model.is_empty() {
        return Vec::new();
    }
    let residual = |x: Option<Estimate>, t: f64| Some(x?.value - model_at(t)?);
    curve.samples.iter().map(|&(t, x)| (t, residual(x, t).unwrap_or(f64::NAN))).collect()
}

/// Time and the two ends of the 95 % interval, for each run of measured samples.
fn bands(curve: &MotionCurve) -> impl Iterator<Item = Vec<(f64, f64, f64)>> + '_ {
    let ends = |&(t, x): &(f64, Option<Estimate>)| {
        let half = |sigma: f64| Estimate::COVERAGE_95 * if sigma > 0.0 { sigma } else { 0.0 };
        x.map(|x| (t, x.value - half(x.sigma), x.value + half(x.sigma)))
    };
    let runs = curve.samples.split(|(_, x)| x.is_none());
    runs.map(move |run| run.iter().filter_map(ends).collect())
}

/// The last measured sample before each loss.
fn losses(curve: &MotionCurve) -> Vec<(f64, f64)> {
    let lost = |pair: &&[(f64, Option<Estimate>)]| pair[0].1.is_some() && pair[1].1.is_none();
    let last_seen = curve.samples.windows(2).filter(lost);
    last_seen.filter_map(|pair| pair[0].1.map(|x| (pair[0].0, x.value))).collect()
}

fn scales(curves: &[MotionCurve]) -> (Scale, Scale) {
    let ends = || curves.iter().flat_map(bands).flatten();
    let models = || curves.iter().flat_map(|curve| &curve.model);
    let x = Extent::of(ends().map(|(t, ..)| t).chain(models().map(|(t, _)| *t)));
    let reach = ends().flat_map(|(_, low, high)| [low, high]);
    let y = Extent::of(reach.chain(models().map(|(_, x)| *x)));
    (Scale::linear(x), Scale::linear(y.map(|extent| extent.padded(0.05))))
}

fn colour(index: usize, count: usize) -> Rgb {
    EXPERIMENT.shade(index, count)
}

fn thin(index: usize, count: usize) -> Stroke {
    Stroke::new(0.8, colour(index, count), Dash::Solid)
}

fn model_stroke() -> Stroke {
    Stroke::new(0.9, CHAIN, Dash::Dashed)
}

/// What the signs mean; curves are named beside their ends.
fn entries(curves: &[MotionCurve]) -> Vec<LegendEntry> {
    let measured = LegendKey::Band(Stroke::new(1.2, EXPERIMENT, Dash::Solid), EXPERIMENT.tint(0.3));
    let mut entries = vec![LegendEntry::new("measured, with 95 % interval", measured)];
    if curves.iter().any(|curve| !curve.model.is_empty()) {
        entries.push(LegendEntry::new("chain model", LegendKey::Line(model_stroke())));
    }
    if curves.iter().any(|curve| !losses(curve).is_empty()) {
        entries.push(LegendEntry::new("lost", LegendKey::Marker(LOST)));
    }
    entries
}

fn draw_band(drawing: &mut Drawing, plot: &Plot, curve: &MotionCurve, fill: Rgb) {
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
        let x_m = |i: i32| 1e-3 * (0.1 * f64::from(i)).tanh() / (1.0 + 0.1 * body as f64);
        let sample = |i| (1e-5 * f64::from(i), (!lost.contains(&i)).then(|| Estimate::new(x_m(i), 1e-5)));
        let model = (0..50).map(|i| (2e-5 * f64::from(i), x_m(2 * i)));
        BodyMotion { body, samples: (0..100).map(sample).collect(), model: model.collect() }
    }

    fn drawn(bodies: &[BodyMotion]) -> Drawing {
        layout(&Style::default(), &curves_of(bodies), [MILLISECONDS, "mm"]).unwrap()
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
    fn curves_are_named_beside_their_ends_and_nothing_overlaps() {
        for count in [1, 5, 26] {
            let bodies: Vec<BodyMotion> = (1..=count).map(|body| motion(body, 40..60)).collect();
            let drawing = drawn(&bodies);
            drawing.assert_readable();
            for label in ["time (ms)", "displacement (mm)", "residual (mm)", "body 1", "lost", "chain model"]
            {
                assert!(drawing.says(label), "{label}");
            }
        }
    }

    #[test]
    fn residuals_are_known_where_body_and_model_are() {
        let residual = &residuals(&curves_of(&[motion(1, 40..60)])[0]);
        let known: Vec<&(f64, f64)> = residual.iter().filter(|point| point.1.is_finite()).collect();
        // Of 100 samples 20 are lost, and the last one lies behind the model's end.
        assert_eq!(known.len(), 79);
        // At every second sample the model is the motion; between them a line is off by at most h^2 / 8 of the second
        // derivative of tanh (0.77) times 0.01 per sample squared, of 0.91 mm.
        let bound = 4.0 / 8.0 * 0.77 * 0.01 * 0.91;
        assert!(known.iter().all(|point| point.1.abs() < 1.01 * bound));
    }

    #[test]
    fn bodies_never_seen_leave_an_empty_panel() {
        let unseen = BodyMotion { body: 1, samples: vec![(0.0, None), (1.0, None)], model: vec![] };
        for bodies in [vec![], vec![unseen]] {
            assert!(drawn(&bodies).says("no data"));
        }
    }
}
