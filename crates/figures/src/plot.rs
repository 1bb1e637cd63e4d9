use crate::colour::{BLACK, Rgb, WHITE};
use crate::drawing::{Anchor, Dash, Drawing, LABEL_MM, NUMBER_MM, Stroke};
use crate::geometry::{Frame, Spot};
use crate::scale::Scale;
use crate::series::{Look, Marker, MarkerShape, Point};
use crate::ticks::Tick;

/// Room below a frame for its numbers and its label.
pub(crate) const BOTTOM_MARGIN_MM: f64 = 8.6;
/// Room below a frame that has neither.
pub(crate) const BARE_MARGIN_MM: f64 = 2.0;
/// Radius of a marker.
const MARKER_MM: f64 = 0.68;
const TICK_MM: f64 = 1.1;
/// Distance between a frame and its numbers.
const NUMBER_GAP_MM: f64 = 1.0;

/// Distance between numbers and the label of an upright axis.
const LABEL_GAP_MM: f64 = 1.5;

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
    pub(crate) frame: Frame,
    pub(crate) x: Scale,
    pub(crate) y: Scale,
}

/// What is written along the axes; an empty label leaves the numbers out as well.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Labels<'a> {
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
}

/// Room beside a frame of the given height for the numbers and the label of its axis.
pub(crate) fn side_margin_mm(drawing: &Drawing, scale: &Scale, height_mm: f64) -> f64 {
    let numbers = widest(drawing, &scale.ticks(n_ticks_up(height_mm)));
    numbers + NUMBER_GAP_MM + LABEL_GAP_MM + LABEL_MM + 1.0
}

fn widest(drawing: &Drawing, ticks: &[Tick]) -> f64 {
    ticks.iter().map(|tick| drawing.number_width(&tick.label)).fold(0.0, f64::max)
}

fn n_ticks_up(height_mm: f64) -> usize {
    (height_mm / 8.0).floor().max(2.0) as usize
}

impl Plot {
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
    pub(crate) fn series(&self, drawing: &mut Drawing, points: &[Point], look: Look) {
        match look {
            Look::Markers(marker) => self.markers(drawing, points, marker),
            Look::Line(stroke) => {
                let line: Vec<_> = points.iter().map(|point| (point.x.value, point.y.value)).collect();
                self.line(drawing, &line, stroke);
            }
        }
    }

    fn markers(&self, drawing: &mut Drawing, points: &[Point], marker: Marker) {
        points.iter().for_each(|point| self.error_bars(drawing, point, marker.colour));
        for point in points {
            match self.spot(point.x.value, point.y.value) {
                Some(spot) if self.frame.holds(spot) => draw_marker(drawing, spot, marker),
                _ => {}
            }
        }
    }

    fn error_bars(&self, drawing: &mut Drawing, &Point { x, y }: &Point, colour: Rgb) {
        if y.sigma > 0.0 {
            let ends = (self.spot(x.value, y.value - y.sigma), self.spot(x.value, y.value + y.sigma));
            self.bar(drawing, ends, (0.55, 0.0), colour);
        }
        if x.sigma > 0.0 {
            let ends = (self.spot(x.value - x.sigma, y.value), self.spot(x.value + x.sigma, y.value));
            self.bar(drawing, ends, (0.0, 0.55), colour);
        }
    }

    /// An error bar with a cap of half width `cap` at each end that lies inside the frame; none where the marker hides it.
    fn bar(&self, drawing: &mut Drawing, ends: (Option<Spot>, Option<Spot>), cap: Spot, colour: Rgb) {
        let stroke = Stroke::new(0.6, colour, Dash::Solid);
        let (Some(from), Some(to)) = ends else { return };
        if (to.0 - from.0).hypot(to.1 - from.1) < 2.2 * MARKER_MM {
            return;
        }
        if let Some((from, to)) = self.frame.clip_segment(from, to) {
            drawing.segment(from, to, stroke);
        }
        for (x, y) in [from, to].into_iter().filter(|&end| self.frame.holds(end)) {
            drawing.segment((x - cap.0, y - cap.1), (x + cap.0, y + cap.1), stroke);
        }
    }

    /// Fills the frame's height between two abscissas.
    pub(crate) fn shade(&self, drawing: &mut Drawing, (from, to): (f64, f64), fill: Rgb) {
        let across = |x: f64| self.x.share(x).map(|share| share.clamp(0.0, 1.0));
        let (Some(from), Some(to)) = (across(from), across(to)) else { return };
        let at = |share: f64| self.frame.left + share * self.frame.width();
        let (left, right) = (at(from.min(to)), at(from.max(to)));
        if right > left {
            drawing.fill(Frame { left, right, ..self.frame }, fill);
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
        self.x_axis(drawing, label, TickLengths { beside: TICK_MM, top: TICK_MM, right: 0.0 });
        for (i, name) in names.iter().enumerate() {
            let Some(share) = self.y.share(-(i as f64)) else { continue };
            let at = (self.frame.left - NUMBER_GAP_MM, self.frame.bottom - share * self.frame.height());
            drawing.text(name, at, NUMBER_MM, Anchor::End);
        }
        drawing.outline(self.frame, Stroke::axis());
    }

    fn draw_axes(&self, drawing: &mut Drawing, labels: Labels, lengths: TickLengths) {
        if self.is_empty() {
            drawing.text("no data", self.frame.centre(), LABEL_MM, Anchor::Middle);
        }
        self.x_axis(drawing, labels.x, lengths);
        self.y_axis(drawing, labels.y, lengths);
        drawing.outline(self.frame, Stroke::axis());
    }

    fn x_axis(&self, drawing: &mut Drawing, label: &str, lengths: TickLengths) {
        let frame = self.frame;
        let numbers_y = frame.bottom + lengths.outward() + NUMBER_GAP_MM + 0.36 * NUMBER_MM;
        for tick in self.x_ticks(drawing) {
            let Some(share) = self.x.share(tick.value) else { continue };
            let x = frame.left + share * frame.width();
            drawing.tick((x, frame.bottom), (0.0, -lengths.beside));
            drawing.tick((x, frame.top), (0.0, lengths.top));
            if !label.is_empty() {
                drawing.number(&tick.label, (x, numbers_y), Anchor::Middle);
            }
        }
        let label_y = numbers_y + 0.36 * NUMBER_MM + 1.2 + 0.36 * LABEL_MM;
        drawing.text(label, (frame.centre().0, label_y), LABEL_MM, Anchor::Middle);
    }

    /// As many ticks as their numbers leave room for.
    fn x_ticks(&self, drawing: &Drawing) -> Vec<Tick> {
        if self.is_empty() {
            return Vec::new();
        }
        let wanted = (self.frame.width() / 9.0).floor().clamp(2.0, 8.0) as usize;
        let ticks = self.x.ticks(wanted);
        let room = self.frame.width() / (widest(drawing, &ticks) + 2.0);
        if ticks.len() as f64 <= room { ticks } else { self.x.ticks(room.floor().max(1.0) as usize) }
    }

    fn y_ticks(&self, scale: &Scale) -> Vec<Tick> {
        if self.is_empty() { Vec::new() } else { scale.ticks(n_ticks_up(self.frame.height())) }
    }

    fn y_axis(&self, drawing: &mut Drawing, label: &str, lengths: TickLengths) {
        let frame = self.frame;
        let ticks = self.y_ticks(&self.y);
        let numbers_x = frame.left - lengths.outward() - NUMBER_GAP_MM;
        for tick in &ticks {
            let Some(share) = self.y.share(tick.value) else { continue };
            let y = frame.bottom - share * frame.height();
            drawing.tick((frame.left, y), (lengths.beside, 0.0));
            drawing.tick((frame.right, y), (-lengths.right, 0.0));
            if !label.is_empty() {
                drawing.number(&tick.label, (numbers_x, y), Anchor::End);
            }
        }
        let label_x = numbers_x - widest(drawing, &ticks) - LABEL_GAP_MM - 0.5 * LABEL_MM;
        drawing.upward_text(label, (label_x, frame.centre().1), LABEL_MM);
    }

    /// Ticks, numbers and a label on the right side, for a second unit of the same ordinate.
    pub(crate) fn right_axis(&self, drawing: &mut Drawing, scale: &Scale, label: &str) {
        let frame = self.frame;
        let ticks = self.y_ticks(scale);
        for tick in &ticks {
            let Some(share) = scale.share(tick.value) else { continue };
            let y = frame.bottom - share * frame.height();
            drawing.tick((frame.right, y), (-TICK_MM, 0.0));
            drawing.number(&tick.label, (frame.right + NUMBER_GAP_MM, y), Anchor::Start);
        }
        let offset = NUMBER_GAP_MM + widest(drawing, &ticks) + LABEL_GAP_MM + 0.5 * LABEL_MM;
        drawing.upward_text(label, (frame.right + offset, frame.centre().1), LABEL_MM);
    }
}

/// A marker with a thin white rim, so that markers that touch stay apart.
pub(crate) fn draw_marker(drawing: &mut Drawing, spot: Spot, Marker { shape, colour, hollow }: Marker) {
    if shape == MarkerShape::Cross {
        let (reach, stroke) = (0.85 * MARKER_MM, Stroke::new(1.2, colour, Dash::Solid));
        drawing.segment((spot.0 - reach, spot.1 - reach), (spot.0 + reach, spot.1 + reach), stroke);
        drawing.segment((spot.0 - reach, spot.1 + reach), (spot.0 + reach, spot.1 - reach), stroke);
        return;
    }
    let inside = if hollow { WHITE } else { colour };
    for (grown, fill) in [(0.15, WHITE), (0.0, colour), (-0.27, inside)] {
        let radius = MARKER_MM + grown;
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
pub(crate) fn title(drawing: &mut Drawing, frame: Frame, text: &str) {
    let at = (frame.left, frame.top - 2.4);
    let shown = drawing.fitted(text, LABEL_MM, frame.width());
    drawing.text(&shown, at, LABEL_MM, Anchor::Start);
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
