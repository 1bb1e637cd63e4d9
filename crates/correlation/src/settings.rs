//! How a subset is matched: shape function, interpolation, limits, reference frames.

use std::fmt;
use std::num::NonZero;
use std::ops::Range;
use std::str::FromStr;

use crate::CorrelationError;

/// How a subset is matched.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// How a subset may deform.
    pub shape: Shape,
    /// How the target is interpolated between pixels.
    pub interpolation: Interpolation,
    /// The iteration ends when a step moves no point of the subset's edge by more than this, in pixels.
    pub convergence_px: f64,
    /// Gauss-Newton steps after which a match counts as not converged.
    pub max_iterations: u32,
    /// What counts as a match.
    pub acceptance: Acceptance,
    /// Share of its first correlation below which a subset has changed so much that it is prepared anew from the frame where
    /// that is seen: once three frames in a row lie below, all of it is matched, and all its parts have changed little by little, as no obstacle
    /// or shadow makes them. From then on the uncertainty of its place there is part of every sigma, until it is found as it was at first.
    pub renewal_share: f64,
    /// Whether points are followed on surfaces that may bend within a subset: then what the affine shape function leaves is taken off tracks
    /// as far as it is known, and stated. Bodies that turn and stretch as a whole need it not.
    pub surfaces_bend: bool,
    /// Columns and rows on each side of the expected place that a search covers first; a body may move this far between two frames
    /// without being predicted, so a pattern that repeats within it is ambiguous.
    pub search_radius_px: usize,
    /// Threads that the subsets of a recording are shared among; the result does not depend on it.
    pub n_threads: NonZero<usize>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            shape: Shape::Affine,
            interpolation: Interpolation::Cubic,
            convergence_px: 1e-3,
            max_iterations: 30,
            acceptance: Acceptance::ByEvidence,
            renewal_share: 0.85,
            surfaces_bend: false,
            search_radius_px: 24,
            n_threads: NonZero::<usize>::MIN,
        }
    }
}

impl Settings {
    /// Refuses settings that have no meaning.
    pub(crate) fn check(&self) -> Result<(), CorrelationError> {
        let positive = self.convergence_px > 0.0 && self.convergence_px.is_finite();
        if !positive {
            let (name, expected, found) =
                ("convergence_px", "a positive number of pixels", self.convergence_px);
            return Err(CorrelationError::Setting { name, expected, found });
        }
        if !(-1.0..=1.0).contains(&self.acceptance.least_zncc()) {
            let (name, expected, found) =
                ("acceptance", "a correlation between -1 and 1", self.acceptance.least_zncc());
            return Err(CorrelationError::Setting { name, expected, found });
        }
        if !(0.0..1.0).contains(&self.renewal_share) {
            let (name, expected, found) =
                ("renewal_share", "a share from 0 to less than 1", self.renewal_share);
            return Err(CorrelationError::Setting { name, expected, found });
        }
        if self.max_iterations == 0 {
            return Err(CorrelationError::Setting {
                name: "max_iterations",
                expected: "at least 1",
                found: 0.0,
            });
        }
        Ok(())
    }
}

/// What counts as a match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Acceptance {
    /// What resembles the reference by more than chance gives on this texture, and than the texture repeats itself where the body may be;
    /// in a field what its neighbours support so.
    ByEvidence,
    /// A zero-normalised cross-correlation with the reference of at least so much, whatever else may resemble it as well.
    Zncc(f64),
}

impl Acceptance {
    /// Correlation below which no evidence makes a match believed.
    const LEAST_ZNCC: f64 = 0.4;

    /// Least correlation that an iteration may end with.
    pub(crate) fn least_zncc(self) -> f64 {
        match self {
            Self::ByEvidence => Self::LEAST_ZNCC,
            Self::Zncc(least) => least,
        }
    }
}

/// The shape function: how the displacement varies over a subset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Shape {
    /// The same displacement everywhere: 2 parameters.
    Translation,
    /// Translation and rotation: 3 parameters.
    Rigid,
    /// A displacement that varies linearly, with rotation, strain and shear: 6 parameters.
    Affine,
    /// A displacement that varies as a polynomial of second order: 12 parameters.
    Quadratic,
}

impl Shape {
    /// Every shape function, the simplest first.
    pub const ALL: [Self; 4] = [Self::Translation, Self::Rigid, Self::Affine, Self::Quadratic];

    /// Terms of the displacement's polynomial in one direction: 1, or 1, x, y, or these and x^2, xy, y^2.
    pub(crate) fn n_terms(self) -> usize {
        match self {
            Self::Translation => 1,
            Self::Rigid | Self::Affine => 3,
            Self::Quadratic => 6,
        }
    }

    /// Those that tell what this one leaves, the best first: where the texture is too weak for it the next one.
    pub(crate) fn richer(self) -> &'static [Self] {
        match self {
            Self::Translation => &[Self::Affine, Self::Rigid],
            Self::Rigid => &[Self::Affine],
            Self::Affine => &[Self::Quadratic],
            Self::Quadratic => &[],
        }
    }

    /// Numbers that a match fits.
    pub(crate) fn n_parameters(self) -> usize {
        match self {
            Self::Rigid => 3,
            other => 2 * other.n_terms(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rigid => "rigid",
            Self::Affine => "affine",
            Self::Quadratic => "quadratic",
        }
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Shape {
    type Err = CorrelationError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        by_name("shape function", &Self::ALL, name)
    }
}

/// How the shape function of a subset is settled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShapeChoice {
    /// By name.
    Named(Shape),
    /// As the simplest that the matches cannot reject ([`crate::ShapeEvidence`]).
    ByEvidence,
}

impl ShapeChoice {
    /// Every choice, the named ones first.
    pub const ALL: [Self; 5] = [
        Self::Named(Shape::Translation),
        Self::Named(Shape::Rigid),
        Self::Named(Shape::Affine),
        Self::Named(Shape::Quadratic),
        Self::ByEvidence,
    ];
}

impl fmt::Display for ShapeChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(shape) => shape.fmt(f),
            Self::ByEvidence => f.pad("auto"),
        }
    }
}

impl FromStr for ShapeChoice {
    type Err = CorrelationError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        by_name("shape function", &Self::ALL, name)
    }
}

/// How an image is interpolated between its pixels: by a spline that passes through every pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// Degree 1: bilinear. Fast, and biased by tens of millipixels.
    Linear,
    /// Degree 3: bicubic B-spline.
    Cubic,
    /// Degree 3: the kernel of a bicubic spline whose bias of a displacement is least, a seventh of the B-spline's at
    /// the same cost.
    CubicMoms,
    /// Degree 5: biquintic B-spline.
    Quintic,
    /// Degree 5: the kernel of a biquintic spline whose bias is least, that of a B-spline of degree 7.
    QuinticMoms,
}

impl Interpolation {
    /// Every interpolation, the cheapest first.
    pub const ALL: [Self; 5] = [Self::Linear, Self::Cubic, Self::CubicMoms, Self::Quintic, Self::QuinticMoms];

    fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Cubic => "cubic",
            Self::CubicMoms => "cubic-moms",
            Self::Quintic => "quintic",
            Self::QuinticMoms => "quintic-moms",
        }
    }
}

impl fmt::Display for Interpolation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Interpolation {
    type Err = CorrelationError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        by_name("interpolation", &Self::ALL, name)
    }
}

/// The frames that say what a subset looks like, while the bodies are at rest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ReferenceFrames {
    /// One frame.
    Single(usize),
    /// The mean over a range of frames, which has less noise.
    Mean(Range<usize>),
}

impl ReferenceFrames {
    /// The frames as a range.
    pub fn range(&self) -> Range<usize> {
        match self {
            Self::Single(frame) => *frame..frame.saturating_add(1),
            Self::Mean(frames) => frames.clone(),
        }
    }
}

/// The one of `all` that is displayed as `name`.
pub(crate) fn by_name<T: fmt::Display + Copy>(
    what: &'static str,
    all: &[T],
    name: &str,
) -> Result<T, CorrelationError> {
    all.iter().copied().find(|item| item.to_string() == name).ok_or_else(|| {
        let known: Vec<String> = all.iter().map(T::to_string).collect();
        CorrelationError::UnknownName { what, expected: known.join(", "), found: name.to_owned() }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_their_values() {
        for shape in Shape::ALL {
            assert_eq!(shape.to_string().parse::<Shape>().unwrap(), shape);
        }
        for choice in ShapeChoice::ALL {
            assert_eq!(choice.to_string().parse::<ShapeChoice>().unwrap(), choice);
        }
        for interpolation in Interpolation::ALL {
            assert_eq!(interpolation.to_string().parse::<Interpolation>().unwrap(), interpolation);
        }
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_known_ones() {
        let message = "bilinear".parse::<Interpolation>().unwrap_err().to_string();
        assert_eq!(
            message,
            "interpolation: expected one of linear, cubic, cubic-moms, quintic, quintic-moms, found \"bilinear\""
        );
    }

    #[test]
    fn settings_without_meaning_are_refused() {
        assert!(Settings::default().check().is_ok());
        assert!(Settings { convergence_px: f64::NAN, ..Settings::default() }.check().is_err());
        assert!(Settings { acceptance: Acceptance::Zncc(1.5), ..Settings::default() }.check().is_err());
        assert!(Settings { renewal_share: 1.0, ..Settings::default() }.check().is_err());
        assert!(Settings { max_iterations: 0, ..Settings::default() }.check().is_err());
    }
}
