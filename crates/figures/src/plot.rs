//! A rectangle of the page with an axis each way: where points lie in it, and how lines, markers and axes are drawn.

use crate::colour::{BLACK, Rgb, WHITE};
use crate::data::DataSet;
use crate::drawing::{Anchor, Drawing};
use crate::geometry::{PageRect, Spot};
use crate::scale::Scale;
use crate::series::{DataPoint, Look, MarkerShape, PlotMarker, Series};
use crate::stroke::{Dash, Stroke};
use crate::ticks::Tick;

/// Room above a frame for its title.
pub(crate) const TITLE_MM: f64 = 5.2;
/// Room below a frame that has neither numbers nor a label.
pub(crate) const BARE_MARGIN_MM: f64 = 2.0;
/// Radius of a marker.
pub(crate) const MARKER_MM: f64 = 0.75;
const TICK_MM: f64 = 1.1;
/// Distance between a frame and its numbers.
pub(crate) const NUMBER_GAP_MM: f64 = 1.0;

/// Size of numbers at the ticks of an inset relative to others.
pub(crate) const INSET: f64 = 0.9;
/// Distance between numbers and the label of an upright axis.
pub(crate) const LABEL_GAP_MM: f64 = 1.5;

/// Lengths of ticks into the frame, in millimetres: on the left side and below, on top, and on the right.
#[derive(Debug, Clone, Copy)]
struct TickLengths {
    beside: f64,
    top: f64,
    right: f64,
}

impl TickLengths {
    /// How far ticks reach out of the frame beside the numbers.
    fn outward(self) -> f64 {
        (-self.beside).max(0.0)
    }
}

/// A rectangle of the page with an axis each way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plot {
    pub(crate) frame: PageRect,
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    /// Smaller letters, for an inset.
    pub(crate) compact: bool,
}

/// What is written along the axes; an empty label leaves the numbers out as well.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Labels<'a> {
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
}

/// Room below a frame for its numbers and its label.
pub(crate) fn bottom_margin_mm(drawing: &Drawing) -> f64 {
    2.6 + 2.0 * drawing.label_mm()
}

/// Room beside a frame of the given height for the numbers and the label of its axis.
pub(crate) fn side_margin_mm(drawing: &Drawing, scale: &Scale, height_mm: f64) -> f64 {
    let numbers = widest(drawing, &scale.ticks(n_ticks_up(height_mm)), drawing.number_mm());
    numbers + NUMBER_GAP_MM + LABEL_GAP_MM + drawing.label_mm() + 1.0
}

pub(crate) fn widest(drawing: &Drawing, ticks: &[Tick], em_mm: f64) -> f64 {
    ticks.iter().map(|tick| drawing.text_width(&tick.label, em_mm)).fold(0.0, f64::max)
}

pub(crate) fn n_ticks_up(height_mm: f64) -> usize {
    (height_mm / 8.0).floor().max(2.0) as usize
}

impl Plot {
    pub(crate) fn new(frame: PageRect, x: Scale, y: Scale) -> Self {
        Self { frame, x, y, compact: false }
    }

    fn marker_mm(&self) -> f64 {
        if self.compact { 0.75 * MARKER_MM } else { MARKER_MM }
    }

    /// Sizes of labels and of numbers.
    fn sizes(&self, drawing: &Drawing) -> (f64, f64) {
        let (label, number) = (drawing.label_mm(), drawing.number_mm());
        if self.compact { (number, INSET * number) } else { (label, number) }
    }

    /// Where a point lies on the page, also outside the frame; `None` where it has no place.
    pub(crate) fn spot(&self, x: f64, y: f64) -> Option<Spot> {
        let (across, up) = (self.x.share(x)?, self.y.share(y)?);
        Some((self.frame.left + across * self.frame.width(), self.frame.bottom - up * self.frame.height()))
    }

    fn is_empty(&self) -> bool {
        self.x.is_empty() || self.y.is_empty()
    }

    /// A line through points, cut at the frame and broken where a point has no place.
    pub(crate) fn line(&self, drawing: &mut Drawing, points: &[(f64, f64)], stroke: Stroke) {
        for piece in self.pieces(points) {
            drawing.line(&piece, stroke);
        }
    }

    /// The pieces of a line inside the frame.
    pub(crate) fn pieces(&self, points: &[(f64, f64)]) -> Vec<Vec<Spot>> {
        let spots: Vec<Option<Spot>> = points.iter().map(|&(x, y)| self.spot(x, y)).collect();
        let runs = spots.split(Option::is_none);
        runs.flat_map(|run| self.frame.clip(&run.iter().flatten().copied().collect::<Vec<_>>())).collect()
    }

    /// A series in its look.
    pub(crate) fn series(&self, drawing: &mut Drawing, points: &[DataPoint], look: Look) {
        match look {
            Look::Markers(marker) => self.markers(drawing, points, marker),
            Look::Line(stroke) => {
                let line: Vec<_> = points.iter().map(|point| (point.x.value, point.y.value)).collect();
                self.line(drawing, &line, stroke);
            }
        }
    }

    /// Several series, lines first, so that markers stay visible on them, and their numbers for the figure's table.
    pub(crate) fn all(
        &self,
        drawing: &mut Drawing,
        panel: &str,
        labels: Labels,
        series: &[Series],
        looks: &[Look],
    ) {
        self.layers(drawing, series, looks);
        for series in series {
            record(drawing, panel, &series.name, labels, &series.points);
        }
    }

    /// Several series: whole lines, then broken ones, through which the others are seen, then markers.
    pub(crate) fn layers(&self, drawing: &mut Drawing, series: &[Series], looks: &[Look]) {
        let layer = |look: &Look| match look {
            Look::Line(stroke) if stroke.dash == Dash::Solid => 0,
            Look::Line(_) => 1,
            Look::Markers(_) => 2,
        };
        for current in 0..=2 {
            for (series, look) in series.iter().zip(looks).filter(|(_, look)| layer(look) == current) {
                self.series(drawing, &series.points, *look);
            }
        }
    }

    /// Error bars lie on their markers, so that short ones are seen as well.
    fn markers(&self, drawing: &mut Drawing, points: &[DataPoint], marker: PlotMarker) {
        for point in points {
            match self.spot(point.x.value, point.y.value) {
                Some(spot) if self.frame.holds(spot) => mark(drawing, spot, marker, self.marker_mm()),
                _ => {}
            }
        }
        points.iter().for_each(|point| self.error_bars(drawing, point, marker.colour));
    }

    fn error_bars(&self, drawing: &mut Drawing, &DataPoint { x, y }: &DataPoint, colour: Rgb) {
        if y.sigma > 0.0 {
            self.bar(drawing, [(x.value, y.value - y.sigma), (x.value, y.value + y.sigma)], colour);
        }
        if x.sigma > 0.0 {
            self.bar(drawing, [(x.value - x.sigma, y.value), (x.value + x.sigma, y.value)], colour);
        }
    }

    /// An upright or level error bar between two points, with a cap at each end that lies inside the frame.
    pub(crate) fn bar(&self, drawing: &mut Drawing, ends: [(f64, f64); 2], colour: Rgb) {
        const CAP_MM: f64 = 0.6;
        let stroke = Stroke::new(0.8, colour, Dash::Solid);
        let [Some(from), Some(to)] = ends.map(|(x, y)| self.spot(x, y)) else { return };
        if let Some((from, to)) = self.frame.clip_segment(from, to) {
            drawing.segment(from, to, stroke);
        }
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        if length < 2.0 * self.marker_mm() {
            return;
        }
        let across = (CAP_MM * (to.1 - from.1).abs() / length, CAP_MM * (to.0 - from.0).abs() / length);
        for (x, y) in [from, to].into_iter().filter(|&end| self.frame.holds(end)) {
            drawing.segment((x - across.0, y - across.1), (x + across.0, y + across.1), stroke);
        }
    }

    /// Fills the frame's height between two abscissas.
    pub(crate) fn shade(&self, drawing: &mut Drawing, (from, to): (f64, f64), fill: Rgb) {
        let across = |x: f64| self.x.share(x).map(|share| share.clamp(0.0, 1.0));
        let (Some(from), Some(to)) = (across(from), across(to)) else { return };
        let at = |share: f64| self.frame.left + share * self.frame.width();
        let (left, right) = (at(from.min(to)), at(from.max(to)));
        if right > left {
            drawing.fill(PageRect { left, right, ..self.frame }, fill);
        }
    }

    /// A line across the frame at an ordinate.
    pub(crate) fn level(&self, drawing: &mut Drawing, y: f64, stroke: Stroke) {
        if let Some(up) = self.y.share(y).filter(|share| (0.0..=1.0).contains(share)) {
            let height = self.frame.bottom - up * self.frame.height();
            drawing.segment((self.frame.left, height), (self.frame.right, height), stroke);
        }
    }

    /// A line up the frame at an abscissa; says where it stands when that is inside.
    pub(crate) fn upright(&self, drawing: &mut Drawing, x: f64, stroke: Stroke) -> Option<f64> {
        let across = self.x.share(x).filter(|share| (0.0..=1.0).contains(share))?;
        let place = self.frame.left + across * self.frame.width();
        drawing.segment((place, self.frame.bottom), (place, self.frame.top), stroke);
        Some(place)
    }

    /// The frame with inward ticks on all sides, numbers and labels; "no data" in its middle when it is empty.
    pub(crate) fn axes(&self, drawing: &mut Drawing, labels: Labels) {
        self.draw_axes(drawing, labels, TickLengths { beside: TICK_MM, top: TICK_MM, right: TICK_MM });
    }

    /// As [`Plot::axes`], but without ticks on the right side, where [`Plot::right_axis`] puts its own.
    pub(crate) fn open_axes(&self, drawing: &mut Drawing, labels: Labels) {
        self.draw_axes(drawing, labels, TickLengths { beside: TICK_MM, top: TICK_MM, right: 0.0 });
    }

    /// As [`Plot::axes`], with outward ticks on the left and below only: for maps, which cover the frame.
    pub(crate) fn map_axes(&self, drawing: &mut Drawing, labels: Labels) {
        self.draw_axes(drawing, labels, TickLengths { beside: -0.8, top: 0.0, right: 0.0 });
    }

    /// The frame with a numbered axis below and a name at each row; row `i` from the top lies at the ordinate `-i`.
    pub(crate) fn named_rows(&self, drawing: &mut Drawing, label: &str, names: &[&str]) {
        self.say_if_empty(drawing);
        self.x_axis(drawing, label, TickLengths { beside: TICK_MM, top: TICK_MM, right: 0.0 });
        for (i, name) in names.iter().enumerate() {
            let Some(share) = self.y.share(-(i as f64)) else { continue };
            let at = (self.frame.left - NUMBER_GAP_MM, self.frame.bottom - share * self.frame.height());
            drawing.text(name, at, drawing.number_mm(), Anchor::End);
        }
        drawing.outline(self.frame, Stroke::axis());
    }

    fn draw_axes(&self, drawing: &mut Drawing, labels: Labels, lengths: TickLengths) {
        self.say_if_empty(drawing);
        self.x_axis(drawing, labels.x, lengths);
        self.y_axis(drawing, labels.y, lengths);
        drawing.outline(self.frame, Stroke::axis());
    }

    fn say_if_empty(&self, drawing: &mut Drawing) {
        if self.is_empty() {
            drawing.text("no data", self.frame.centre(), self.sizes(drawing).0, Anchor::Middle);
        }
    }

    fn x_axis(&self, drawing: &mut Drawing, label: &str, lengths: TickLengths) {
        let (frame, (label_mm, number_mm)) = (self.frame, self.sizes(drawing));
        let ticks = self.x_ticks(drawing);
        // Exponents need room above them.
        let is_raised = ticks.iter().any(|tick| tick.label.contains('^'));
        let gap = NUMBER_GAP_MM + if is_raised { 0.25 * number_mm } else { 0.0 };
        let numbers_y = frame.bottom + lengths.outward() + gap + 0.36 * number_mm;
        for x in self.x.minor_ticks().into_iter().filter_map(|value| self.x.share(value)) {
            let x = frame.left + x * frame.width();
            drawing.tick((x, frame.bottom), (0.0, -0.5 * lengths.beside));
        }
        for tick in ticks {
            let Some(share) = self.x.share(tick.value) else { continue };
            let x = frame.left + share * frame.width();
            drawing.tick((x, frame.bottom), (0.0, -lengths.beside));
            drawing.tick((x, frame.top), (0.0, lengths.top));
            if !label.is_empty() {
                self.number(drawing, &tick.label, (x, numbers_y), Anchor::Middle);
            }
        }
        let label_y = numbers_y + 0.6 * number_mm + 0.6 + 0.36 * label_mm;
        drawing.text(label, (frame.centre().0, label_y), label_mm, Anchor::Middle);
    }

    fn number(&self, drawing: &mut Drawing, label: &str, at: Spot, anchor: Anchor) {
        let number = drawing.style.decimals(label);
        drawing.text(&number, at, self.sizes(drawing).1, anchor);
    }

    /// As many ticks as their numbers leave room for.
    fn x_ticks(&self, drawing: &Drawing) -> Vec<Tick> {
        if self.is_empty() {
            return Vec::new();
        }
        let wanted = (self.frame.width() / 9.0).floor().clamp(2.0, 8.0) as usize;
        let ticks = self.x.ticks(wanted);
        let room = self.frame.width() / (widest(drawing, &ticks, self.sizes(drawing).1) + 2.0);
        if ticks.len() as f64 <= room { ticks } else { self.x.ticks(room.floor().max(1.0) as usize) }
    }

    fn y_ticks(&self, scale: &Scale) -> Vec<Tick> {
        if self.is_empty() { Vec::new() } else { scale.ticks(n_ticks_up(self.frame.height())) }
    }

    fn y_axis(&self, drawing: &mut Drawing, label: &str, lengths: TickLengths) {
        let (frame, (label_mm, number_mm)) = (self.frame, self.sizes(drawing));
        let ticks = self.y_ticks(&self.y);
        for y in self.y.minor_ticks().into_iter().filter_map(|value| self.y.share(value)) {
            let y = frame.bottom - y * frame.height();
            drawing.tick((frame.left, y), (0.5 * lengths.beside, 0.0));
        }
        let numbers_x = frame.left - lengths.outward() - NUMBER_GAP_MM;
        for tick in &ticks {
            let Some(share) = self.y.share(tick.value) else { continue };
            let y = frame.bottom - share * frame.height();
            drawing.tick((frame.left, y), (lengths.beside, 0.0));
            drawing.tick((frame.right, y), (-lengths.right, 0.0));
            if !label.is_empty() {
                self.number(drawing, &tick.label, (numbers_x, y), Anchor::End);
            }
        }
        let label_x = numbers_x - widest(drawing, &ticks, number_mm) - LABEL_GAP_MM - 0.5 * label_mm;
        drawing.upward_text(label, (label_x, frame.centre().1), label_mm);
    }

    /// Ticks, numbers and a label on the right side, for a second unit of the same ordinate.
    pub(crate) fn right_axis(&self, drawing: &mut Drawing, scale: &Scale, label: &str) {
        let (frame, (label_mm, number_mm)) = (self.frame, self.sizes(drawing));
        let ticks = self.y_ticks(scale);
        for tick in &ticks {
            let Some(share) = scale.share(tick.value) else { continue };
            let y = frame.bottom - share * frame.height();
            drawing.tick((frame.right, y), (-TICK_MM, 0.0));
            self.number(drawing, &tick.label, (frame.right + NUMBER_GAP_MM, y), Anchor::Start);
        }
        let offset = NUMBER_GAP_MM + widest(drawing, &ticks, number_mm) + LABEL_GAP_MM + 0.5 * label_mm;
        drawing.upward_text(label, (frame.right + offset, frame.centre().1), label_mm);
    }
}

/// Keeps the numbers of a curve or of markers for the figure's table.
pub(crate) fn record(drawing: &mut Drawing, panel: &str, name: &str, labels: Labels, points: &[DataPoint]) {
    drawing.data.push(DataSet::of_points(panel, name, (labels.x, labels.y), points));
}

/// A marker with an outline in its colour around a lighter ground (white when it is hollow), so that markers that touch stay
/// apart and nothing around them is covered.
pub(crate) fn draw_marker(drawing: &mut Drawing, spot: Spot, marker: PlotMarker) {
    mark(drawing, spot, marker, MARKER_MM);
}

fn mark(drawing: &mut Drawing, spot: Spot, PlotMarker { shape, colour, hollow }: PlotMarker, size_mm: f64) {
    if shape == MarkerShape::Cross {
        let (reach, stroke) = (0.85 * size_mm, Stroke::new(1.2, colour, Dash::Solid));
        drawing.segment((spot.0 - reach, spot.1 - reach), (spot.0 + reach, spot.1 + reach), stroke);
        drawing.segment((spot.0 - reach, spot.1 + reach), (spot.0 + reach, spot.1 - reach), stroke);
        return;
    }
    let inside = if hollow { WHITE } else { colour.tint(0.55) };
    for (radius, fill) in [(size_mm, colour), (size_mm - 0.22, inside)] {
        if shape == MarkerShape::Circle {
            drawing.disc(spot, radius, fill);
        } else {
            let corners = corners_of(shape).iter().map(|(x, y)| (spot.0 + radius * x, spot.1 + radius * y));
            drawing.area(corners.collect(), fill);
        }
    }
}

/// Corners of a marker of unit radius, of about the area of the circle.
fn corners_of(shape: MarkerShape) -> &'static [Spot] {
    match shape {
        MarkerShape::Diamond => &[(0.0, -1.3), (1.2, 0.0), (0.0, 1.3), (-1.2, 0.0)],
        MarkerShape::Triangle => &[(0.0, -1.25), (1.2, 0.85), (-1.2, 0.85)],
        _ => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
    }
}

/// A panel's letter and title above its frame.
pub(crate) fn title(drawing: &mut Drawing, frame: PageRect, text: &str) {
    let at = (frame.left, frame.top - 2.4);
    let em_mm = drawing.label_mm();
    let shown = drawing.fitted(text, em_mm, frame.width());
    drawing.text(&shown, at, em_mm, Anchor::Start);
}

/// Moves blocks of text (centre, height), ordered from the top, apart and between two heights.
pub(crate) fn spread(blocks: &[(f64, f64)], (top, bottom): (f64, f64), gap: f64) -> Vec<f64> {
    let mut centres = Vec::with_capacity(blocks.len());
    let mut free = top;
    for &(centre, height) in blocks {
        let placed = centre.max(free + 0.5 * height);
        free = placed + 0.5 * height + gap;
        centres.push(placed);
    }
    let mut limit = bottom;
    for (centre, (_, height)) in centres.iter_mut().zip(blocks).rev() {
        *centre = centre.min(limit - 0.5 * height);
        limit = *centre - 0.5 * height - gap;
    }
    centres
}

/// The letter of a panel, with its title: "(a) experiment"; no letter when there is one panel only.
pub(crate) fn lettered(index: usize, count: usize, text: &str) -> String {
    let letter = char::from(b'a' + (index % 26) as u8);
    match (count > 1, text.is_empty()) {
        (true, true) => format!("({letter})"),
        (true, false) => format!("({letter}) {text}"),
        (false, _) => text.into(),
    }
}

/// A thin gray line at zero, behind the data.
pub(crate) fn zero_line() -> Stroke {
    Stroke::new(0.5, BLACK.tint(0.45), Dash::Solid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_moved_apart_and_stay_between_their_limits() {
        let places = spread(&[(1.0, 4.0), (2.0, 4.0), (29.5, 4.0)], (0.0, 30.0), 1.0);
        assert!(places.windows(2).all(|pair| pair[1] - pair[0] >= 5.0 - 1e-12), "{places:?}");
        assert!(places[0] >= 2.0 && places[2] <= 28.0);
    }
}
