//! Programs whose files are known by name, and what their tracks look like.

mod array_file;
mod dltdv;
mod numpy;
mod pickle;
mod pyidi;
mod tracker;
mod tracking_markers;
mod trackpy;

use std::path::Path;

use serde::Deserialize;

use super::tracks::Tracks;
use crate::error::Error;

/// A program whose files are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Program {
    /// A table of linked trajectories as CSV.
    Trackpy,
    /// `xypts.csv` or `xyzpts.csv`, or the sparse `.tsv` of either.
    Dltdv,
    /// Exported data of one point mass or of several.
    Tracker,
    /// `results.pkl` of an analysis, or its array as `.npy`.
    Pyidi,
    /// The history of markers as `.npy`.
    TrackingMarkers,
}

impl Program {
    /// The tracks of a file.
    pub(super) fn read(self, path: &Path) -> Result<Tracks, Error> {
        match self {
            Self::Trackpy => trackpy::read(path),
            Self::Dltdv => dltdv::read(path),
            Self::Tracker => tracker::read(path),
            Self::Pyidi => pyidi::read(path),
            Self::TrackingMarkers => tracking_markers::read(path),
        }
    }
}
