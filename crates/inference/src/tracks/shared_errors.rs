//! Errors that readings share, as the fit to tracks takes them: amplitudes of unit variance that it finds along with the recordings' own
//! unknowns, so that a reading counts by what it says beyond them.

use chainwave_measurement::{Observation, SharedReadingError};

/// The errors that the readings of some recordings share.
pub(super) struct SharedErrors<'a> {
    /// Recordings that share errors, by their numbers, and how many errors these are.
    pub(super) ties: Vec<(Vec<usize>, usize)>,
    /// Where each error stands among its tie's, if any track has it: the tie, and the error's number there.
    pub(super) of_errors: Vec<Option<(usize, usize)>>,
    of_recordings: Vec<OfRecording<'a>>,
}

#[derive(Default, Clone)]
struct OfRecording<'a> {
    tie: Option<usize>,
    /// Which of the tie's errors it has, in order.
    errors: Vec<usize>,
    /// For each of its tracks: which of these it has, in order, and what one standard deviation of each makes of its frames, in metres.
    of_tracks: Vec<Vec<(usize, &'a [f64])>>,
}

impl<'a> SharedErrors<'a> {
    /// Of those recordings and tracks that are there.
    pub(super) fn of(
        observations: &[Observation],
        errors: impl Iterator<Item = &'a SharedReadingError>,
    ) -> Self {
        let found: Vec<Vec<(usize, usize, &[f64])>> =
            errors.map(|error| places(observations, error)).collect();
        let groups = groups(observations.len(), found.iter().filter(|places| !places.is_empty()));
        let of_observation = |observation: &Observation| OfRecording {
            tie: None,
            errors: Vec::new(),
            of_tracks: vec![Vec::new(); observation.bodies.len()],
        };
        let mut of_recordings: Vec<OfRecording<'_>> = observations.iter().map(of_observation).collect();
        let mut ties = Vec::new();
        let mut of_errors = vec![None; found.len()];
        for group in groups {
            let mut n = 0;
            let is_own = |places: &[(usize, usize, &[f64])]| places.iter().any(|(r, ..)| group.contains(r));
            for (error, places) in found.iter().enumerate().filter(|(_, places)| is_own(places)) {
                places.iter().for_each(|(r, track, error_m)| of_recordings[*r].add(n, *track, error_m));
                of_errors[error] = Some((ties.len(), n));
                n += 1;
            }
            group.iter().for_each(|r| of_recordings[*r].tie = Some(ties.len()));
            ties.push((group, n));
        }
        Self { ties, of_errors, of_recordings }
    }

    /// Which of its tie's errors a recording has, in order.
    pub(super) fn of_recording(&self, recording: usize) -> &[usize] {
        &self.of_recordings[recording].errors
    }

    /// Which of the ties a recording belongs to.
    pub(super) fn tie_of(&self, recording: usize) -> Option<usize> {
        self.of_recordings[recording].tie
    }

    /// Those of one of its tracks: which of the recording's, and what one standard deviation of each makes of the track's frames, in metres.
    pub(super) fn of_track(&self, recording: usize, track: usize) -> &[(usize, &'a [f64])] {
        &self.of_recordings[recording].of_tracks[track]
    }
}

impl<'a> OfRecording<'a> {
    /// Adds one of the tie's errors to a track. The tie's errors come one behind the other.
    fn add(&mut self, error: usize, track: usize, error_m: &'a [f64]) {
        if self.errors.last() != Some(&error) {
            self.errors.push(error);
        }
        self.of_tracks[track].push((self.errors.len() - 1, error_m));
    }
}

/// The tracks that have an error: recording, place among its bodies, and the error frame by frame.
fn places<'a>(observations: &[Observation], error: &'a SharedReadingError) -> Vec<(usize, usize, &'a [f64])> {
    let place = |one: &'a chainwave_measurement::TrackDeviation| {
        let recording = observations.iter().position(|other| other.recording == one.recording)?;
        let track = observations[recording].bodies.iter().position(|track| track.body == one.body)?;
        let is_felt = one.error_m.iter().any(|error_m| *error_m != 0.0);
        is_felt.then_some((recording, track, one.error_m.as_slice()))
    };
    error.of_tracks.iter().filter_map(place).collect()
}

/// Recordings that share an error with each other, directly or through others; none that shares nothing.
fn groups<'a>(n: usize, errors: impl Iterator<Item = &'a Vec<(usize, usize, &'a [f64])>>) -> Vec<Vec<usize>> {
    let mut label: Vec<Option<usize>> = vec![None; n];
    for places in errors {
        let first = places.iter().map(|(r, ..)| label[*r].unwrap_or(*r)).min();
        for (r, ..) in places {
            match label[*r] {
                Some(old) => label.iter_mut().filter(|one| **one == Some(old)).for_each(|one| *one = first),
                None => label[*r] = first,
            }
        }
    }
    let mut labels: Vec<usize> = label.iter().flatten().copied().collect();
    labels.sort_unstable();
    labels.dedup();
    labels.into_iter().map(|one| (0..n).filter(|r| label[*r] == Some(one)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::{BodyTrack, TrackDeviation};

    use super::*;

    fn observation(recording: &str) -> Observation {
        let body = |body: usize| BodyTrack { body, position_m: vec![None; 2] };
        Observation {
            recording: recording.into(),
            view: 1,
            trial: 1,
            times_s: vec![0.0, 1.0],
            bodies: vec![body(4), body(5)],
        }
    }

    fn error(of: &[(&str, usize, f64)]) -> SharedReadingError {
        let of_track = |(recording, body, error_m): &(&str, usize, f64)| TrackDeviation {
            recording: (*recording).into(),
            body: *body,
            error_m: vec![0.0, *error_m],
        };
        SharedReadingError { source: "a pattern".into(), of_tracks: of.iter().map(of_track).collect() }
    }

    #[test]
    fn recordings_are_tied_by_what_they_share_at_all() {
        let observations = ["a", "b", "c", "d", "e"].map(observation);
        let errors = [
            error(&[("d", 4, 1.0), ("b", 4, 1.0)]),
            error(&[("c", 5, 2.0)]),
            error(&[("c", 4, 3.0), ("d", 5, 3.0)]),
            // Not filmed, not seen, not felt.
            error(&[("f", 4, 1.0), ("a", 6, 1.0), ("e", 4, 0.0)]),
        ];
        let shared = SharedErrors::of(&observations, errors.iter());
        assert_eq!(shared.ties, vec![(vec![1, 2, 3], 3)]);
        let which = |r: usize, track: usize| -> Vec<(usize, f64)> {
            let of_recording = shared.of_recording(r);
            shared
                .of_track(r, track)
                .iter()
                .map(|(place, error_m)| (of_recording[*place], error_m[1]))
                .collect()
        };
        let of_recordings: Vec<&[usize]> = (0..5).map(|r| shared.of_recording(r)).collect();
        assert_eq!(of_recordings, [&[][..], &[0], &[1, 2], &[0, 2], &[]]);
        assert_eq!([which(2, 0), which(2, 1)], [vec![(2, 3.0)], vec![(1, 2.0)]]);
        assert_eq!([which(3, 0), which(3, 1)], [vec![(0, 1.0)], vec![(2, 3.0)]]);
    }
}
