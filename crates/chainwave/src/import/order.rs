//! In which order imported bodies begin to move: columns that were taken for each other, bodies that are numbered from the far end.

use std::collections::BTreeMap;

use chainwave_measurement::{BodyTrack, Observation, median};

/// Standard deviations that a body moves by at most, beyond which its arrival is told.
const MOVED_SIGMAS: f64 = 20.0;
/// Neighbours whose order is told, at least, and the share of them that the wave passes in one order.
const LEAST_PAIRS: usize = 3;
const MOST: f64 = 0.75;
/// Share of the farthest way of a body from which on the wave has reached it. At half of it the last body of a free end, which goes as far again, would
/// come before its neighbour.
const ARRIVED_SHARE: f64 = 0.1;
/// Samples by which a body moves before the one that the wave passes first.
const LEAST_SAMPLES: f64 = 2.0;

/// What is to be said of the order in which bodies move, where most of them follow each other: of a wave that comes from one end.
pub(super) fn remarks(observations: &[Observation], rest_until_s: f64) -> Vec<String> {
    let later: Vec<(usize, f64)> = later_samples(observations, rest_until_s).into_iter().collect();
    let is_told = |(_, later): &&(usize, f64)| later.abs() > LEAST_SAMPLES;
    let n_told = later.iter().filter(is_told).count();
    let forwards = later.iter().filter(is_told).filter(|(_, later)| *later > 0.0).count();
    if n_told < LEAST_PAIRS {
        return Vec::new();
    }
    if forwards == 0 {
        return vec![
            "the last body moves first, and the first one last (hint: the wave comes from body 1; are the bodies numbered from the far end?)"
                .to_owned(),
        ];
    }
    let against: Vec<String> = later
        .iter()
        .filter(is_told)
        .filter(|(_, later)| *later < 0.0)
        .map(|(body, later)| format!("body {body} moves {:.0} samples before body {}", -later, body - 1))
        .collect();
    match forwards as f64 >= MOST * n_told as f64 && !against.is_empty() {
        true => vec![format!(
            "{}, against the order of the others (hint: were their columns taken for each other?)",
            against.join(", ")
        )],
        false => Vec::new(),
    }
}

/// By how many samples a body arrives later than the one before it, in the middle one of the recordings that show both: when it has moved a tenth as far as
/// it does at most.
fn later_samples(observations: &[Observation], rest_until_s: f64) -> BTreeMap<usize, f64> {
    let mut of_bodies: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for observation in observations {
        let arrival =
            |track: &BodyTrack| Some((track.body, arrival_sample(observation, track, rest_until_s)?));
        let arrivals: BTreeMap<usize, usize> = observation.bodies.iter().filter_map(arrival).collect();
        for (body, sample) in &arrivals {
            if let Some(before) = arrivals.get(&(body - 1)) {
                of_bodies.entry(*body).or_default().push(*sample as f64 - *before as f64);
            }
        }
    }
    of_bodies.into_iter().filter_map(|(body, later)| Some((body, median(later)?))).collect()
}

fn arrival_sample(observation: &Observation, track: &BodyTrack, rest_until_s: f64) -> Option<usize> {
    let rest_m = observation.mean_before_m(track, rest_until_s)?;
    let moved = || track.position_m.iter().map(|x| x.as_ref().map(|x| ((x.value - rest_m).abs(), x.sigma)));
    let (most_m, sigma_m) = moved().flatten().max_by(|one, other| one.0.total_cmp(&other.0))?;
    let is_there = |x: Option<(f64, f64)>| x.is_some_and(|(moved_m, _)| moved_m >= ARRIVED_SHARE * most_m);
    (most_m > MOVED_SIGMAS * sigma_m).then(|| moved().position(is_there)).flatten()
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;

    /// Bodies that are shoved by 1 mm, each from its own sample on.
    fn shoved(from: &[i32]) -> Vec<Observation> {
        let track = |(body, from): (usize, &i32)| {
            let place_m = |k: i32| 1e-3 * f64::from((k - from).clamp(0, 10)) / 10.0;
            let position_m = (0..200).map(|k| Some(Estimate::new(place_m(k), 1e-6))).collect();
            BodyTrack { body: body + 1, position_m }
        };
        let times_s = (0..200).map(|k| 1e-4 * f64::from(k - 20)).collect();
        let bodies = from.iter().enumerate().map(track).collect();
        vec![Observation { recording: "one".into(), view: 1, trial: 1, times_s, bodies }]
    }

    #[test]
    fn columns_that_were_taken_for_each_other_are_named() {
        let said = |from: &[i32]| remarks(&shoved(from), 0.0);
        assert!(said(&[30, 40, 50, 60, 70, 80]).is_empty());
        let swapped = said(&[30, 40, 60, 50, 70, 80]);
        assert!(
            swapped.len() == 1 && swapped[0].starts_with("body 4 moves 10 samples before body 3, "),
            "{swapped:?}"
        );
        let from_afar = said(&[80, 70, 60, 50, 40]);
        assert!(from_afar.len() == 1 && from_afar[0].contains("numbered from the far end"), "{from_afar:?}");
        // Waves from both ends, and bodies that all move at once.
        assert!(said(&[30, 40, 50, 60, 50, 40, 30]).is_empty());
        assert!(said(&[30, 31, 30, 31, 30]).is_empty());
    }
}
