use std::fmt;
use std::str::FromStr;

use chainwave_measurement::{Recording, Subset, Track};

use crate::settings::by_name;
use crate::{CorrelationError, Interpolation, ReferenceFrames, Settings, Shape, track};

/// A rung of the ladder: a way to track, by name, from the fastest and least accurate upwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Method {
    /// OpenCV's pyramidal Lucas-Kanade on 8-bit images.
    #[cfg(feature = "opencv")]
    LucasKanade,
    /// This crate's IC-GN.
    IcGn {
        /// The interpolation of the target.
        interpolation: Interpolation,
        /// The shape function.
        shape: Shape,
    },
}

/// The names of all methods in this build.
pub const METHODS: &[&str] = &[
    #[cfg(feature = "opencv")]
    "opencv-lk",
    "icgn-linear-translation",
    "icgn-linear-rigid",
    "icgn-linear-affine",
    "icgn-linear-quadratic",
    "icgn-cubic-translation",
    "icgn-cubic-rigid",
    "icgn-cubic-affine",
    "icgn-cubic-quadratic",
    "icgn-cubic-moms-translation",
    "icgn-cubic-moms-rigid",
    "icgn-cubic-moms-affine",
    "icgn-cubic-moms-quadratic",
    "icgn-quintic-translation",
    "icgn-quintic-rigid",
    "icgn-quintic-affine",
    "icgn-quintic-quadratic",
    "icgn-quintic-moms-translation",
    "icgn-quintic-moms-rigid",
    "icgn-quintic-moms-affine",
    "icgn-quintic-moms-quadratic",
];

impl Method {
    /// Every method in this build, in the order of [`METHODS`].
    pub fn all() -> Vec<Self> {
        let icgn = Interpolation::ALL.into_iter().flat_map(|interpolation| {
            Shape::ALL.into_iter().map(move |shape| Self::IcGn { interpolation, shape })
        });
        #[cfg(feature = "opencv")]
        let icgn = std::iter::once(Self::LucasKanade).chain(icgn);
        icgn.collect()
    }

    /// Tracks by this method; `settings` gives the rest, its shape and interpolation being those of the method.
    ///
    /// # Errors
    /// As [`track`].
    pub fn track(
        self,
        recording: &dyn Recording,
        subsets: &[Subset],
        reference: &ReferenceFrames,
        settings: &Settings,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<Vec<Track>, CorrelationError> {
        match self {
            #[cfg(feature = "opencv")]
            Self::LucasKanade => crate::track_lucas_kanade(recording, subsets, reference, settings, progress),
            Self::IcGn { interpolation, shape } => {
                let settings = Settings { interpolation, shape, ..settings.clone() };
                track(recording, subsets, reference, &settings, progress)
            }
        }
    }
}

impl Default for Method {
    fn default() -> Self {
        let Settings { interpolation, shape, .. } = Settings::default();
        Self::IcGn { interpolation, shape }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            #[cfg(feature = "opencv")]
            Self::LucasKanade => f.pad("opencv-lk"),
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

    #[test]
    fn every_name_stands_for_its_method() {
        let names: Vec<String> = Method::all().iter().map(Method::to_string).collect();
        assert_eq!(names, METHODS);
        for name in METHODS {
            assert_eq!(name.parse::<Method>().unwrap().to_string(), *name);
        }
        assert_eq!(Method::default().to_string(), "icgn-cubic-moms-affine");
    }
}
