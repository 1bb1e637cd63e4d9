//! From recordings to tracks: which subsets lie in each view, what is kept of earlier runs, and what is followed anew.

pub(crate) mod follow;
pub(crate) mod key;
pub(crate) mod matching;
pub(crate) mod picture_field;
pub(crate) mod points;
mod remarks;
pub(crate) mod share;
pub(crate) mod shot;
pub(crate) mod store;

use std::num::NonZero;

use chainwave_measurement::{BodyTrack, Estimate, Observation, Subset, map_in_parallel};

use crate::configuration::Trial;
use crate::error::Error;
use crate::finding::{Finding, LeftOutRecording, Sanity};
use crate::geometry::stages::Stages;
use crate::monitor::{Monitor, Stage};
use crate::recordings::failed_recording::FailedRecording;
use crate::recordings::unreadable_frames::unreadable_frames;
use crate::recordings::view::{bodies_in_view, frames_at_rest};
use crate::sanity::{MOTION_AT_REST, moving_light, of_tracks, rolling_shutter};
use crate::setup::Setup;
use crate::tracked::{Origin, Tracked, TrackedRecording};
use crate::tracking::follow::{edges_beside, follow, ground_beside, threads_of_each};
use crate::tracking::key::{Task, TrackKey};
use crate::tracking::remarks::remarks;
use crate::tracking::share::Share;
use crate::tracking::store::{Kept, TrackStore};
use crate::tracks::RecordingTracks;
use crate::wording::grouped;

/// Tracks every recording that the store does not hold yet and that made sense before work. One that fails is named and left out.
///
/// # Errors
/// The caller asked to stop.
pub fn track(
    setup: &Setup,
    sanity: &Sanity,
    store: &dyn TrackStore,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<Tracked, Error> {
    let stages = Stages::refine(setup, &usable(setup, sanity), setup.method(), n_threads);
    let results = track_each(setup, &setup.trials, &stages, sanity, store, n_threads, monitor)?;
    let beforehand =
        |(subject, reason)| Finding { code: "left_out", subject, text: format!("it was left out: {reason}") };
    let why = |one: &LeftOutRecording| (one.recording.clone(), one.reason.clone());
    let why: Vec<(String, String)> = sanity.left_out.iter().map(why).collect();
    let findings = grouped(&why).into_iter().map(beforehand);
    let findings = sanity.findings.iter().cloned().chain(findings).collect();
    let mut tracked =
        Tracked { recordings: Vec::new(), observations: Vec::new(), failed: Vec::new(), stages, findings };
    let mut unusable = Vec::new();
    for (trial, result) in setup.trials.iter().zip(results) {
        match result.and_then(|recording| observed(setup, recording)) {
            Ok(Observed { recording, observation, unusable: lost }) => {
                unusable.extend(lost.map(|lost| (trial.recording.clone(), lost)));
                tracked.observations.push(observation);
                tracked.recordings.push(recording);
            }
            Err(error) => tracked.failed.push(FailedRecording { trial: trial.clone(), error }),
        }
    }
    tracked.count_frames(n_threads);
    let followed: Vec<(&str, &RecordingTracks)> =
        tracked.recordings.iter().map(|one| (one.trial.recording.as_str(), &one.tracks)).collect();
    let corrected = setup.corrections.findings(&followed);
    tracked.findings.extend(corrected);
    let left_out = |(subject, text)| Finding { code: "body_left_out", subject, text };
    tracked.findings.extend(grouped(&unusable).into_iter().map(left_out));
    let by_tracks = of_tracks(setup, &tracked);
    // The tracks tell of all recordings what one of each view has told before.
    tracked.findings.retain(|finding| finding.code != MOTION_AT_REST);
    tracked.findings.extend(by_tracks);
    let light = moving_light(setup, &tracked, n_threads);
    tracked.findings.extend(light);
    if let Some(shutter) = rolling_shutter(setup, &tracked, n_threads) {
        tracked.findings.push(shutter.finding);
        if let Some(line_time_s) = shutter.corrects_to_s {
            tracked.expose_lines_by(line_time_s);
        }
    }
    Ok(tracked)
}

/// A recording that was tracked, with its positions along the chain.
struct Observed {
    recording: TrackedRecording,
    observation: Observation,
    /// What is to be said of bodies that were left out.
    unusable: Option<String>,
}

/// A recording's tracks as positions along the chain, without bodies that were never found at rest, which have no displacement.
///
/// # Errors
/// A recording of which no body is left.
fn observed(setup: &Setup, mut recording: TrackedRecording) -> Result<Observed, Error> {
    let rest_until_s = setup.experiment.tracking.rest_until_s;
    let all = recording.observation();
    let n_rest = all.times_s.iter().take_while(|time_s| **time_s < rest_until_s).count();
    let is_lost = |track: &&BodyTrack| !track.position_m.iter().take(n_rest).any(Option::is_some);
    if let Some(pause) = recording.frames_behind_a_pause(all.times_s.len()) {
        recording.remarks.push(pause);
    }
    recording.without_rest = all.bodies.iter().filter(is_lost).map(|track| track.body).collect();
    let (observation, lost) = (recording.observation(), &recording.without_rest);
    let numbers: Vec<String> = lost.iter().map(usize::to_string).collect();
    let (name, numbers) = (&recording.trial.recording, numbers.join(", "));
    let why = || {
        let bodies = recording.tracks.bodies.iter().filter(|followed| lost.contains(&followed.body));
        let reasons = bodies
            .flat_map(|body| body.positions.iter().take(n_rest))
            .filter_map(|found| found.as_ref().err());
        reasons.map(|lost| lost.as_str()).next().unwrap_or("not seen")
    };
    if observation.bodies.is_empty() {
        return Err(Error::Value(format!(
            "{name}: expected bodies that are found at rest, found none: {numbers} are lost before rest_until_s: {} (hint: do subsets lie on their markers?)",
            why()
        )));
    }
    let unusable = (!lost.is_empty()).then(|| {
        format!(
            "body {numbers} is left out: it was not found at rest ({}), where displacements count from",
            why()
        )
    });
    Ok(Observed { recording, observation, unusable })
}

/// What became of a share of the recordings.
pub struct TrackedShare {
    /// How many are tracked.
    pub n_tracked: usize,
    /// Those that failed.
    pub failed: Vec<FailedRecording>,
}

/// Tracks the recordings of a share that the store does not hold yet, for a run that evaluates all of them later.
///
/// # Errors
/// As [`track`], but for recordings that fail.
pub fn track_share(
    setup: &Setup,
    sanity: &Sanity,
    share: Share,
    store: &dyn TrackStore,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<TrackedShare, Error> {
    let trials = share.of(&setup.trials);
    let stages = Stages::for_placing(setup, &usable(setup, sanity), setup.method(), n_threads);
    let results = track_each(setup, &trials, &stages, sanity, store, n_threads, monitor)?;
    let n_tracked = results.iter().filter(|result| result.is_ok()).count();
    let failed = trials
        .into_iter()
        .zip(results)
        .filter_map(|(trial, result)| result.err().map(|error| FailedRecording { trial, error }));
    Ok(TrackedShare { n_tracked, failed: failed.collect() })
}

/// The recordings of views that show what their stage says.
fn usable(setup: &Setup, sanity: &Sanity) -> Vec<Trial> {
    setup.trials.iter().filter(|trial| sanity.reason(&trial.recording).is_none()).cloned().collect()
}

/// For each of some recordings, in their order, its tracks or why it has none.
fn track_each(
    setup: &Setup,
    trials: &[Trial],
    stages: &Stages,
    sanity: &Sanity,
    store: &dyn TrackStore,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<Vec<Result<TrackedRecording, Error>>, Error> {
    plan_frames(setup, trials, sanity, monitor);
    let of_each = threads_of_each(n_threads, trials.len());
    let one = |index: usize| {
        let trial = &trials[index];
        if (monitor.is_cancelled)() {
            return Err(Error::Cancelled { n_done: 0, n: 0 });
        }
        if let Some(reason) = sanity.reason(&trial.recording) {
            return Err(Error::LeftOut { recording: trial.recording.clone(), reason: reason.to_owned() });
        }
        track_one(setup, trial, stages.placing_m(trial), store, of_each, monitor)
    };
    let results = map_in_parallel(trials.len(), n_threads, one);
    monitor.ended(Stage::Tracking);
    let is_stopped = |result: &Result<_, Error>| matches!(result, Err(Error::Cancelled { .. }));
    if results.iter().any(is_stopped) {
        let n_done = results.iter().filter(|result| result.is_ok()).count();
        return Err(Error::Cancelled { n_done, n: trials.len() });
    }
    Ok(results)
}

/// Tells how many frames the recordings have that are to be tracked. One that cannot be read counts for none: tracking names it.
fn plan_frames(setup: &Setup, trials: &[Trial], sanity: &Sanity, monitor: &Monitor<'_>) {
    let usable = trials.iter().filter(|trial| sanity.reason(&trial.recording).is_none());
    let n_frames = |trial: &Trial| setup.open(trial).map_or(0, |recording| recording.info().n_frames as u64);
    monitor.planned(Stage::Tracking, usable.map(n_frames).sum());
}

fn track_one(
    setup: &Setup,
    trial: &Trial,
    stage_m: f64,
    store: &dyn TrackStore,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<TrackedRecording, Error> {
    let recording = setup.open(trial)?;
    let reference = frames_at_rest(setup, recording.as_ref())?;
    let placed = Trial { stage_m, ..trial.clone() };
    let mut in_view = bodies_in_view(setup, &placed, recording.info());
    setup.corrections.place(&trial.recording, &mut in_view);
    let (bodies, subsets): (Vec<usize>, Vec<Subset>) = in_view.into_iter().unzip();
    let (method, options, sensor) = (setup.method(), &setup.open_options(), setup.sensor.as_ref());
    let seeds = setup.corrections.seeds_as_text(&trial.recording);
    let until_s = setup.experiment.tracking.until_s;
    let task = Task { subsets: &subsets, reference: &reference, method, options, sensor, seeds, until_s };
    let key =
        TrackKey::of(&trial.recording, setup.content_of(trial)?, &task).at_times(&recording.info().times_s);
    let (mut tracks, origin) = match store.load(&key)? {
        Kept::Tracks(tracks) => {
            monitor.done(Stage::Tracking, recording.info().n_frames as u64);
            (tracks, Origin::Kept)
        }
        other => {
            let origin = match other {
                Kept::Unusable(reason) => Origin::Torn(reason),
                _ => Origin::New(store.differences(&key)),
            };
            let followed = follow(recording.as_ref(), &subsets, &reference, task.method, n_threads, monitor)?;
            let mut tracks = followed.of_bodies(bodies);
            let (corrections, name) = (&setup.corrections, &trial.recording);
            corrections.follow_seeds(recording.as_ref(), name, &subsets, &reference, &mut tracks)?;
            store.keep(&key, &tracks)?;
            (tracks, origin)
        }
    };
    let unread =
        unreadable_frames(recording.as_ref(), tracks.bodies.iter().map(|body| body.positions.as_slice()));
    // What is kept holds the readings that are taken out, so that they come back when the correction goes.
    setup.corrections.exclude(&trial.recording, &mut tracks);
    let edges = edges_beside(recording.as_ref(), &subsets, &reference)?;
    let ground = ground_beside(recording.as_ref(), &subsets, &reference, &tracks)?;
    let (trial, map) = (trial.clone(), setup.map_of(trial, recording.info()));
    let line_time_s = Estimate::new(setup.line_time_s(), 0.0);
    Ok(TrackedRecording {
        trial,
        tracks,
        map,
        picture_px: (recording.info().width_px, recording.info().height_px),
        line_time_s,
        without_rest: Vec::new(),
        exposure_s: recording.info().exposure_s.unwrap_or(0.0),
        repeated_frames: Vec::new(),
        frame_steps: Vec::new(),
        clock: 1.0,
        origin,
        remarks: remarks(recording.info(), &edges, &ground).into_iter().chain(unread).collect(),
    })
}
