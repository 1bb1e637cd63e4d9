use chainwave_measurement::Estimate;

use crate::colour::{BLACK, BLUE, GREEN, ORANGE, PURPLE, Rgb, SKY_BLUE, VERMILLION};
use crate::drawing::{Dash, Stroke};

/// Where the values of a [`Series`] come from, which decides how it is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// Measured: markers with error bars.
    Measured,
    /// Computed by a model at many places: a line.
    Model,
    /// Computed by a model at a few places: hollow markers.
    ModelPoints,
}

/// One point of a series; a standard uncertainty above zero is drawn as an error bar of one sigma to each side (where
/// the marker does not hide it).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Abscissa.
    pub x: Estimate,
    /// Ordinate.
    pub y: Estimate,
}

impl Point {
    /// A point without error bars.
    pub fn exact(x: f64, y: f64) -> Self {
        Self { x: Estimate::new(x, 0.0), y: Estimate::new(y, 0.0) }
    }

    /// A point whose ordinate is uncertain.
    pub fn measured(x: f64, y: Estimate) -> Self {
        Self { x: Estimate::new(x, 0.0), y }
    }

    /// The ordinate and the ends of its error bar, for the range of an axis; none where it has no place on one.
    pub(crate) fn y_reach(&self) -> [f64; 3] {
        reach(self.y)
    }

    /// As [`Point::y_reach`] for the abscissa.
    pub(crate) fn x_reach(&self) -> [f64; 3] {
        reach(self.x)
    }

    /// The point in other units: the abscissa and the ordinate times a factor each.
    pub(crate) fn scaled(self, x_factor: f64, y_factor: f64) -> Self {
        Self { x: self.x.scaled(x_factor), y: self.y.scaled(y_factor) }
    }
}

fn reach(Estimate { value, sigma }: Estimate) -> [f64; 3] {
    let sigma = if sigma > 0.0 { sigma } else { 0.0 };
    [value - sigma, value, value + sigma]
}

/// Points that belong together under one name of the legend.
///
/// A point with a coordinate that is not finite is left out, and a line breaks there.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Markers or line.
    pub origin: Origin,
    /// The points, in the order in which a line joins them.
    pub points: Vec<Point>,
}

impl Series {
    /// A measured series.
    pub fn measured(name: impl Into<String>, points: Vec<Point>) -> Self {
        Self { name: name.into(), origin: Origin::Measured, points }
    }

    /// A computed series, through exact points (x, y).
    pub fn model(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = points.into_iter().map(|(x, y)| Point::exact(x, y)).collect();
        Self { name: name.into(), origin: Origin::Model, points }
    }

    /// A series computed at a few places.
    pub fn model_points(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { origin: Origin::ModelPoints, ..Self::model(name, points) }
    }

    pub(crate) fn scaled(&self, x_factor: f64, y_factor: f64) -> Self {
        let points = self.points.iter().map(|point| point.scaled(x_factor, y_factor)).collect();
        Self { points, ..self.clone() }
    }
}

/// The outline of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MarkerShape {
    Circle,
    Diamond,
    Square,
    Triangle,
    Cross,
}

/// Shape and colour of a measured point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Marker {
    pub(crate) shape: MarkerShape,
    pub(crate) colour: Rgb,
    pub(crate) hollow: bool,
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Look {
    Markers(Marker),
    Line(Stroke),
}

const FILLED_MARKERS: [Marker; 4] = [
    Marker { shape: MarkerShape::Circle, colour: BLUE, hollow: false },
    Marker { shape: MarkerShape::Diamond, colour: BLACK, hollow: false },
    Marker { shape: MarkerShape::Square, colour: PURPLE, hollow: false },
    Marker { shape: MarkerShape::Triangle, colour: GREEN, hollow: false },
];

const HOLLOW_MARKERS: [Marker; 3] = [
    Marker { shape: MarkerShape::Square, colour: VERMILLION, hollow: true },
    Marker { shape: MarkerShape::Triangle, colour: BLACK, hollow: true },
    Marker { shape: MarkerShape::Diamond, colour: GREEN, hollow: true },
];

const LINES: [(Rgb, Dash); 5] = [
    (VERMILLION, Dash::Solid),
    (BLACK, Dash::Dashed),
    (GREEN, Dash::Chain),
    (SKY_BLUE, Dash::Solid),
    (ORANGE, Dash::Dashed),
];

/// The look of each series: the k-th of an origin takes the k-th marker or line of that origin.
pub(crate) fn looks(origins: impl IntoIterator<Item = Origin>) -> Vec<Look> {
    let (mut n_measured, mut n_models, mut n_points) = (0, 0, 0);
    let look = |origin| match origin {
        Origin::Measured => {
            n_measured += 1;
            Look::Markers(FILLED_MARKERS[(n_measured - 1) % FILLED_MARKERS.len()])
        }
        Origin::ModelPoints => {
            n_points += 1;
            Look::Markers(HOLLOW_MARKERS[(n_points - 1) % HOLLOW_MARKERS.len()])
        }
        Origin::Model => {
            n_models += 1;
            let (colour, dash) = LINES[(n_models - 1) % LINES.len()];
            Look::Line(Stroke::new(1.1, colour, dash))
        }
    };
    origins.into_iter().map(look).collect()
}
