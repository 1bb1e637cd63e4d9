//! Trackpy: a row for each particle and frame; `frame`, `particle`, `x`, `y` in pixels, and `ep`, the static error, where it was found.
//!
//! The table is that of D. B. Allan et al., trackpy (doi 10.5281/zenodo.4682814), as pandas writes it: plain numbers between commas, other columns
//! anywhere. Where stubs were filtered out, `frame` stands twice, as the index and as a column; both are the same.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::tracks::{Spot, Track, Tracks};
use crate::error::Error;
use chainwave_experiment::read_text;

pub(super) fn read(path: &Path) -> Result<Tracks, Error> {
    let text = read_text(path)?;
    let head = text.lines().next().unwrap_or_default().trim_start_matches('\u{feff}');
    let names: Vec<&str> = head.split(',').map(str::trim).collect();
    let place = |name: &str| names.iter().rposition(|known| *known == name);
    let needed = |name: &str| {
        place(name).ok_or_else(|| Error::place(path, "line 1", &format!("a column named {name}"), head))
    };
    let columns = (needed("frame")?, needed("particle")?, needed("x")?, needed("y")?, place("ep"));
    let mut tracks: BTreeMap<usize, Track> = BTreeMap::new();
    for (index, line) in text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty()) {
        let row = TrackpyLine { path, index, cells: line.split(',').map(str::trim).collect() };
        let (frame, particle, x, y, error) = columns;
        let (frame, particle) = (row.count(frame)?, row.count(particle)?);
        let track = tracks.entry(particle).or_default();
        if track.spots.contains_key(&frame) {
            return Err(row.wrong(
                "each particle once in a frame",
                &format!("particle {particle} twice in frame {frame}"),
            ));
        }
        // An error that could not be told is written as none, or as a negative number.
        let sigma =
            error.map(|column| row.number(column)).transpose()?.flatten().filter(|error| *error > 0.0);
        if let (Some(x), Some(y)) = (row.number(x)?, row.number(y)?) {
            track.spots.insert(frame, Spot { x, y, sigma });
        }
    }
    let named = tracks.into_iter().map(|(particle, track)| Track { name: particle.to_string(), ..track });
    Ok(Tracks { tracks: named.collect(), ..Tracks::default() })
}

/// A line of the table.
struct TrackpyLine<'a> {
    path: &'a Path,
    index: usize,
    cells: Vec<&'a str>,
}

impl TrackpyLine<'_> {
    fn wrong(&self, expected: &str, found: &str) -> Error {
        Error::place(self.path, &format!("line {}", self.index + 1), expected, found)
    }

    /// A cell; none where it is empty or no number that is finite.
    fn number(&self, column: usize) -> Result<Option<f64>, Error> {
        let cell = self.cells.get(column).copied().unwrap_or_default();
        match cell.parse::<f64>() {
            Ok(value) => Ok(Some(value).filter(|value| value.is_finite())),
            Err(_) if cell.is_empty() => Ok(None),
            Err(_) => Err(self.wrong("numbers", &format!("{cell:?}"))),
        }
    }

    fn count(&self, column: usize) -> Result<usize, Error> {
        let whole =
            self.number(column)?.filter(|value| *value >= 0.0 && value.fract() == 0.0 && *value < 1e15);
        whole.map(|value| value as usize).ok_or_else(|| {
            self.wrong(
                "whole numbers from 0 as frame and particle",
                self.cells.get(column).copied().unwrap_or("nothing"),
            )
        })
    }
}
