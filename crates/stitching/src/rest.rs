//! Displacement of a body from its place at rest.

use chainwave_measurement::{BodyTrack, Estimate, Observation};

use crate::error::StitchingError;

/// A body's displacement from its place at rest in one recording.
#[derive(Debug, Clone)]
pub(crate) struct Displacement {
    /// Row of the body: its number less one.
    pub(crate) row: usize,
    /// Displacement in metres, one entry a frame.
    pub(crate) samples: Vec<Option<Estimate>>,
    /// Standard uncertainty of the place at rest, in metres: an error that all samples share.
    pub(crate) rest_sigma_m: f64,
}

/// Subtracts the mean position at rest (frames before `rest_until_s`) from a body's track.
pub(crate) fn displacement_from_rest(
    observation: &Observation,
    track: &BodyTrack,
    rest_until_s: f64,
) -> Result<Displacement, StitchingError> {
    let origin_m = observation
        .mean_before_m(track, rest_until_s)
        .ok_or_else(|| no_rest(observation, track, rest_until_s))?;
    let at_rest = observation.readings_before(track, rest_until_s);
    let n = at_rest.clone().count() as f64;
    let rest_sigma_m = at_rest.map(|reading| reading.sigma.powi(2)).sum::<f64>().sqrt() / n;
    let from_origin = |position: &Estimate| Estimate::new(position.value - origin_m, position.sigma);
    let samples = track.position_m.iter().map(|position| position.as_ref().map(from_origin)).collect();
    Ok(Displacement { row: track.body - 1, samples, rest_sigma_m })
}

/// That a body was never seen at rest in a recording.
pub(crate) fn no_rest(observation: &Observation, track: &BodyTrack, rest_until_s: f64) -> StitchingError {
    StitchingError::NoRest { recording: observation.recording.clone(), body: track.body, rest_until_s }
}
