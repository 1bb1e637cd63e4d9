//! Observations that contradict themselves or the chain are refused.

use chainwave_measurement::{Estimate, Observation};

use crate::error::StitchingError;

/// Refuses an observation that contradicts itself or the chain.
pub(crate) fn check(observation: &Observation, n_bodies: usize) -> Result<(), StitchingError> {
    let inconsistent = |expected: &str, found: String| StitchingError::Inconsistent {
        recording: observation.recording.clone(),
        expected: expected.into(),
        found,
    };
    let times_s = &observation.times_s;
    if times_s.len() < 2 {
        return Err(inconsistent("at least two frames", format!("{}", times_s.len())));
    }
    if let Some(pair) = times_s.windows(2).find(|pair| pair[0].is_nan() || pair[1] <= pair[0]) {
        return Err(inconsistent("increasing times", format!("{} s after {} s", pair[1], pair[0])));
    }
    for track in &observation.bodies {
        if track.body == 0 || track.body > n_bodies {
            let (recording, body) = (observation.recording.clone(), track.body);
            return Err(StitchingError::BodyOutside { recording, body, n_bodies });
        }
        if track.position_m.len() != times_s.len() {
            let found = format!("{} positions of body {}", track.position_m.len(), track.body);
            return Err(inconsistent(&format!("{} positions", times_s.len()), found));
        }
        // A reading without error would outweigh all others for ever, one without a number spoil them.
        let is_sound = |x: &&Estimate| x.value.is_finite() && x.sigma.is_finite() && x.sigma > 0.0;
        if let Some(x) = track.position_m.iter().flatten().find(|x| !is_sound(x)) {
            let expected = "finite positions with a standard uncertainty above 0";
            return Err(inconsistent(
                expected,
                format!("{} +- {} m of body {}", x.value, x.sigma, track.body),
            ));
        }
    }
    Ok(())
}
