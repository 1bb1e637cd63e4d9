//! Pictures of a view with bodies at rest and in motion: from a recording that is there, else drawn by the planned camera.

use std::ops::Range;

use chainwave_measurement::{MemoryRecording, Recording, Subset, Trajectory};
use chainwave_synthetic::Scene;

use super::in_memory::share_in_memory;
use super::planned_camera::PlannedCamera;
use crate::configuration::Trial;
use crate::error::Error;
use crate::recordings::view::{bodies_in_view, frames_at_rest, rest_frames};
use crate::setup::Setup;

/// Pictures of one view.
pub(super) struct Pictures {
    pub(super) recording: Box<dyn Recording>,
    /// The bodies in view, with their subsets.
    pub(super) subsets: Vec<(usize, Subset)>,
    /// Frames at rest, from the first on.
    pub(super) rest: Range<usize>,
    /// Frames in which bodies may move.
    pub(super) moving: Range<usize>,
    /// The share of these that no disk has to be waited for.
    pub(super) moving_in_memory: f64,
}

/// Frames at rest that are drawn or timed, at most: with 40 the reference has a fortieth of a picture's noise.
pub(super) const MOST_REST_FRAMES: usize = 40;
/// Frames of motion, over which the time of following is measured.
const MOVING_FRAMES: usize = 24;
/// Where these may lie among the frames in motion, what is best first.
const PLACES: [f64; 5] = [0.5, 0.4, 0.6, 0.3, 0.7];

impl Pictures {
    /// Of a recording; `None` where it shows no body.
    ///
    /// # Errors
    /// A recording that cannot be read, or has no frame at rest.
    pub(super) fn filmed(setup: &Setup, trial: &Trial) -> Result<Option<Self>, Error> {
        let recording = setup.open(trial)?;
        let rest = frames_at_rest(setup, recording.as_ref())?.range();
        let subsets = bodies_in_view(setup, trial, recording.info());
        let n_frames = recording.info().n_frames;
        let in_memory = |moving: &Range<usize>| {
            let part = [moving.start, moving.end].map(|frame| frame as f64 / n_frames.max(1) as f64);
            share_in_memory(recording.path(), &(part[0]..part[1]))
        };
        // What a disk takes shows only in what has to come from it; where all does, or nothing, the middle will do.
        let ranges = PLACES.map(|place| moving_at(place, rest.end, n_frames));
        let ranges = ranges.map(|moving| (in_memory(&moving), moving));
        let least = ranges.into_iter().min_by(|one, other| one.0.total_cmp(&other.0));
        let (moving_in_memory, moving) = least.unwrap_or((1.0, 0..0));
        let found = Self { recording, subsets, rest, moving, moving_in_memory };
        Ok((!found.subsets.is_empty()).then_some(found))
    }

    /// Drawn by a camera, of bodies that move; `None` where it shows no body.
    ///
    /// # Errors
    /// A camera that makes no sense, or no frame at rest.
    pub(super) fn drawn(
        setup: &Setup,
        planned: &PlannedCamera,
        trial: &Trial,
        motion: &Trajectory,
    ) -> Result<Option<Self>, Error> {
        let mut info = planned.info();
        let subsets = bodies_in_view(setup, trial, &info);
        let rest_until_s = setup.experiment.tracking.rest_until_s;
        let rest = rest_frames(&info, rest_until_s).ok_or_else(|| no_rest(setup, &info.times_s))?;
        if subsets.is_empty() {
            return Ok(None);
        }
        let shot = planned.shot(setup, trial.view, trial.stage_m);
        let scene = Scene::new(&planned.camera, &planned.specimen, &shot, motion)?;
        let moving = moving_at(PLACES[0], rest.end, planned.n_frames);
        let rest = rest.start..rest.end.min(rest.start + MOST_REST_FRAMES);
        let shown: Vec<usize> = rest.clone().chain(moving).collect();
        let frames = shown.iter().map(|frame| {
            let counts = scene.recorded_counts(*frame)?;
            Ok::<_, Error>(counts.iter().copied().collect::<Vec<f32>>())
        });
        let frames = frames.collect::<Result<Vec<_>, _>>()?;
        info.times_s = shown.iter().map(|frame| info.times_s[*frame]).collect();
        info.n_frames = shown.len();
        let (n_rest, n) = (rest.len(), shown.len());
        let path = "planned".into();
        let recording = Box::new(MemoryRecording { path, info, frames });
        Ok(Some(Self { recording, subsets, rest: 0..n_rest, moving: n_rest..n, moving_in_memory: 1.0 }))
    }
}

/// Some frames of those after a first one, of which so large a share lies before them.
fn moving_at(place: f64, first: usize, n_frames: usize) -> Range<usize> {
    let start = first + (place * n_frames.saturating_sub(first + MOVING_FRAMES) as f64) as usize;
    start.min(n_frames)..(start + MOVING_FRAMES).min(n_frames)
}

fn no_rest(setup: &Setup, times_s: &[f64]) -> Error {
    Error::Configuration {
        path: setup.path.clone(),
        message: format!(
            "tracking.rest_until_s: expected planned frames before {} s, found the first at {} s (hint: a later rest_until_s, or an \
             earlier synthetic.first_image)",
            setup.experiment.tracking.rest_until_s,
            times_s.first().copied().unwrap_or(f64::NAN)
        ),
    }
}
