use std::path::Path;

use crate::colour::GRAY;
use crate::drawing::{Dash, Drawing, Stroke};
use crate::geometry::Frame;
use crate::legend::{self, Entry, Key};
use crate::plot::{self, BOTTOM_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{Look, Series, looks};
use crate::ticks::trimmed;
use crate::{FigureError, output};

const HEIGHT_MM: f64 = 52.0;

/// Group velocity against striker or particle velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupVelocities {
    /// Group velocity against the other velocity, both in metres per second: measured (with error bars both ways) or
    /// computed.
    pub series: Vec<Series>,
    /// Speed of sound of the chain in metres per second, drawn as a level.
    pub sound_speed_m_per_s: Option<f64>,
}

/// Draws the group velocity against the striker velocity (the paper's Fig. 3 c).
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn group_velocity(stem: &Path, velocities: &GroupVelocities) -> Result<(), FigureError> {
    output::write(stem, &layout(velocities, "striker velocity (m/s)")?)
}

/// Draws the group velocity against the velocity of the bodies as the pulse's peak passes.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn group_velocity_by_particles(stem: &Path, velocities: &GroupVelocities) -> Result<(), FigureError> {
    output::write(stem, &layout(velocities, "particle velocity (m/s)")?)
}

fn layout(velocities: &GroupVelocities, against: &str) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(Drawing::ONE_COLUMN_MM)?;
    let (x, y) = scales(velocities);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let looks = looks(velocities.series.iter().map(|series| series.origin));
    let entries = entries(velocities, &looks);
    let top = legend::draw(&mut drawing, &entries, (left, Drawing::ONE_COLUMN_MM), 1.0) + 1.5;
    let frame = Frame::new(left, top, Drawing::ONE_COLUMN_MM - left - 1.5, HEIGHT_MM);
    let plot = Plot { frame, x, y };
    if let Some(speed) = velocities.sound_speed_m_per_s {
        plot.level(&mut drawing, speed, sound_stroke());
    }
    // Lines first, so that the measured points stay visible on them.
    let layers = velocities.series.iter().zip(looks);
    let (lines, markers): (Vec<_>, Vec<_>) = layers.partition(|(_, look)| matches!(look, Look::Line(_)));
    for (series, look) in lines.into_iter().chain(markers) {
        plot.series(&mut drawing, &series.points, look);
    }
    plot.axes(&mut drawing, Labels { x: against, y: "group velocity (m/s)" });
    drawing.extend_to(frame.bottom + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

fn scales(velocities: &GroupVelocities) -> (Scale, Scale) {
    let points = || velocities.series.iter().flat_map(|series| &series.points);
    let x = Extent::of(points().flat_map(|point| point.x_reach()));
    let y = Extent::of(points().flat_map(|point| point.y_reach()));
    let y = y.map(|extent| velocities.sound_speed_m_per_s.map_or(extent, |speed| extent.including(speed)));
    (
        Scale::linear(x.map(|extent| extent.padded_from_zero(0.03))),
        Scale::linear(y.map(|extent| extent.padded(0.08))),
    )
}

fn sound_stroke() -> Stroke {
    Stroke::new(0.8, GRAY, Dash::Dotted)
}

fn entries(velocities: &GroupVelocities, looks: &[Look]) -> Vec<Entry> {
    let named = velocities.series.iter().zip(looks).map(|(series, look)| Entry::new(&series.name, *look));
    let sound = velocities.sound_speed_m_per_s.map(|speed| {
        let name = format!("speed of sound, {} m/s", trimmed(speed, 1));
        Entry::new(name, Key::Line(sound_stroke()))
    });
    named.chain(sound).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;
    use chainwave_measurement::Estimate;

    const AGAINST: &str = "striker velocity (m/s)";

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        let point = |v: f64| Point { x: Estimate::new(v, 0.05), y: Estimate::new(54.0 - v, 0.1) };
        let velocities = GroupVelocities {
            series: vec![
                Series::measured("experiment", vec![point(0.83), point(1.89), point(2.73)]),
                Series::model("discrete elements", (1..20).map(|i| (f64::from(i), 54.0 - f64::from(i)))),
            ],
            sound_speed_m_per_s: Some(54.0),
        };
        let drawing = layout(&velocities, AGAINST).unwrap();
        drawing.assert_readable();
        let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
        for label in [AGAINST, "group velocity (m/s)", "speed of sound, 54 m/s"] {
            assert!(texts.iter().any(|text| text == label), "{label}");
        }
    }

    #[test]
    fn a_name_too_long_for_the_page_is_cut() {
        let long = Series::model("a name that goes on and on ".repeat(9), [(1.0, 50.0), (2.0, 49.0)]);
        let drawing =
            layout(&GroupVelocities { series: vec![long], sound_speed_m_per_s: None }, AGAINST).unwrap();
        drawing.assert_readable();
        assert!(drawing.text_frames().iter().any(|(text, _)| text.ends_with('…')));
    }

    #[test]
    fn one_point_or_none_is_drawn_honestly() {
        let one = Series::measured("experiment", vec![Point::exact(2.73, 52.0)]);
        let lost = Series::measured("experiment", vec![Point::exact(f64::NAN, 52.0)]);
        for (series, says_no_data) in [(vec![one], false), (vec![lost], true), (vec![], true)] {
            let drawing = layout(&GroupVelocities { series, sound_speed_m_per_s: None }, AGAINST).unwrap();
            let found = drawing.text_frames().iter().any(|(text, _)| text == "no data");
            assert_eq!(found, says_no_data);
        }
    }
}
