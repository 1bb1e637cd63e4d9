//! Views and trials joined to one motion, without those that contradict the others and those that cannot be joined.

use std::num::NonZero;

use chainwave_measurement::{Observation, map_in_parallel};
use chainwave_stitching::{Outlier, Settings, Stitched, StitchingError, at_rest, merge, outliers};

use crate::finding::LeftOutRecording;

/// Recordings that were joined, and those that were not.
pub(crate) struct Joined {
    /// Places of the recordings that were joined, among those given.
    pub(crate) kept: Vec<usize>,
    pub(crate) stitched: Stitched,
    /// Recordings whose view cannot be joined.
    pub(crate) unjoined: Vec<LeftOutRecording>,
}

/// Places of the recordings that agree with the others of their view, and those that do not.
pub(crate) fn sound(all: &[Observation], settings: &Settings) -> (Vec<usize>, Vec<Outlier>) {
    let mut outliers = at_rest(all, settings);
    let is_sound = |outliers: &[Outlier], index: &usize| outliers.iter().all(|one| one.index != *index);
    let moving: Vec<usize> = (0..all.len()).filter(|index| is_sound(&outliers, index)).collect();
    let of_views = outliers_of_views(&chosen(all, &moving), settings);
    outliers.extend(of_views.into_iter().map(|one| Outlier { index: moving[one.index], ..one }));
    outliers.sort_by_key(|outlier| outlier.index);
    ((0..all.len()).filter(|index| is_sound(&outliers, index)).collect(), outliers)
}

/// Joins recordings. Where that fails for what one of them is, it is left out; else views that cannot be joined even alone, else the first one
/// without which the others can.
///
/// # Errors
/// No view can be joined.
pub(crate) fn join(observations: &[Observation], settings: &Settings) -> Result<Joined, StitchingError> {
    let (kept, stitched, reasons) = merged(observations, (0..observations.len()).collect(), settings)?;
    let unjoined = reasons
        .into_iter()
        .map(|(index, reason)| LeftOutRecording { recording: observations[index].recording.clone(), reason })
        .collect();
    Ok(Joined { kept, stitched, unjoined })
}

/// The outliers of each view; of a view that cannot be merged there are none, as [`merged`] leaves it out.
fn outliers_of_views(observations: &[Observation], settings: &Settings) -> Vec<Outlier> {
    let views = views(observations);
    // Views beside each other, in place of the bodies of each.
    let n_threads = settings.n_threads;
    let settings = &Settings { n_threads: NonZero::<usize>::MIN, ..settings.clone() };
    let of_view = |index: usize| {
        let view = views[index];
        let mut members: Vec<usize> =
            (0..observations.len()).filter(|i| observations[*i].view == view).collect();
        let found = loop {
            match outliers(&chosen(observations, &members), settings) {
                Ok(found) => break found,
                // What is wrong with one recording keeps no outlier among the others.
                Err(failure) => match blamed(&failure, observations, &members) {
                    Some(blamed) => members.retain(|member| *member != blamed),
                    None => break Vec::new(),
                },
            }
        };
        let placed = found.into_iter().map(|outlier| Outlier { index: members[outlier.index], ..outlier });
        placed.collect::<Vec<Outlier>>()
    };
    let mut found = map_in_parallel(views.len(), n_threads, of_view).concat();
    found.sort_by_key(|outlier| outlier.index);
    found
}

/// Places of the recordings that were merged, what they gave, and of those that were not, place and reason.
type Merged = (Vec<usize>, Stitched, Vec<(usize, String)>);

fn merged(
    observations: &[Observation],
    sound: Vec<usize>,
    settings: &Settings,
) -> Result<Merged, StitchingError> {
    let failure = match merge(&chosen(observations, &sound), settings) {
        Ok(stitched) => return Ok((sound, stitched, Vec::new())),
        Err(failure) => failure,
    };
    if let Some(blamed) = blamed(&failure, observations, &sound) {
        let others: Vec<usize> = sound.iter().copied().filter(|index| *index != blamed).collect();
        if let Ok((kept, stitched, mut reasons)) = merged(observations, others, settings) {
            reasons.push((blamed, failure.to_string()));
            reasons.sort_by_key(|(index, _)| *index);
            return Ok((kept, stitched, reasons));
        }
    }
    let split = |is_out: &dyn Fn(u32) -> bool| -> (Vec<usize>, Vec<usize>) {
        sound.iter().partition(|index| is_out(observations[**index].view))
    };
    let views = views(&chosen(observations, &sound));
    let alone = |view: &u32| {
        let (members, _) = split(&|other| other == *view);
        merge(&chosen(observations, &members), settings).err().map(|error| (*view, error.to_string()))
    };
    let hopeless: Vec<(u32, String)> = views.iter().filter_map(alone).collect();
    let attempts: Vec<Vec<(u32, String)>> = match hopeless.is_empty() {
        false => vec![hopeless],
        true => views.iter().rev().map(|view| vec![(*view, failure.to_string())]).collect(),
    };
    for left_out in attempts {
        let reason = |view: u32| left_out.iter().find(|(other, _)| *other == view).map(|(_, reason)| reason);
        let (out, kept) = split(&|view| reason(view).is_some());
        if let (false, Ok(stitched)) = (kept.is_empty(), merge(&chosen(observations, &kept), settings)) {
            let why = |index: usize| reason(observations[index].view).cloned().unwrap_or_default();
            return Ok((kept, stitched, out.into_iter().map(|index| (index, why(index))).collect()));
        }
    }
    Err(failure)
}

/// The place of the recording, one of several, that a failure is about.
fn blamed(failure: &StitchingError, observations: &[Observation], sound: &[usize]) -> Option<usize> {
    let (StitchingError::Inconsistent { recording, .. }
    | StitchingError::BodyOutside { recording, .. }
    | StitchingError::NoRest { recording, .. }) = failure
    else {
        return None;
    };
    let is_blamed = |index: &&usize| observations[**index].recording == *recording;
    sound.iter().find(is_blamed).copied().filter(|_| sound.len() > 1)
}

/// Some of the recordings.
pub(crate) fn chosen(observations: &[Observation], indices: &[usize]) -> Vec<Observation> {
    indices.iter().map(|index| observations[*index].clone()).collect()
}

/// Numbers of the views, in rising order.
fn views(observations: &[Observation]) -> Vec<u32> {
    let mut views: Vec<u32> = observations.iter().map(|observation| observation.view).collect();
    views.sort_unstable();
    views.dedup();
    views
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::{BodyTrack, Estimate};

    use super::*;

    /// Two bodies that rest and then move, with noise that differs from trial to trial.
    fn observation(view: u32, trial: u32, first_body: usize) -> Observation {
        let times_s: Vec<f64> = (-20..80).map(|k| 1e-4 * f64::from(k)).collect();
        let way = |body: usize, time_s: f64| {
            let since = (time_s - 4e-4 * body as f64) / 1e-3;
            1e-3 * (1.0 + since.clamp(-1.0, 1.0)).powi(2)
        };
        let body = |body: usize| BodyTrack {
            body,
            position_m: times_s
                .iter()
                .enumerate()
                .map(|(k, time_s)| {
                    let noise = 1e-7 * f64::sin((k * k + 13 * trial as usize) as f64);
                    Some(Estimate::new(way(body, *time_s) + noise, 1e-7))
                })
                .collect(),
        };
        Observation {
            recording: format!("view{view}_trial{trial}"),
            view,
            trial,
            times_s: times_s.clone(),
            bodies: vec![body(first_body), body(first_body + 1)],
        }
    }

    #[test]
    fn a_view_that_cannot_be_joined_is_left_out_with_its_reason() {
        let mut observations: Vec<Observation> =
            (1..=2).flat_map(|trial| [observation(1, trial, 1), observation(2, trial, 2)]).collect();
        let settings = Settings { rest_until_s: -1e-4, ..Settings::new(3, 0.0) };
        let everyone: Vec<usize> = (0..observations.len()).collect();
        let (kept, _, reasons) = merged(&observations, everyone.clone(), &settings).unwrap();
        assert_eq!((kept, reasons), (everyone.clone(), Vec::new()));
        observations[3].times_s.truncate(1);
        // The other recording of its view stays.
        let (kept, _, reasons) = merged(&observations, everyone.clone(), &settings).unwrap();
        assert_eq!((kept, reasons.len(), reasons[0].0), (vec![0, 1, 2], 1, 3));
        assert!(reasons[0].1.contains("view2_trial2") && reasons[0].1.contains("at least two frames"));
        observations[1].times_s.truncate(1);
        let (kept, _, reasons) = merged(&observations, everyone, &settings).unwrap();
        assert_eq!(kept, [0, 2]);
        let places: Vec<usize> = reasons.iter().map(|(index, _)| *index).collect();
        assert_eq!(places, [1, 3]);
        assert!(reasons[0].1.contains("at least two frames"), "{reasons:?}");
    }
}
