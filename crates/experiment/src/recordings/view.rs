//! What a recording shows at rest: the bodies in its view, and the frames before the wave.

use std::num::NonZero;
use std::ops::Range;
use std::path::{Path, PathBuf};

use chainwave_camera::OpenOptions;
use chainwave_correlation::ReferenceFrames;
use chainwave_measurement::{Recording, RecordingInfo, Subset, map_in_parallel};

use crate::configuration::Trial;
use crate::error::Error;
use crate::recordings::failed_recording::FailedRecording;
use crate::setup::Setup;

/// Rows and columns that a subset must keep from the frame's border at rest: the tracker interpolates around it.
const BORDER_PX: f64 = 4.0;

/// The recordings that cannot be opened, or show no frame at rest, each with the reason.
pub fn unreadable(setup: &Setup, n_threads: NonZero<usize>) -> Vec<FailedRecording> {
    let failure = |index: usize| {
        let trial = &setup.trials[index];
        let recording = setup.open(trial);
        let error = recording.and_then(|recording| frames_at_rest(setup, recording.as_ref())).err()?;
        Some(FailedRecording { trial: trial.clone(), error })
    };
    map_in_parallel(setup.trials.len(), n_threads, failure).into_iter().flatten().collect()
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

/// A recording of the trials table before it is opened for good: where it lies, how it is opened, and the subsets that are followed in it.
pub struct PlannedView {
    /// Where it lies.
    pub path: PathBuf,
    /// How it is opened.
    pub options: OpenOptions,
    /// The subsets of the bodies in view, in its frames at rest.
    pub subsets: Vec<Subset>,
}

/// A recording of an experiment with the bodies that its stage shows; pictures are as the sensor gave them.
///
/// # Errors
/// A recording that cannot be opened.
pub fn planned_view(setup: &Setup, trial: &Trial) -> Result<PlannedView, Error> {
    let recording = setup.open(trial)?;
    let mut subsets = bodies_in_view(setup, trial, recording.info());
    setup.corrections.place(&trial.recording, &mut subsets);
    let subsets = subsets.into_iter().map(|(_, subset)| subset).collect();
    Ok(PlannedView { path: setup.path_of(trial), options: setup.open_options(), subsets })
}

/// The first recording that shows bodies, with their subsets and the frames at rest.
///
/// # Errors
/// None that can be read and shows a body; of one that cannot be read, why.
pub fn first_view(setup: &Setup) -> Result<View, Error> {
    let mut why = Error::NothingLeft { what: "recordings with a body in view", n: setup.trials.len() };
    for trial in &setup.trials {
        match view_of(setup, trial) {
            Ok(Some(view)) => return Ok(view),
            Ok(None) => {}
            Err(unreadable) => why = unreadable,
        }
    }
    Err(why)
}

fn view_of(setup: &Setup, trial: &Trial) -> Result<Option<View>, Error> {
    let recording = setup.open(trial)?;
    let in_view = bodies_in_view(setup, trial, recording.info());
    if in_view.is_empty() {
        return Ok(None);
    }
    let reference = frames_at_rest(setup, recording.as_ref())?;
    let subsets = in_view.into_iter().map(|(_, subset)| subset).collect();
    Ok(Some(View { recording, subsets, reference }))
}

/// The bodies whose subsets lie in the frames of a recording at rest, with those, by the place of the stage that a trial has.
pub(crate) fn bodies_in_view(setup: &Setup, trial: &Trial, info: &RecordingInfo) -> Vec<(usize, Subset)> {
    let tracking = &setup.experiment.tracking;
    let map = setup.map_of(trial, info);
    let inside = |centre: f64, half: usize, size: usize| {
        let reach = half as f64 + BORDER_PX;
        centre - reach >= 0.0 && centre + reach <= size as f64 - 1.0
    };
    (1..=setup.experiment.chain.n_bodies)
        .filter_map(|body| Some((body, map.rest_px(body as i64, trial.stage_m)?)))
        .filter(|(_, [x_px, y_px])| {
            inside(*x_px, tracking.half_width_px, info.width_px)
                && inside(*y_px, tracking.half_height_px, info.height_px)
        })
        .map(|(body, [x_px, y_px])| {
            let (half_width_px, half_height_px) = (tracking.half_width_px, tracking.half_height_px);
            let subset = Subset::new(body.to_string(), x_px, y_px, half_width_px, half_height_px);
            (body, subset.within(tracking.outline_px.clone()))
        })
        .collect()
}

/// The frames before the wave: all from the first one that are stamped before `rest_until_s`.
pub(crate) fn rest_frames(info: &RecordingInfo, rest_until_s: f64) -> Option<Range<usize>> {
    let n = info.times_s.iter().take_while(|time_s| **time_s < rest_until_s).count();
    (n > 0).then_some(0..n)
}

fn no_rest(setup: &Setup, path: &Path, info: &RecordingInfo) -> Error {
    let tracking = &setup.experiment.tracking;
    let message = match (info.times_s.first(), tracking.until_s) {
        (None, Some(until_s)) => format!(
            "tracking.until_s: expected a time after the first frame of {}, found {until_s} s, before which there is none",
            path.display()
        ),
        (first_s, _) => format!(
            "tracking.rest_until_s: expected frames of {} before {} s, found its first at {:.6} s \
             (hint: a later rest_until_s, or recordings with more pre-trigger frames)",
            path.display(),
            tracking.rest_until_s,
            first_s.copied().unwrap_or(f64::NAN)
        ),
    };
    Error::Configuration { path: setup.path.clone(), message }
}
