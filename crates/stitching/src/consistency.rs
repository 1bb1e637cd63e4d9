//! Observations that contradict themselves, each other or the chain are refused; tracks without a place at rest are left out.

use std::borrow::Cow;

use chainwave_measurement::{BodyTrack, Estimate, Observation};

use crate::error::StitchingError;
use crate::rest::no_rest;

/// Frames this many times as long as the common ones are counted in another unit.
const SLOWEST: f64 = 1000.0;
/// Recordings of one impact lie within so many times the length of the longest: of more, one counts its time from something else.
const FARTHEST_APART: f64 = 20.0;

/// Refuses a recording whose times are not near those of the others: a common time base over both would have no end.
pub(crate) fn check_spans(observations: &[Observation], rest_until_s: f64) -> Result<(), StitchingError> {
    let spans: Vec<(&Observation, (f64, f64))> =
        observations.iter().filter_map(|one| Some((one, one.span_s()?))).collect();
    let extreme = |of: fn(&(f64, f64)) -> f64, which: fn(f64, f64) -> f64| {
        spans.iter().map(|(_, span_s)| of(span_s)).reduce(which).unwrap_or(0.0)
    };
    let longest_s = extreme(|(first_s, last_s)| last_s - first_s, f64::max);
    let whole_s = extreme(|span_s| span_s.1, f64::max) - extreme(|span_s| span_s.0, f64::min);
    // One that is longer than zero by no frame is refused for that.
    if longest_s <= 0.0 || whole_s <= FARTHEST_APART * longest_s {
        return Ok(());
    }
    // The wave comes when the rest is over, which tells whose clock is another one even of two recordings.
    let distance_s =
        |(first_s, last_s): (f64, f64)| (first_s - rest_until_s).max(rest_until_s - last_s).max(0.0);
    let by_distance = |a: &&(&Observation, (f64, f64)), b: &&(&Observation, (f64, f64))| {
        distance_s(a.1).total_cmp(&distance_s(b.1))
    };
    let Some((foreign, (first_s, last_s))) = spans.iter().max_by(by_distance) else { return Ok(()) };
    Err(StitchingError::Inconsistent {
        recording: foreign.recording.clone(),
        expected: format!("times within {:.3} s of the other recordings'", FARTHEST_APART * longest_s),
        found: format!("{first_s} to {last_s} s (hint: does its clock begin at the trigger, as theirs?)"),
    })
}

/// The observations without the tracks that have no place at rest, and what was left out, in words.
///
/// # Errors
/// [`StitchingError::NoRest`] of a recording that shows bodies, and none at rest.
pub(crate) fn with_rest(
    observations: &[Observation],
    rest_until_s: f64,
) -> Result<(Cow<'_, [Observation]>, Vec<String>), StitchingError> {
    let rests = |one: &Observation, track: &BodyTrack| one.mean_before_m(track, rest_until_s).is_some();
    let mut said = Vec::new();
    for one in observations {
        for track in one.bodies.iter().filter(is_seen).filter(|track| !rests(one, track)) {
            if !one.bodies.iter().any(|other| rests(one, other)) {
                return Err(no_rest(one, track, rest_until_s));
            }
            said.push(format!(
                "{}: body {} was not seen at rest and is left out of this recording",
                one.recording, track.body
            ));
        }
    }
    if said.is_empty() {
        return Ok((Cow::Borrowed(observations), said));
    }
    let resting = |one: &Observation| {
        let bodies = one.bodies.iter().filter(|track| rests(one, track)).cloned();
        Observation { bodies: bodies.collect(), ..one.clone() }
    };
    Ok((Cow::Owned(observations.iter().map(resting).collect()), said))
}

/// Refuses observations of which those that show a body at rest leave a body to no trial.
pub(crate) fn check_shown(
    observations: &[Observation],
    resting: &[Observation],
    rest_until_s: f64,
) -> Result<(), StitchingError> {
    let is_left = |body: usize| resting.iter().flat_map(|one| &one.bodies).any(|track| track.body == body);
    let tracks =
        observations.iter().flat_map(|one| one.bodies.iter().filter(is_seen).map(move |of| (one, of)));
    let mut lost = tracks.filter(|(_, track)| !is_left(track.body));
    lost.next().map_or(Ok(()), |(one, track)| Err(no_rest(one, track, rest_until_s)))
}

fn is_seen(track: &&BodyTrack) -> bool {
    track.position_m.iter().any(Option::is_some)
}

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
