//! Series of points: where their values come from decides whether they are markers or a line, and in which colour.

use chainwave_measurement::Estimate;
use serde::{Deserialize, Serialize};

use crate::colour::{CHAIN, EXPERIMENT, OTHERS, RINGS, Rgb};
use crate::stroke::{Dash, Stroke};

/// Where the values of a [`Series`] come from, which decides how it is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Origin {
    /// Measured: markers with error bars.
    Measured,
    /// Computed by a model at many places: a line.
    Model,
    /// Computed by a model at a few places: hollow markers.
    ModelPoints,
}

/// One point of a series; a standard uncertainty above zero is drawn as an error bar of one sigma to each side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DataPoint {
    /// Abscissa.
    pub x: Estimate,
    /// Ordinate.
    pub y: Estimate,
}

impl DataPoint {
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

    /// As [`DataPoint::y_reach`] for the abscissa.
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Name in the legend; what stands between dollar signs is mathematics, as in `$c_g$`. A name that begins with
    /// `experiment`, with `rings`, `finite elements` or `FEM`, or with `chain model`, `discrete elements` or `DEM` has the
    /// colour that this source has in all figures.
    pub name: String,
    /// Markers or line.
    pub origin: Origin,
    /// The points, in the order in which a line joins them.
    pub points: Vec<DataPoint>,
}

impl Series {
    /// A measured series.
    pub fn measured(name: impl Into<String>, points: Vec<DataPoint>) -> Self {
        Self { name: name.into(), origin: Origin::Measured, points }
    }

    /// A computed series, through exact points (x, y).
    pub fn model(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = points.into_iter().map(|(x, y)| DataPoint::exact(x, y)).collect();
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
pub(crate) struct PlotMarker {
    pub(crate) shape: MarkerShape,
    pub(crate) colour: Rgb,
    pub(crate) hollow: bool,
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Look {
    Markers(PlotMarker),
    Line(Stroke),
}

/// The source that is measured, by its place.
pub(crate) const MEASURED: usize = 0;

/// The source that a name begins with: its place among colours and dashes.
pub(crate) fn source(name: &str) -> Option<usize> {
    let name = name.to_lowercase();
    let sources: [&[&str]; 3] = [
        &["experiment", "measured"],
        &["rings", "finite elements", "fem"],
        &["chain model", "discrete elements", "dem"],
    ];
    sources.iter().position(|begins| begins.iter().any(|begin| name.starts_with(begin)))
}

/// Colour and dashes of the three sources, and of others in turn.
fn ink(source: Option<usize>, n_before: usize) -> (Rgb, Dash) {
    const SOURCES: [(Rgb, Dash); 3] =
        [(EXPERIMENT, Dash::Solid), (RINGS, Dash::Dashed), (CHAIN, Dash::Solid)];
    const DASHES: [Dash; 4] = [Dash::Solid, Dash::Dashed, Dash::Chain, Dash::Dotted];
    match source {
        // A second series of one source keeps its colour and differs by its dashes.
        Some(source) => {
            (SOURCES[source].0, if n_before == 0 { SOURCES[source].1 } else { DASHES[n_before % 4] })
        }
        None => (OTHERS[n_before % OTHERS.len()], DASHES[n_before % DASHES.len()]),
    }
}

/// The look of each series: colours by the source that its name tells, shapes and dashes by what was drawn before it.
pub(crate) fn looks<'a>(series: impl IntoIterator<Item = &'a Series>) -> Vec<Look> {
    const FILLED: [MarkerShape; 4] =
        [MarkerShape::Circle, MarkerShape::Diamond, MarkerShape::Square, MarkerShape::Triangle];
    const HOLLOW: [MarkerShape; 4] =
        [MarkerShape::Square, MarkerShape::Triangle, MarkerShape::Diamond, MarkerShape::Circle];
    let mut seen: Vec<(Origin, Option<usize>)> = Vec::new();
    let look = |series: &Series| {
        let mut source = source(&series.name);
        // What is measured and says nothing else is the experiment's first series.
        let is_first = seen.iter().all(|(origin, _)| *origin != Origin::Measured);
        if series.origin == Origin::Measured && is_first {
            source = source.or(Some(MEASURED));
        }
        let n_alike = seen.iter().filter(|one| **one == (series.origin, source)).count();
        let n_of_origin = seen.iter().filter(|(origin, _)| *origin == series.origin).count();
        seen.push((series.origin, source));
        let (colour, dash) = ink(source, n_alike);
        let shape = |shapes: [MarkerShape; 4]| shapes[n_of_origin % shapes.len()];
        match series.origin {
            Origin::Measured => Look::Markers(PlotMarker { shape: shape(FILLED), colour, hollow: false }),
            Origin::ModelPoints => Look::Markers(PlotMarker { shape: shape(HOLLOW), colour, hollow: true }),
            Origin::Model => Look::Line(Stroke::new(1.2, colour, dash)),
        }
    };
    series.into_iter().map(look).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colours(series: &[Series]) -> Vec<Rgb> {
        let colour = |look| match look {
            Look::Line(stroke) => stroke.colour,
            Look::Markers(marker) => marker.colour,
        };
        looks(series).into_iter().map(colour).collect()
    }

    #[test]
    fn a_model_has_one_colour_wherever_it_stands() {
        let rings = || Series::model("rings, N = 300", []);
        let chain = || Series::model_points("chain model", []);
        let experiment = || Series::measured("experiment", vec![]);
        assert_eq!(colours(&[rings(), chain(), experiment()]), [RINGS, CHAIN, EXPERIMENT]);
        assert_eq!(colours(&[chain(), experiment(), rings()]), [CHAIN, EXPERIMENT, RINGS]);
        assert_eq!(colours(&[Series::model("FEM", [])]), [RINGS]);
    }

    #[test]
    fn series_of_one_colour_differ_by_dashes_or_shape() {
        let series = [Series::model("chain model", []), Series::model("chain model, undamped", [])];
        let both = looks(&series);
        assert_ne!(both[0], both[1]);
        let others = [Series::model("a", []), Series::model("b", [])];
        assert_ne!(colours(&others)[0], colours(&others)[1]);
        let measured = [Series::measured("experiment", vec![]), Series::measured("experiment, slow", vec![])];
        assert_ne!(looks(&measured)[0], looks(&measured)[1]);
    }
}
