//! PyIDI: displacements in pixels, an array of shape (points, frames, 2), y downwards first and then x.
//!
//! An analysis holds `results.pkl`, and beside it `points.pkl` with the points' places, shape (points, 2). An array that was saved as
//! `.npy` is read as well, with `points.npy` beside it.

use std::path::Path;

use super::super::tracks::{Spot, Track, Tracks};
use super::array_file;
use crate::error::Error;

pub(super) fn read(path: &Path) -> Result<Tracks, Error> {
    let results = array_file::read(path)?;
    let [n_points, n_frames, 2] = results.shape[..] else {
        return Err(results.refused(path, "shape (points, frames, 2)"));
    };
    let places = path.with_file_name("points").with_extension(path.extension().unwrap_or_default());
    let places = places.is_file().then(|| places_of(&places, n_points)).transpose()?;
    let track = |point: usize| {
        let (y, x) = places.as_ref().map_or((0.0, 0.0), |places| (places[2 * point], places[2 * point + 1]));
        let moved = results.values[2 * n_frames * point..][..2 * n_frames].chunks_exact(2);
        let seen = moved.enumerate().filter(|(_, moved)| moved.iter().all(|value| value.is_finite()));
        let spots =
            seen.map(|(frame, moved)| (frame, Spot { x: x + moved[1], y: y + moved[0], sigma: None }));
        Track { name: (point + 1).to_string(), spots: spots.collect() }
    };
    let tracks = (0..n_points).map(track).collect();
    Ok(Tracks { tracks, times_s: None, are_displacements: places.is_none() })
}

fn places_of(path: &Path, n_points: usize) -> Result<Vec<f64>, Error> {
    let places = array_file::read(path)?;
    match places.shape == [n_points, 2] {
        true => Ok(places.values),
        false => Err(places.refused(path, &format!("shape ({n_points}, 2), a place for each point"))),
    }
}
