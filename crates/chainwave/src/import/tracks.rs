//! Tracks of bodies as another program wrote them, in its own units.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use crate::error::Error;

/// Where a body was seen at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Standard uncertainty of each, where the program states it.
    pub(super) sigma: Option<f64>,
}

/// An axis of the program's picture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Axis {
    #[default]
    X,
    Y,
}

impl Spot {
    /// Its place along an axis.
    pub(super) fn along(self, axis: Axis) -> f64 {
        match axis {
            Axis::X => self.x,
            Axis::Y => self.y,
        }
    }
}

/// A track: where a body was seen, by the number of the instant.
#[derive(Debug, Clone, Default)]
pub(super) struct Track {
    /// As the program names it.
    pub(super) name: String,
    pub(super) spots: BTreeMap<usize, Spot>,
}

/// All tracks of a file.
#[derive(Debug, Clone, Default)]
pub(super) struct Tracks {
    pub(super) tracks: Vec<Track>,
    /// Time of each instant in seconds, where the program states it; else instants are frames.
    pub(super) times_s: Option<Vec<f64>>,
    /// Whether spots are displacements, whose order along the wave is that of the file.
    pub(super) are_displacements: bool,
}

impl Tracks {
    /// The tracks of the bodies, body 1 first: those that are named, or all of them by their first places along an axis.
    ///
    /// # Errors
    /// A name that no track has, or another number of tracks than of bodies.
    pub(super) fn of_bodies(
        self,
        path: &Path,
        n_bodies: usize,
        names: Option<&[String]>,
        axis: Axis,
        is_against: bool,
    ) -> Result<(Vec<Track>, Option<Vec<f64>>), Error> {
        let Self { mut tracks, times_s, are_displacements } = self;
        if let Some(names) = names {
            let found = |name: &String| {
                tracks.iter().find(|track| track.name == *name).cloned().ok_or_else(|| {
                    let known: Vec<&str> = tracks.iter().map(|track| track.name.as_str()).take(10).collect();
                    Error::place(path, "its tracks", &format!("one named {name:?}"), &known.join(", "))
                })
            };
            tracks = names.iter().map(found).collect::<Result<_, _>>()?;
        } else if !are_displacements {
            let first = |track: &Track| track.spots.values().next().map_or(0.0, |spot| spot.along(axis));
            tracks.sort_by(|one, other| first(one).total_cmp(&first(other)));
            if is_against {
                tracks.reverse();
            }
        }
        if tracks.len() != n_bodies {
            let hint =
                format!("{n_bodies} of them (hint: tracks = [..] names those of the bodies, body 1 first)");
            return Err(Error::place(path, "its tracks", &hint, &tracks.len().to_string()));
        }
        Ok((tracks, times_s))
    }
}
