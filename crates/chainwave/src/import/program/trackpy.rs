//! Trackpy: a row for each particle and frame; `frame`, `particle`, `x`, `y` in pixels, and `ep`, the static error, where it was found.
//!
//! The table is that of D. B. Allan et al., trackpy (doi 10.5281/zenodo.4682814), as pandas writes it: plain numbers between commas (or between
//! semicolons or tabs, where they may have decimal commas), other columns anywhere. Where stubs were filtered out, `frame` stands twice, as the index and as a column; both are the same.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::tracks::{Spot, Track, Tracks};
use crate::error::Error;
use chainwave_experiment::read_text;

pub(super) fn read(path: &Path) -> Result<Tracks, Error> {
    let text = read_text(path)?;
    let head = text.lines().next().unwrap_or_default().trim_start_matches('\u{feff}');
    // A decimal comma has no place among names.
    let separator = [';', '\t'].into_iter().find(|mark| head.contains(*mark)).unwrap_or(',');
    let names: Vec<&str> = head.split(separator).map(str::trim).collect();
    let place = |name: &str| names.iter().rposition(|known| *known == name);
    let needed = |name: &str| {
        place(name).ok_or_else(|| Error::place(path, "line 1", &format!("a column named {name}"), head))
    };
    let columns = (needed("frame")?, needed("particle")?, needed("x")?, needed("y")?, place("ep"));
    let mut tracks: BTreeMap<usize, Track> = BTreeMap::new();
    for (index, line) in text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty()) {
        let cells = line.split(separator).map(str::trim).collect();
        let row = TrackpyLine { path, index, cells };
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
        // Between commas there is none within a number.
        match cell.replacen(',', ".", 1).parse::<f64>() {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn semicolons_and_decimal_commas_say_the_same_as_commas_and_points() {
        let folder = tempfile::tempdir().unwrap();
        let spots = |text: &str| {
            let path = folder.path().join("tracks.csv");
            std::fs::write(&path, text).unwrap();
            let spots: Vec<Spot> = read(&path).unwrap().tracks[0].spots.values().copied().collect();
            spots
        };
        let usual = spots("frame,particle,x,y,ep\n0,0,1.5,2,0.25\n1,0,1.75,2,\n");
        assert_eq!(
            usual,
            [Spot { x: 1.5, y: 2.0, sigma: Some(0.25) }, Spot { x: 1.75, y: 2.0, sigma: None }]
        );
        assert_eq!(spots("frame;particle;x;y;ep\n0;0;1,5;2;0,25\n1;0;1,75;2;\n"), usual);
    }
}
