//! Observations that contradict themselves or the chain are refused.

use chainwave_measurement::{Estimate, Observation};

use crate::error::StitchingError;

/// Frames this many times as long as the common ones are counted in another unit.
const SLOWEST: f64 = 1000.0;

/// Refuses an observation that contradicts itself, the chain, or the other recordings, whose common frame interval is given.
pub(crate) fn check(
    observation: &Observation,
    n_bodies: usize,
    frame_interval_s: f64,
) -> Result<(), StitchingError> {
    let inconsistent = |expected: &str, found: String| StitchingError::Inconsistent {
        recording: observation.recording.clone(),
        expected: expected.into(),
        found,
    };
    let times_s = &observation.times_s;
    if times_s.len() < 2 {
        return Err(inconsistent("at least two frames", format!("{}", times_s.len())));
    }
    if let Some(pair) =
        times_s.windows(2).find(|pair| !(pair[0].is_finite() && pair[1].is_finite()) || pair[1] <= pair[0])
    {
        return Err(inconsistent("increasing times", format!("{} s after {} s", pair[1], pair[0])));
    }
    let own_s = observation.frame_interval_s();
    if own_s > SLOWEST * frame_interval_s {
        let expected = format!("a frame each {frame_interval_s} s or so, as in most recordings");
        return Err(inconsistent(&expected, format!("one each {own_s} s (hint: are all times in seconds?)")));
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
