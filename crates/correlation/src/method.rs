//! The ladder of methods, by name.

use std::fmt;
use std::str::FromStr;

use chainwave_measurement::{Recording, Subset, Track};

use crate::foreign;
use crate::refine::enhanced::EnhancedCorrelation;
use crate::refine::lucas_kanade::track_lucas_kanade;
use crate::refine::phase::PhaseCorrelation;
use crate::refine::template::TemplateSearch;
use crate::refine::track_by;
use crate::settings::by_name;
use crate::{
    CorrelationError, Interpolation, ReferenceFrames, Settings, Shape, ShapeChoice, track, track_by_evidence,
};

/// A rung of the ladder: a way to track, by name, from the fastest and least accurate upwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Method {
    /// OpenCV's pyramidal Lucas-Kanade on 8-bit images.
    LucasKanade,
    /// Search at whole pixels, and a parabola through the peak.
    TemplateParabola,
    /// OpenCV's maximisation of the enhanced correlation coefficient.
    EnhancedCorrelation,
    /// OpenCV's phase correlation.
    PhaseCorrelation,
    /// This crate's IC-GN.
    IcGn {
        /// The interpolation of the target.
        interpolation: Interpolation,
        /// The shape function.
        shape: ShapeChoice,
    },
}

impl Method {
    /// Every method: those without a choice of shape function first, then IC-GN by interpolation and shape function.
    pub fn all() -> Vec<Self> {
        let icgn = Interpolation::ALL.into_iter().flat_map(|interpolation| {
            ShapeChoice::ALL.into_iter().map(move |shape| Self::IcGn { interpolation, shape })
        });
        let others =
            [Self::LucasKanade, Self::EnhancedCorrelation, Self::PhaseCorrelation, Self::TemplateParabola];
        others.into_iter().chain(icgn).collect()
    }

    /// Those that the program can track by: OpenCV's where it has brought them.
    pub fn available() -> Vec<Self> {
        let mut methods = Self::all();
        methods.retain(|method| foreign::has_foreign() || !method.is_foreign());
        methods
    }

    /// Whether it is OpenCV's.
    pub fn is_foreign(self) -> bool {
        matches!(self, Self::LucasKanade | Self::EnhancedCorrelation | Self::PhaseCorrelation)
    }

    /// The methods with a shape function that the program can track by, and those that cannot have another one.
    pub fn with_shape(wanted: ShapeChoice) -> Vec<Self> {
        let mut methods = Self::available();
        methods.retain(|method| !matches!(method, Self::IcGn { shape, .. } if *shape != wanted));
        methods
    }

    /// Multiplications that a position takes, about, with a subset of `n_pixels`: three iterations (two for a
    /// translation), and the window's coefficients.
    pub fn effort(self, n_pixels: usize) -> f64 {
        let per_pixel = match self {
            // four levels of gradients and some ten iterations on the coarse and fine ones, in OpenCV's 8-bit integers
            Self::LucasKanade => 120.0,
            // the subset at 9 x 9 places
            Self::TemplateParabola => 90.0,
            // some eight iterations on the smoothed and warped scene, and on its two gradients
            Self::EnhancedCorrelation => 400.0,
            // three Fourier transforms of the subset in each of some four passes
            Self::PhaseCorrelation => 600.0,
            Self::IcGn { interpolation, shape } => {
                let taps = interpolation.n_taps() as f64;
                // a window has some 2.5 times the subset's pixels; a pole filters there and back along two axes
                let window = 2.5 * 4.0 * interpolation.poles().len() as f64;
                window
                    + match shape {
                        ShapeChoice::Named(Shape::Translation) => 2.0 * (2.0 * taps + 5.0),
                        ShapeChoice::Named(shape) => {
                            3.0 * (taps * (taps + 4.0) + 4.0 * shape.n_terms() as f64)
                        }
                        ShapeChoice::ByEvidence => 6.0 * (taps * (taps + 4.0) + 24.0),
                    }
            }
        };
        per_pixel * n_pixels as f64
    }

    /// Whether it follows what lies within a subset's outline alone; the others take rectangles.
    pub fn takes_outlines(self) -> bool {
        matches!(self, Self::IcGn { .. })
    }

    /// Tracks by this method; `settings` gives the rest, its shape and interpolation being those of the method.
    ///
    /// # Errors
    /// As [`track`], [`CorrelationError::NeedsOpenCv`], and [`CorrelationError::Outline`].
    pub fn track(
        self,
        recording: &dyn Recording,
        subsets: &[Subset],
        reference: &ReferenceFrames,
        settings: &Settings,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Track>, CorrelationError> {
        if self.is_foreign() && !foreign::has_foreign() {
            return Err(CorrelationError::NeedsOpenCv { method: self.to_string() });
        }
        if let Some(subset) = subsets.iter().find(|subset| !subset.outline_px.is_empty())
            && !self.takes_outlines()
        {
            return Err(CorrelationError::Outline { method: self.to_string(), name: subset.name.clone() });
        }
        match self {
            Self::LucasKanade => track_lucas_kanade(recording, subsets, reference, settings, progress),
            Self::TemplateParabola => {
                track_by::<TemplateSearch>(recording, subsets, reference, settings, progress)
            }
            Self::EnhancedCorrelation => {
                track_by::<EnhancedCorrelation>(recording, subsets, reference, settings, progress)
            }
            Self::PhaseCorrelation => {
                track_by::<PhaseCorrelation>(recording, subsets, reference, settings, progress)
            }
            Self::IcGn { interpolation, shape: ShapeChoice::Named(shape) } => {
                let settings = Settings { interpolation, shape, ..settings.clone() };
                track(recording, subsets, reference, &settings, progress)
            }
            Self::IcGn { interpolation, shape: ShapeChoice::ByEvidence } => {
                let settings = Settings { interpolation, ..settings.clone() };
                let tracked = track_by_evidence(recording, subsets, reference, &settings, progress)?;
                Ok(tracked.into_iter().map(|(track, _)| track).collect())
            }
        }
    }
}

impl Default for Method {
    fn default() -> Self {
        let Settings { interpolation, shape, .. } = Settings::default();
        Self::IcGn { interpolation, shape: ShapeChoice::Named(shape) }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LucasKanade => f.pad("opencv-lk"),
            Self::EnhancedCorrelation => f.pad("opencv-ecc"),
            Self::PhaseCorrelation => f.pad("opencv-phase"),
            Self::TemplateParabola => f.pad("template-parabola"),
            Self::IcGn { interpolation, shape } => f.pad(&format!("icgn-{interpolation}-{shape}")),
        }
    }
}

impl FromStr for Method {
    type Err = CorrelationError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        by_name("method", &Self::all(), name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names of all methods, which users write.
    const METHODS: &[&str] = &[
        "opencv-lk",
        "opencv-ecc",
        "opencv-phase",
        "template-parabola",
        "icgn-linear-translation",
        "icgn-linear-rigid",
        "icgn-linear-affine",
        "icgn-linear-quadratic",
        "icgn-linear-auto",
        "icgn-cubic-translation",
        "icgn-cubic-rigid",
        "icgn-cubic-affine",
        "icgn-cubic-quadratic",
        "icgn-cubic-auto",
        "icgn-cubic-moms-translation",
        "icgn-cubic-moms-rigid",
        "icgn-cubic-moms-affine",
        "icgn-cubic-moms-quadratic",
        "icgn-cubic-moms-auto",
        "icgn-quintic-translation",
        "icgn-quintic-rigid",
        "icgn-quintic-affine",
        "icgn-quintic-quadratic",
        "icgn-quintic-auto",
        "icgn-quintic-moms-translation",
        "icgn-quintic-moms-rigid",
        "icgn-quintic-moms-affine",
        "icgn-quintic-moms-quadratic",
        "icgn-quintic-moms-auto",
    ];

    #[test]
    fn every_name_stands_for_its_method() {
        let names: Vec<String> = Method::all().iter().map(Method::to_string).collect();
        assert_eq!(names, METHODS);
        for name in METHODS {
            assert_eq!(name.parse::<Method>().unwrap().to_string(), *name);
        }
        assert_eq!(Method::default().to_string(), "icgn-cubic-affine");
    }

    #[test]
    fn without_a_library_its_methods_are_known_and_not_offered() {
        let foreign: Vec<String> = Method::all()
            .into_iter()
            .filter(|method| method.is_foreign())
            .map(|method| method.to_string())
            .collect();
        assert_eq!(foreign, ["opencv-lk", "opencv-ecc", "opencv-phase"]);
        assert!(Method::available().into_iter().all(|method| !method.is_foreign()));
        assert_eq!(Method::available().len() + foreign.len(), METHODS.len());
    }
}
