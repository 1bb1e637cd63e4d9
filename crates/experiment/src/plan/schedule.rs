//! The recordings of a plan: those that are filmed already, and those that will be.

use std::path::Path;

use chainwave_camera::files_of;
use chainwave_measurement::RecordingInfo;

use super::in_memory::share_in_memory;
use super::planned_camera::PlannedCamera;
use crate::configuration::Trial;
use crate::recordings::view::bodies_in_view;
use crate::setup::Setup;

/// A recording as it is, or will be.
#[derive(Debug, Clone)]
pub(super) struct PlannedRecording {
    pub(super) trial: Trial,
    pub(super) info: RecordingInfo,
    /// Whether it is filmed: its time stamps are its own then, else they wait for the camera's phase.
    pub(super) is_filmed: bool,
    /// Bytes of its file, or files.
    pub(super) bytes: u64,
    /// The share of them that no disk has to be waited for.
    pub(super) in_memory: f64,
}

impl PlannedRecording {
    /// Bodies that lie in view at rest.
    pub(super) fn n_bodies(&self, setup: &Setup) -> usize {
        bodies_in_view(setup, &self.trial, &self.info).len()
    }
}

/// All recordings of a plan.
#[derive(Debug, Clone)]
pub(super) struct Schedule {
    pub(super) recordings: Vec<PlannedRecording>,
}

impl Schedule {
    /// The trials of an experiment: those that can be opened as they are; the others like the first one that can, or by a planned camera.
    pub(super) fn of(setup: &Setup, camera: &PlannedCamera) -> Self {
        let filmed = |trial: &Trial| {
            let info = setup.open(trial).ok()?.info().clone().proper();
            let path = setup.path_of(trial);
            let (bytes, in_memory) = (bytes_of(&path), share_in_memory(&path, &(0.0..1.0)));
            Some(PlannedRecording { trial: trial.clone(), info, is_filmed: true, bytes, in_memory })
        };
        let all: Vec<Option<PlannedRecording>> = setup.trials.iter().map(filmed).collect();
        let like = all.iter().flatten().next().cloned();
        let like = like.unwrap_or_else(|| PlannedRecording {
            trial: setup.trials[0].clone(),
            info: camera.info(),
            is_filmed: false,
            bytes: camera.camera.recording_bytes(camera.n_frames),
            in_memory: 1.0,
        });
        let planned =
            |trial: &Trial| PlannedRecording { trial: trial.clone(), is_filmed: false, ..like.clone() };
        let recordings = all.into_iter().zip(&setup.trials);
        let all = Self {
            recordings: recordings.map(|(one, trial)| one.unwrap_or_else(|| planned(trial))).collect(),
        };
        setup.experiment.tracking.until_s.map_or(all.clone(), |until_s| all.until(until_s))
    }

    /// The trials, in their order.
    pub(super) fn trials(&self) -> Vec<Trial> {
        self.recordings.iter().map(|one| one.trial.clone()).collect()
    }

    /// Bytes of all recordings.
    pub(super) fn bytes(&self) -> u64 {
        self.recordings.iter().map(|one| one.bytes).sum()
    }

    /// Frames of all recordings.
    pub(super) fn n_frames(&self) -> usize {
        self.recordings.iter().map(|one| one.info.n_frames).sum()
    }

    /// Places of bodies that are looked for: one for each that lies in view at rest, in each frame.
    pub(super) fn n_readings(&self, setup: &Setup) -> u64 {
        self.recordings.iter().map(|one| one.n_bodies(setup) as u64 * one.info.n_frames as u64).sum()
    }

    /// The largest number of trials of a view.
    pub(super) fn trials_a_view(&self) -> usize {
        Trial::most_of_a_view(self.recordings.iter().map(|one| &one.trial))
    }

    /// Number of views.
    pub(super) fn n_views(&self) -> usize {
        self.stages().len()
    }

    /// The last time that a recording is stamped with, in seconds after the trigger.
    pub(super) fn last_s(&self) -> f64 {
        let last = |one: &PlannedRecording| one.info.times_s.last().copied();
        self.recordings.iter().filter_map(last).fold(0.0, f64::max)
    }

    /// The first trials of each view, by their numbers.
    pub(super) fn with_first_trials(&self, n: usize) -> Self {
        let trials = || self.recordings.iter().map(|one| &one.trial);
        let is_kept = |one: &&PlannedRecording| one.trial.is_among_first(n, trials());
        Self { recordings: self.recordings.iter().filter(is_kept).cloned().collect() }
    }

    /// Every recording without its frames after a time.
    pub(super) fn until(&self, until_s: f64) -> Self {
        let cut = |one: &PlannedRecording| PlannedRecording { info: one.info.until(until_s), ..one.clone() };
        Self { recordings: self.recordings.iter().map(cut).collect() }
    }

    /// Every recording once more, as another trial.
    pub(super) fn with_twice_the_trials(&self) -> Self {
        let last = self.recordings.iter().map(|one| one.trial.trial).max().unwrap_or(0);
        let again = |one: &PlannedRecording| {
            let trial = last.saturating_add(one.trial.trial);
            let recording = format!("{}, once more", one.trial.recording);
            PlannedRecording {
                trial: Trial { recording, trial, ..one.trial.clone() },
                is_filmed: false,
                ..one.clone()
            }
        };
        let more: Vec<PlannedRecording> = self.recordings.iter().map(again).collect();
        Self { recordings: [self.recordings.clone(), more].concat() }
    }

    /// Every recording with a frame more between two.
    pub(super) fn at_twice_the_rate(&self) -> Self {
        let twice = |one: &PlannedRecording| {
            let mut info = one.info.clone();
            let between = one.info.times_s.windows(2).flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
            info.times_s = between.chain(one.info.times_s.last().copied()).collect();
            info.n_frames = info.times_s.len();
            info.rate_hz = one.info.rate_hz.map(|rate_hz| 2.0 * rate_hz);
            PlannedRecording { info, bytes: 2 * one.bytes, ..one.clone() }
        };
        Self { recordings: self.recordings.iter().map(twice).collect() }
    }

    /// One view more, with as many trials, over the same way of the stage; `None` of a single view.
    pub(super) fn with_a_view_more(&self) -> Option<Self> {
        let stages = self.stages();
        let (first, last) = (stages.first()?, stages.last()?);
        if stages.len() < 2 {
            return None;
        }
        let step_m = (last.1 - first.1) / stages.len() as f64;
        let n_trials = self.trials_a_view();
        let like = self.recordings.first()?;
        let one = |view: usize, number: usize| {
            let trial = Trial {
                recording: format!("view {} of {}, trial {}", view + 1, stages.len() + 1, number + 1),
                view: u32::try_from(view + 1).ok()?,
                trial: u32::try_from(number + 1).ok()?,
                stage_m: first.1 + view as f64 * step_m,
                ..like.trial.clone()
            };
            Some(PlannedRecording { trial, is_filmed: false, ..like.clone() })
        };
        let all = (0..=stages.len()).flat_map(|view| (0..n_trials).map(move |number| (view, number)));
        Some(Self { recordings: all.filter_map(|(view, number)| one(view, number)).collect() })
    }

    /// The views with the places of the stage, along it.
    pub(super) fn stages(&self) -> Vec<(u32, f64)> {
        let mut stages: Vec<(u32, f64)> =
            self.recordings.iter().map(|one| (one.trial.view, one.trial.stage_m)).collect();
        stages.sort_by(|one, other| one.1.total_cmp(&other.1).then(one.0.cmp(&other.0)));
        stages.dedup_by(|one, other| one.0 == other.0 && one.1.total_cmp(&other.1).is_eq());
        stages
    }
}

/// Bytes of a recording's files; 0 of what cannot be read.
fn bytes_of(path: &Path) -> u64 {
    let files = files_of(path).unwrap_or_default();
    files.iter().filter_map(|file| Some(file.metadata().ok()?.len())).sum()
}
