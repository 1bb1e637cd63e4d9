//! Errors that readings share, on the time base of what is merged.

use chainwave_measurement::{Estimate, Observation, SharedReadingError};

use crate::resample::Resampling;

/// An error of one body's readings on a common time base: in metres, by recording and time; nothing of a recording without it.
pub(crate) struct RowError {
    pub(crate) row: usize,
    of_recordings: Vec<Vec<f64>>,
}

impl RowError {
    /// An error of the body of a row, by recording and time.
    pub(crate) fn new(row: usize, of_recordings: Vec<Vec<f64>>) -> Self {
        Self { row, of_recordings }
    }

    /// The error of a recording's reading at a time, in metres.
    pub(crate) fn at(&self, recording: usize, time: usize) -> f64 {
        self.of_recordings[recording].get(time).copied().unwrap_or(0.0)
    }
}

/// An error row by row on a time base, each recording read as much later as its trigger is earlier.
pub(crate) fn on_time_base(
    error: &SharedReadingError,
    observations: &[Observation],
    offsets_s: &[f64],
    times_s: &[f64],
) -> Vec<RowError> {
    let mut rows: Vec<RowError> = Vec::new();
    let mut resampled: Vec<Option<Resampling<'_>>> = vec![None; observations.len()];
    for track in &error.of_tracks {
        let Some(recording) = observations.iter().position(|one| one.recording == track.recording) else {
            continue;
        };
        let samples: Vec<Option<Estimate>> =
            track.error_m.iter().map(|error_m| Some(Estimate::new(*error_m, 0.0))).collect();
        let own_s = || times_s.iter().map(|time_s| time_s + offsets_s[recording]);
        let of_recording =
            resampled[recording].get_or_insert_with(|| Resampling::at(&observations[recording], own_s()));
        let read = |i: usize| of_recording.read(i, &samples).map_or(0.0, |read| read.value);
        let error_m = (0..times_s.len()).map(read).collect();
        let row = track.body - 1;
        let place = rows.iter().position(|one| one.row == row).unwrap_or(rows.len());
        if place == rows.len() {
            rows.push(RowError { row, of_recordings: vec![Vec::new(); observations.len()] });
        }
        rows[place].of_recordings[recording] = error_m;
    }
    rows
}
