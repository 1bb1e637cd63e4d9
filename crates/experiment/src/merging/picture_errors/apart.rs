//! Readings with their shared errors apart from their noise.

use std::collections::BTreeMap;

use chainwave_measurement::{Estimate, Observation, SharedReadingError};

/// Errors that readings share, and what these take of the readings' stated variances.
#[derive(Default)]
pub(crate) struct Apart {
    pub(crate) errors: Vec<SharedReadingError>,
    /// By recording and body.
    of_tracks: BTreeMap<(String, usize), OfTrack>,
}

#[derive(Default)]
struct OfTrack {
    /// Variance of the errors, frame by frame.
    shared_m2: Vec<f64>,
    at_rest_m2: f64,
}

impl Apart {
    /// Of errors, and the variance at rest of a recording's body.
    pub(super) fn of(errors: Vec<SharedReadingError>, at_rest_m2: impl Fn(&str, usize) -> f64) -> Self {
        let mut of_tracks: BTreeMap<(String, usize), OfTrack> = BTreeMap::new();
        for one in errors.iter().flat_map(|error| &error.of_tracks) {
            let own = of_tracks.entry((one.recording.clone(), one.body)).or_insert_with(|| OfTrack {
                shared_m2: vec![0.0; one.error_m.len()],
                at_rest_m2: at_rest_m2(&one.recording, one.body),
            });
            own.shared_m2.iter_mut().zip(&one.error_m).for_each(|(sum, error_m)| *sum += error_m * error_m);
        }
        Self { errors, of_tracks }
    }

    /// Positions with the uncertainty that they do not share: no less than at rest, unless it was less before.
    pub(crate) fn noise_of(&self, mut observations: Vec<Observation>) -> Vec<Observation> {
        for observation in &mut observations {
            for track in &mut observation.bodies {
                let Some(own) = self.of_tracks.get(&(observation.recording.clone(), track.body)) else {
                    continue;
                };
                for (place, shared_m2) in track.position_m.iter_mut().zip(&own.shared_m2) {
                    *place = place.map(|x| {
                        let variance_m2 = x.sigma.powi(2);
                        let left_m2 = (variance_m2 - shared_m2).max(own.at_rest_m2.min(variance_m2));
                        Estimate::new(x.value, left_m2.sqrt())
                    });
                }
            }
        }
        observations
    }
}
