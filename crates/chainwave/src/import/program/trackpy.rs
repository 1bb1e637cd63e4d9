//! Trackpy: a row for each particle and frame; `frame`, `particle`, `x`, `y` in pixels, and `ep`, the static error, where it was found.
//!
//! The table is that of D. B. Allan et al., trackpy (doi 10.5281/zenodo.4682814), as pandas writes it: other columns may stand anywhere.

use std::collections::BTreeMap;
use std::path::Path;

use chainwave_experiment::Table;

use super::super::tracks::{Spot, Track, Tracks};
use crate::error::Error;

pub(super) fn read(path: &Path) -> Result<Tracks, Error> {
    let table = Table::read_csv(path)?;
    let (frames, particles) = (table.counts("frame")?, table.counts("particle")?);
    let (x, y) = (table.numbers("x")?, table.numbers("y")?);
    let errors = if table.has("ep") { table.numbers("ep")? } else { vec![None; x.len()] };
    let mut tracks: BTreeMap<usize, Track> = BTreeMap::new();
    for (row, (frame, particle)) in frames.into_iter().zip(particles).enumerate() {
        let track = tracks.entry(particle).or_default();
        if track.spots.contains_key(&frame) {
            let found = format!("particle {particle} twice in frame {frame}");
            return Err(table.cell(row, "frame", "each particle once in a frame", &found).into());
        }
        if let (Some(x), Some(y)) = (x[row], y[row]) {
            // An error that could not be told is written as none, or as a negative number.
            let sigma = errors[row].filter(|error| *error > 0.0);
            track.spots.insert(frame, Spot { x, y, sigma });
        }
    }
    let named = tracks.into_iter().map(|(particle, track)| Track { name: particle.to_string(), ..track });
    Ok(Tracks { tracks: named.collect(), ..Tracks::default() })
}
