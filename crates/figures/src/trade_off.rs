//! Error against time of several methods, with those that no other one beats.

use serde::{Deserialize, Serialize};

use crate::colour::{EXPERIMENT, GRAY};
use crate::drawing::{Anchor, Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::legend::{self, LegendEntry, LegendKey};
use crate::names::printed;
use crate::plot::{self, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, Look, MarkerShape, PlotMarker};
use crate::stroke::{Dash, Stroke};
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 56.0;
/// Height of a row of names, in em.
const ROW_EM: f64 = 1.45;
/// Distance of a number from its marker.
const OFFSET_MM: f64 = 1.9;
const ON_FRONT: PlotMarker = PlotMarker { shape: MarkerShape::Circle, colour: EXPERIMENT, hollow: false };
const OFF_FRONT: PlotMarker = PlotMarker { shape: MarkerShape::Square, colour: GRAY, hollow: true };

/// What one method costs and how far it is off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TradeOffPoint {
    /// Method and settings.
    pub name: String,
    /// Time for one item, in seconds.
    pub seconds_per_item: f64,
    /// Error in the unit of the figure's ordinate.
    pub error: f64,
    /// Whether no other method is both faster and more accurate.
    pub on_front: bool,
}

/// The methods of one step of the work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TradeOff {
    /// Label of the abscissa, such as `seconds per position`.
    pub time_label: String,
    /// Label of the ordinate, such as `error (px)`.
    pub error_label: String,
    /// The methods.
    pub points: Vec<TradeOffPoint>,
}

impl Draw for TradeOff {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, trade_off: &TradeOff) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::One)?;
    let (page, em) = (drawing.width_mm, drawing.number_mm());
    let is_drawable = |point: &&TradeOffPoint| point.seconds_per_item > 0.0 && point.error > 0.0;
    let points: Vec<&TradeOffPoint> = trade_off.points.iter().filter(is_drawable).collect();
    let mut front: Vec<&TradeOffPoint> = points.iter().copied().filter(|point| point.on_front).collect();
    front.sort_by(|a, b| a.seconds_per_item.total_cmp(&b.seconds_per_item));
    let x = Scale::log(Extent::of(points.iter().map(|point| point.seconds_per_item)).map(widened));
    let y = Scale::log(Extent::of(points.iter().map(|point| point.error)).map(widened));
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let entries = [
        LegendEntry::new("no method is faster and better", LegendKey::Marker(ON_FRONT)),
        LegendEntry::new("others", LegendKey::Marker(OFF_FRONT)),
    ];
    let top = legend::draw(&mut drawing, &entries, (left, page), 1.0) + 1.5;
    let frame = PageRect::new(left, top, page - left - 3.0, HEIGHT_MM);
    let plot = Plot::new(frame, x, y);
    let at = |point: &&TradeOffPoint| DataPoint::exact(point.seconds_per_item, point.error);
    let line: Vec<DataPoint> = front.iter().map(at).collect();
    plot.series(&mut drawing, &line, Look::Line(Stroke::new(0.8, EXPERIMENT, Dash::Dotted)));
    let others: Vec<DataPoint> = points.iter().filter(|point| !point.on_front).map(at).collect();
    plot.series(&mut drawing, &others, Look::Markers(OFF_FRONT));
    plot.series(&mut drawing, &line, Look::Markers(ON_FRONT));
    let spots: Vec<Option<(f64, f64)>> =
        front.iter().map(|point| plot.spot(point.seconds_per_item, point.error)).collect();
    for (i, place) in places_of_numbers(&spots, em).into_iter().enumerate() {
        if let Some(place) = place {
            drawing.text(&(i + 1).to_string(), place, em, Anchor::Middle);
        }
    }
    let labels = Labels { x: &trade_off.time_label, y: &trade_off.error_label };
    plot.axes(&mut drawing, labels);
    for point in &points {
        plot::record(&mut drawing, "", &point.name, labels, &[at(point)]);
    }
    let mut bottom = frame.bottom + plot::bottom_margin_mm(&drawing);
    for (i, point) in front.iter().enumerate() {
        let name = drawing.fitted(&format!("{}  {}", i + 1, printed(&point.name)), em, frame.width());
        drawing.text(&name, (left, bottom + 0.5 * ROW_EM * em), em, Anchor::Start);
        bottom += ROW_EM * em;
    }
    drawing.extend_to(bottom + 1.0);
    Ok(drawing)
}

/// Where the number of each marker stands: beside it, away from the numbers before.
fn places_of_numbers(spots: &[Option<(f64, f64)>], em: f64) -> Vec<Option<(f64, f64)>> {
    const SIDES: [(f64, f64); 4] = [(-0.6, 1.0), (0.8, -0.6), (0.8, 1.0), (-0.8, -0.6)];
    let mut taken: Vec<(f64, f64)> = Vec::with_capacity(spots.len());
    let mut place = |&(x, y): &(f64, f64)| {
        let beside = SIDES.map(|(right, down)| (x + right * OFFSET_MM, y + down * OFFSET_MM));
        let is_free = |one: &&(f64, f64)| {
            taken.iter().all(|other| (one.0 - other.0).abs() > em || (one.1 - other.1).abs() > em)
        };
        let place = *beside.iter().find(is_free).unwrap_or(&beside[0]);
        taken.push(place);
        place
    };
    spots.iter().map(|spot| spot.as_ref().map(&mut place)).collect()
}

/// Whole decades around a range, with room for markers and their numbers at both ends.
fn widened(extent: Extent) -> Extent {
    const ROOM: f64 = 1.5;
    let decade = |value: f64, rounded: fn(f64) -> f64| 10.0_f64.powf(rounded(value.log10()));
    Extent { low: decade(extent.low / ROOM, f64::floor), high: decade(extent.high * ROOM, f64::ceil) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_markers_side_by_side_stand_apart() {
        let places = places_of_numbers(&[Some((10.0, 10.0)), None, Some((10.5, 10.1))], 2.0);
        let [first, none, second] = [places[0], places[1], places[2]];
        assert!(none.is_none());
        let apart =
            first.zip(second).map(|(one, other)| (one.0 - other.0).abs().max((one.1 - other.1).abs()));
        assert!(apart.is_some_and(|apart| apart > 2.0), "{places:?}");
    }

    #[test]
    fn methods_on_the_front_are_numbered_and_named() {
        let point = |name: &str, seconds_per_item: f64, error: f64, on_front: bool| TradeOffPoint {
            name: name.into(),
            seconds_per_item,
            error,
            on_front,
        };
        let points = vec![
            point("slow and good", 3e-5, 1e-4, true),
            point("fast", 2e-6, 2e-2, true),
            point("neither", 4e-5, 3e-2, false),
            point("lost everything", 1e-5, f64::NAN, false),
        ];
        let figure =
            TradeOff { time_label: "seconds per position".into(), error_label: "error (px)".into(), points };
        let drawing = layout(&Style::default(), &figure).unwrap();
        drawing.assert_readable();
        assert!(drawing.says("1  fast") && drawing.says("2  slow and good"), "{:?}", drawing.labels());
    }
}
