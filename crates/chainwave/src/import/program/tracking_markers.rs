//! Tracking-markers: the history of markers as `.npy`, shape (frames, markers, 2), x and y in pixels, y upwards.

use std::path::Path;

use super::super::tracks::{Spot, Track, Tracks};
use super::array_file;
use crate::error::Error;

pub(super) fn read(path: &Path) -> Result<Tracks, Error> {
    let history = array_file::read(path)?;
    let [_, n_markers, 2] = history.shape[..] else {
        return Err(history.refused(path, "shape (frames, markers, 2)"));
    };
    let mut tracks: Vec<Track> =
        (1..=n_markers).map(|marker| Track { name: marker.to_string(), ..Track::default() }).collect();
    for (at, place) in history.values.chunks_exact(2).enumerate() {
        let (frame, marker) = (at / n_markers, at % n_markers);
        if place.iter().all(|value| value.is_finite()) {
            tracks[marker].spots.insert(frame, Spot { x: place[0], y: place[1], sigma: None });
        }
    }
    Ok(Tracks { tracks, ..Tracks::default() })
}
