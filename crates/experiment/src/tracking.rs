//! From recordings to tracks: which subsets lie in each view, what is kept of earlier runs, and what is followed anew.

use std::num::NonZero;
use std::ops::Range;
use std::path::Path;

use chainwave_camera::OpenOptions;
use chainwave_correlation::ReferenceFrames;
use chainwave_measurement::{Observation, Recording, RecordingInfo, Subset, map_in_parallel};
use chainwave_stitching::Outlier;

use crate::configuration::Trial;
use crate::error::Error;
use crate::follow::{edges_beside, follow, threads_of_each};
use crate::key::{Task, TrackKey};
use crate::monitor::{Monitor, Stage};
use crate::notices::remarks;
use crate::numbers::Positive;
use crate::setup::Setup;
use crate::share::Share;
use crate::stages::Stages;
use crate::store::{Kept, TrackStore};
use crate::tracks::{FollowedBody, RecordingTracks};

/// Rows and columns that a subset must keep from the frame's border at rest: the tracker interpolates around it.
const BORDER_PX: f64 = 4.0;

/// The tracks of all recordings that could be read.
pub struct Tracked {
    /// The recordings, in the order of the trials table.
    pub recordings: Vec<TrackedRecording>,
    /// The same as positions along the chain in metres.
    pub observations: Vec<Observation>,
    /// The recordings that could not be read, and why.
    pub failed: Vec<FailedRecording>,
    /// Where the stage stood.
    pub stages: Stages,
}

/// A recording that was tracked.
#[derive(Clone)]
pub struct TrackedRecording {
    /// Its row of the trials table.
    pub trial: Trial,
    /// The tracks.
    pub tracks: RecordingTracks,
    /// Where the tracks come from.
    pub origin: Origin,
    /// What the file says against itself.
    pub(crate) remarks: Vec<String>,
}

/// Where the tracks of a recording come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// They were kept.
    Kept,
    /// They were made, as nothing was kept under their key: the parts of the key in which what is kept of the same recording differs.
    New(Vec<&'static str>),
    /// They were made anew, as what was kept is torn: what is wrong with it.
    Torn(String),
}

/// A recording that could not be tracked.
pub struct FailedRecording {
    /// Its row of the trials table.
    pub trial: Trial,
    /// Why.
    pub error: Error,
}

impl Tracked {
    /// The same without some recordings.
    pub(crate) fn kept(&self, left_out: &[Outlier]) -> (Vec<TrackedRecording>, Vec<Observation>) {
        let is_kept = |index: &usize| left_out.iter().all(|outlier| outlier.index != *index);
        let kept: Vec<usize> = (0..self.recordings.len()).filter(is_kept).collect();
        (
            kept.iter().map(|index| self.recordings[*index].clone()).collect(),
            kept.iter().map(|index| self.observations[*index].clone()).collect(),
        )
    }
}

/// Tracks every recording that the store does not hold yet. One that fails is named and left out.
///
/// # Errors
/// No recording could be tracked, stages contradict each other, or the caller asked to stop.
pub fn track(
    setup: &Setup,
    store: &dyn TrackStore,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<Tracked, Error> {
    let (stages, results) = track_each(setup, &setup.trials, store, n_threads, monitor)?;
    let mut tracked =
        Tracked { recordings: Vec::new(), observations: Vec::new(), failed: Vec::new(), stages };
    for (trial, result) in setup.trials.iter().zip(results) {
        match result {
            Ok(recording) => {
                tracked.observations.push(recording.tracks.observation(trial, &setup.map.of_chain.map));
                tracked.recordings.push(recording);
            }
            Err(error) => tracked.failed.push(FailedRecording { trial: trial.clone(), error }),
        }
    }
    Ok(tracked)
}

/// Tracks the recordings of a share that the store does not hold yet, for a run that evaluates all of them later; returns how many are
/// tracked, and those that fail.
///
/// # Errors
/// As [`track`], but for recordings that fail.
pub fn track_share(
    setup: &Setup,
    share: Share,
    store: &dyn TrackStore,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<(usize, Vec<FailedRecording>), Error> {
    let trials = share.of(&setup.trials);
    let (_, results) = track_each(setup, &trials, store, n_threads, monitor)?;
    let n_tracked = results.iter().filter(|result| result.is_ok()).count();
    let failed = trials
        .into_iter()
        .zip(results)
        .filter_map(|(trial, result)| result.err().map(|error| FailedRecording { trial, error }));
    Ok((n_tracked, failed.collect()))
}

/// Where the stage stood, and for each of some recordings, in their order, its tracks or why it has none.
type TrackedEach = (Stages, Vec<Result<TrackedRecording, Error>>);

fn track_each(
    setup: &Setup,
    trials: &[Trial],
    store: &dyn TrackStore,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<TrackedEach, Error> {
    let method = setup.method();
    let stages = Stages::refine(setup, method, n_threads)?;
    let of_each = threads_of_each(n_threads, trials.len());
    let one = |index: usize| {
        let trial = &trials[index];
        if (monitor.is_cancelled)() {
            return Err(Error::Cancelled { n_done: 0, n: 0 });
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
    Ok((stages, results))
}

fn track_one(
    setup: &Setup,
    trial: &Trial,
    stage_m: f64,
    store: &dyn TrackStore,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<TrackedRecording, Error> {
    let path = setup.recordings.join(&trial.recording);
    let recording = open(setup, &path)?;
    let reference = frames_at_rest(setup, recording.as_ref())?;
    let in_view = bodies_in_view(setup, stage_m, recording.as_ref());
    let (bodies, subsets): (Vec<usize>, Vec<Subset>) = in_view.into_iter().unzip();
    let rate_hz = setup.experiment.camera.rate_hz.map(Positive::get);
    let task = Task { subsets: &subsets, reference: &reference, method: setup.method(), rate_hz };
    let key = TrackKey::of(&trial.recording, &path, &task)?;
    let (tracks, origin) = match store.load(&key)? {
        Kept::Tracks(tracks) => (tracks, Origin::Kept),
        other => {
            let origin = match other {
                Kept::Unusable(reason) => Origin::Torn(reason),
                _ => Origin::New(store.differences(&key)),
            };
            let followed = follow(recording.as_ref(), &subsets, &reference, task.method, n_threads, monitor)?;
            let of_body = bodies.into_iter().zip(followed.tracks).map(|(body, one)| FollowedBody {
                body,
                method: one.method,
                positions: one.track.positions,
            });
            let tracks = RecordingTracks { times_s: followed.times_s, bodies: of_body.collect() };
            store.keep(&key, &tracks)?;
            (tracks, origin)
        }
    };
    let edges = edges_beside(recording.as_ref(), &subsets, &reference)?;
    Ok(TrackedRecording { trial: trial.clone(), tracks, origin, remarks: remarks(recording.info(), &edges) })
}

/// Opens a recording that the calibration holds for.
pub(crate) fn open(setup: &Setup, path: &Path) -> Result<Box<dyn Recording>, Error> {
    let rate_hz = setup.experiment.camera.rate_hz.map(Positive::get);
    let recording = chainwave_camera::open_with(path, &OpenOptions { rate_hz, ..OpenOptions::default() })?;
    setup.map.check_size(recording.as_ref())?;
    Ok(recording)
}

/// The frames of a recording before the wave.
pub(crate) fn frames_at_rest(setup: &Setup, recording: &dyn Recording) -> Result<ReferenceFrames, Error> {
    let rest = rest_frames(recording.info(), setup.experiment.tracking.rest_until_s);
    Ok(ReferenceFrames::Mean(rest.ok_or_else(|| no_rest(setup, recording.path(), recording.info()))?))
}

/// A recording with the subsets that are followed in it.
pub struct View {
    /// The recording.
    pub recording: Box<dyn Recording>,
    /// The subsets in its reference.
    pub subsets: Vec<Subset>,
    /// The reference.
    pub reference: ReferenceFrames,
}

/// The first recording that shows bodies, with their subsets and the frames at rest.
///
/// # Errors
/// A recording that cannot be read, or none that shows a body.
pub fn first_view(setup: &Setup) -> Result<View, Error> {
    for trial in &setup.trials {
        let recording = open(setup, &setup.recordings.join(&trial.recording))?;
        let in_view = bodies_in_view(setup, trial.stage_m, recording.as_ref());
        if !in_view.is_empty() {
            let reference = frames_at_rest(setup, recording.as_ref())?;
            let subsets = in_view.into_iter().map(|(_, subset)| subset).collect();
            return Ok(View { recording, subsets, reference });
        }
    }
    Err(Error::NothingLeft { what: "recordings with a body in view", n: setup.trials.len() })
}

/// The bodies whose subsets lie in the frame at rest, with those.
pub(crate) fn bodies_in_view(setup: &Setup, stage_m: f64, recording: &dyn Recording) -> Vec<(usize, Subset)> {
    let (info, tracking) = (recording.info(), &setup.experiment.tracking);
    let inside = |centre: f64, half: usize, size: usize| {
        let reach = half as f64 + BORDER_PX;
        centre - reach >= 0.0 && centre + reach <= size as f64 - 1.0
    };
    (1..=setup.experiment.chain.n_bodies)
        .filter_map(|body| Some((body, setup.map.rest_px(body, stage_m)?)))
        .filter(|(_, [x_px, y_px])| {
            inside(*x_px, tracking.half_width_px, info.width_px)
                && inside(*y_px, tracking.half_height_px, info.height_px)
        })
        .map(|(body, [x_px, y_px])| {
            let (half_width_px, half_height_px) = (tracking.half_width_px, tracking.half_height_px);
            (body, Subset { name: body.to_string(), x_px, y_px, half_width_px, half_height_px })
        })
        .collect()
}

/// The frames before the wave: all from the first one that are stamped before `rest_until_s`.
fn rest_frames(info: &RecordingInfo, rest_until_s: f64) -> Option<Range<usize>> {
    let n = info.times_s.iter().take_while(|time_s| **time_s < rest_until_s).count();
    (n > 0).then_some(0..n)
}

fn no_rest(setup: &Setup, path: &Path, info: &RecordingInfo) -> Error {
    let first_s = info.times_s.first().copied().unwrap_or(f64::NAN);
    Error::Configuration {
        path: setup.path.clone(),
        message: format!(
            "tracking.rest_until_s: expected frames of {} before {} s, found its first at {first_s} s \
             (hint: a later rest_until_s, or recordings with more pre-trigger frames)",
            path.display(),
            setup.experiment.tracking.rest_until_s,
        ),
    }
}
