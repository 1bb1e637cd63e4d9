//! Group velocity against the striker's or the particles' velocity, with an enlarged inset (the paper's Fig. 3 c).

use serde::{Deserialize, Serialize};

use crate::colour::GRAY;
use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, Look, Origin, Series, looks};
use crate::stroke::{Dash, Stroke};
use crate::ticks::trimmed;
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 56.0;
/// The measured range is enlarged where it takes less than this share of the axis.
const SMALL: f64 = 0.45;

/// Group velocity against striker or particle velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GroupVelocities {
    /// Group velocity against the other velocity, both in metres per second: measured (with error bars both ways) or
    /// computed.
    pub series: Vec<Series>,
    /// Speed of sound of the chain in metres per second, drawn as a level.
    pub sound_speed_m_per_s: Option<f64>,
}

/// The velocity that a group velocity is shown against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Against {
    /// Velocity of the striker.
    Striker,
    /// Velocity of the bodies as the pulse's peak passes.
    Particles,
}

/// Group velocities over the velocity of the striker or of the bodies; an inset enlarges what was measured where that is a small
/// part of the whole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GroupVelocityFigure {
    /// The group velocities.
    pub velocities: GroupVelocities,
    /// What they are shown against.
    pub against: Against,
}

impl Draw for GroupVelocityFigure {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

impl Against {
    fn labels(self) -> Labels<'static> {
        let x = match self {
            Self::Striker => "striker velocity $v_s$ (m/s)",
            Self::Particles => "particle velocity (m/s)",
        };
        Labels { x, y: "group velocity $c_g$ (m/s)" }
    }

    fn short_labels(self) -> Labels<'static> {
        Labels { x: if self == Self::Striker { "$v_s$ (m/s)" } else { "$v$ (m/s)" }, y: "$c_g$ (m/s)" }
    }
}

fn layout(style: &Style, figure: &GroupVelocityFigure) -> Result<Drawing, FigureError> {
    let GroupVelocityFigure { velocities, against } = figure;
    let mut drawing = Drawing::new(style, Columns::One)?;
    let labels = against.labels();
    let (x, y) = scales(velocities);
    let (left, page) = (plot::side_margin_mm(&drawing, &y, HEIGHT_MM), drawing.width_mm);
    let looks = looks(&velocities.series);
    let entries = entries(style, velocities, &looks);
    let top = legend::draw(&mut drawing, &entries, (left, page), 1.0) + 1.5;
    let frame = PageRect::new(left, top, page - left - 1.5, HEIGHT_MM);
    let plot = Plot::new(frame, x, y);
    draw_velocities(&mut drawing, &plot, velocities, &looks);
    for series in &velocities.series {
        plot::record(&mut drawing, "", &series.name, labels, &series.points);
    }
    if let Some(enlarged) = enlarged(velocities, &x) {
        let mut lines = plot.obstacles(&velocities.series);
        let level = velocities.sound_speed_m_per_s.and_then(|speed| plot.y.share(speed));
        lines.extend(level.map(|share| {
            let height = frame.bottom - share * frame.height();
            vec![(frame.left, height), (frame.right, height)]
        }));
        let size = (0.5 * frame.width(), 0.5 * HEIGHT_MM);
        if let Some(inset) = plot.inset(&mut drawing, enlarged, size, &lines) {
            draw_velocities(&mut drawing, &inset, velocities, &looks);
            inset.axes(&mut drawing, against.short_labels());
        }
    }
    plot.axes(&mut drawing, labels);
    drawing.extend_to(frame.bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

fn draw_velocities(drawing: &mut Drawing, plot: &Plot, velocities: &GroupVelocities, looks: &[Look]) {
    if let Some(speed) = velocities.sound_speed_m_per_s {
        plot.level(drawing, speed, sound_stroke());
    }
    plot.layers(drawing, &velocities.series, looks);
}

fn scales(velocities: &GroupVelocities) -> (Scale, Scale) {
    let points = || velocities.series.iter().flat_map(|series| &series.points);
    let x = Extent::of(points().flat_map(DataPoint::x_reach));
    let y = Extent::of(points().flat_map(DataPoint::y_reach));
    let y = y.map(|extent| velocities.sound_speed_m_per_s.map_or(extent, |speed| extent.including(speed)));
    (
        Scale::linear(x.map(|extent| extent.padded_from_zero(0.03))),
        Scale::linear(y.map(|extent| extent.padded(0.08))),
    )
}

/// Axes of the inset, which holds what was measured and the markers of models there; none where that takes much of the axis.
fn enlarged(velocities: &GroupVelocities, x: &Scale) -> Option<(Scale, Scale)> {
    let measured = velocities.series.iter().filter(|series| series.origin == Origin::Measured);
    let all: Vec<&DataPoint> = measured.flat_map(|series| &series.points).collect();
    let reach = Extent::of(all.iter().flat_map(|point| point.x_reach()))?.padded(0.12);
    let whole = x.extent()?;
    if all.len() < 2 || reach.high - whole.low > SMALL * (whole.high - whole.low) {
        return None;
    }
    let inside = |point: &&DataPoint| (reach.low..=reach.high).contains(&point.x.value);
    let near = velocities.series.iter().flat_map(|series| &series.points).filter(inside);
    let y = Extent::of(near.flat_map(DataPoint::y_reach))?.padded(0.12);
    Some((Scale::linear(Some(reach)), Scale::linear(Some(y))))
}

fn sound_stroke() -> Stroke {
    Stroke::new(0.8, GRAY, Dash::Dotted)
}

fn entries(style: &Style, velocities: &GroupVelocities, looks: &[Look]) -> Vec<LegendEntry> {
    let named =
        velocities.series.iter().zip(looks).map(|(series, look)| LegendEntry::new(&series.name, *look));
    let sound = velocities.sound_speed_m_per_s.map(|speed| {
        let name = format!("speed of sound, {} m/s", style.decimals(&trimmed(speed, 1)));
        LegendEntry::new(name, LegendKey::Line(sound_stroke()))
    });
    named.chain(sound).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Estimate;

    fn drawn(velocities: &GroupVelocities) -> Drawing {
        let figure = GroupVelocityFigure { velocities: velocities.clone(), against: Against::Striker };
        layout(&Style::default(), &figure).unwrap()
    }

    fn velocities(fastest: i32) -> GroupVelocities {
        let point = |v: f64| DataPoint { x: Estimate::new(v, 0.05), y: Estimate::new(54.0 - v, 0.1) };
        let model = (1..=fastest).map(|i| 0.5 * f64::from(i)).map(|v| (v, 54.0 - v));
        GroupVelocities {
            series: vec![
                Series::measured("experiment", vec![point(0.83), point(1.89), point(2.73)]),
                Series::model_points("finite elements", [(0.83, 53.0), (1.89, 52.0), (2.73, 51.0)]),
                Series::model("discrete elements", model),
            ],
            sound_speed_m_per_s: Some(54.0),
        }
    }

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        let drawing = drawn(&velocities(6));
        drawing.assert_readable();
        for label in ["striker velocity v_s (m/s)", "group velocity c_g (m/s)", "speed of sound, 54 m/s"] {
            assert!(drawing.says(label), "{label}");
        }
    }

    #[test]
    fn what_was_measured_is_enlarged_where_it_is_small() {
        let n_frames = |drawing: &Drawing| {
            let frames = drawing.inks.iter().filter(|ink| {
                matches!(ink, crate::drawing::Ink::Line { points, stroke } if *stroke == Stroke::axis() && points.len() == 6)
            });
            frames.count()
        };
        assert_eq!(n_frames(&drawn(&velocities(6))), 1);
        let enlarged = drawn(&velocities(24));
        enlarged.assert_readable();
        assert_eq!(n_frames(&enlarged), 2);
    }

    #[test]
    fn a_name_too_long_for_the_page_goes_on_in_further_lines() {
        let long = Series::model("a name that goes on and on ".repeat(9), [(1.0, 50.0), (2.0, 49.0)]);
        let drawing = drawn(&GroupVelocities { series: vec![long], sound_speed_m_per_s: None });
        drawing.assert_readable();
        let named = drawing.labels().iter().filter(|label| label.contains("goes on")).count();
        assert!(named > 1 && !drawing.labels().iter().any(|label| label.contains('…')));
    }

    #[test]
    fn one_point_or_none_is_drawn_honestly() {
        let one = Series::measured("experiment", vec![DataPoint::exact(2.73, 52.0)]);
        let lost = Series::measured("experiment", vec![DataPoint::exact(f64::NAN, 52.0)]);
        for (series, says_no_data) in [(vec![one], false), (vec![lost], true), (vec![], true)] {
            let drawing = drawn(&GroupVelocities { series, sound_speed_m_per_s: None });
            assert_eq!(drawing.says("no data"), says_no_data);
        }
    }
}
