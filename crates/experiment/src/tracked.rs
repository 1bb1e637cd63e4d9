//! Recordings that were tracked, those that could not be, and where tracks come from.

use std::num::NonZero;

use chainwave_camera::PlaneMap;
use chainwave_measurement::{Estimate, Observation};

use crate::camera::calibration::ChainMap;
use crate::configuration::Trial;
use crate::finding::Finding;
use crate::geometry::stages::Stages;
use crate::recordings::failed_recording::FailedRecording;
use crate::timing::exposure::at_middle_of_exposure;
use crate::timing::frame_steps::{FrameStep, frame_steps, put_right};
use crate::timing::repeated_frames::{self, repeated_frames};
use crate::tracks::{Coordinate, RecordingTracks};

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
    /// What contradicts the experiment, before work and by the tracks.
    pub findings: Vec<Finding>,
}

impl Tracked {
    /// When the last recording ends, in seconds after its trigger.
    pub(crate) fn last_s(&self) -> f64 {
        self.observations
            .iter()
            .filter_map(|one| one.times_s.last())
            .fold(0.0, |last, time_s| last.max(*time_s))
    }

    /// Finds frames that show the picture before once more, and others that recordings lack or have twice, leaves the former out, puts the times of
    /// those behind the latter right, and says so.
    pub(crate) fn count_frames(&mut self, n_threads: NonZero<usize>) {
        for (recording, observation) in self.recordings.iter_mut().zip(&mut self.observations) {
            recording.repeated_frames = repeated_frames(&recording.tracks);
            if !recording.repeated_frames.is_empty() {
                *observation = recording.observation();
            }
            recording.remarks.extend(repeated_frames::in_words(&recording.repeated_frames));
        }
        let found = frame_steps(&self.observations, n_threads);
        for ((recording, observation), steps) in
            self.recordings.iter_mut().zip(&mut self.observations).zip(found)
        {
            recording.remarks.extend(steps.iter().map(FrameStep::in_words));
            recording.frame_steps = steps;
            if !recording.frame_steps.is_empty() {
                *observation = recording.observation();
            }
        }
    }

    /// Takes another time from line to line for true: each time of a body is that of its line.
    pub(crate) fn expose_lines_by(&mut self, line_time_s: Estimate) {
        for (recording, observation) in self.recordings.iter_mut().zip(&mut self.observations) {
            recording.line_time_s = line_time_s;
            observation.times_s = recording.observation().times_s;
        }
    }
}

/// A recording that was tracked.
#[derive(Clone)]
pub struct TrackedRecording {
    /// Its row of the trials table.
    pub trial: Trial,
    /// The tracks.
    pub tracks: RecordingTracks,
    /// From its pictures to the chain.
    pub(crate) map: ChainMap,
    /// Columns and rows of its pictures.
    pub(crate) picture_px: (usize, usize),
    /// Time from the exposure of one line of its pictures to that of the next, in seconds: as stated, or as the tracks tell.
    pub(crate) line_time_s: Estimate,
    /// Bodies that were not found at rest, which have no displacement.
    pub(crate) without_rest: Vec<usize>,
    /// For how long each of its frames was exposed, in seconds; 0 where nothing says that.
    pub(crate) exposure_s: f64,
    /// Frames that show the picture before them once more.
    pub(crate) repeated_frames: Vec<usize>,
    /// Frames that it lacks, or has twice.
    pub(crate) frame_steps: Vec<FrameStep>,
    /// True time between its frames over the stated one.
    pub(crate) clock: f64,
    /// Where the tracks come from.
    pub origin: Origin,
    /// What the file says against itself.
    pub(crate) remarks: Vec<String>,
}

impl TrackedRecording {
    /// Positions along the chain of the bodies that were found at rest.
    pub(crate) fn observation(&self) -> Observation {
        self.observation_of(Coordinate::Along, &self.map.of_chain.map)
    }

    /// Positions along the chain, were the time between lines longer by its standard uncertainty.
    pub(crate) fn observation_by_later_lines(&self) -> Observation {
        let line_time_s = self.line_time_s.value + self.line_time_s.sigma;
        self.put_right(self.tracks.observation_of(
            Coordinate::Along,
            &self.trial,
            &self.map.of_chain.map,
            line_time_s,
        ))
    }

    /// A coordinate of its bodies by a map of its pictures.
    pub(crate) fn observation_of(&self, coordinate: Coordinate, map: &PlaneMap) -> Observation {
        self.put_right(self.tracks.observation_of(coordinate, &self.trial, map, self.line_time_s.value))
    }

    /// Whether a frame shows a picture that was seen before, which its remarks say.
    pub(crate) fn shows_again(&self, frame: usize) -> bool {
        self.repeated_frames.contains(&frame) || self.frame_steps.iter().any(|step| step.repeats(frame))
    }

    /// What is to be said of frames behind the recording proper, which has so many.
    pub(crate) fn frames_behind_a_pause(&self, n_proper: usize) -> Option<String> {
        let times_s = &self.tracks.times_s;
        let (n, last_s) = (times_s.len().checked_sub(n_proper).filter(|n| *n > 0)?, times_s.last()?);
        let frames =
            if n == 1 { "its last frame is" } else { "frames behind a pause of more than a thousand are" };
        Some(format!("{frames} no part of the motion: {n}, stamped up to {last_s:.3} s after the trigger"))
    }

    fn put_right(&self, mut observation: Observation) -> Observation {
        observation.bodies.retain(|track| !self.without_rest.contains(&track.body));
        observation.end_with_span();
        repeated_frames::count_once(&mut observation);
        repeated_frames::leave_out(&mut observation, &self.repeated_frames);
        put_right(&mut observation, &self.frame_steps);
        at_middle_of_exposure(&mut observation, self.exposure_s);
        observation.times_s.iter_mut().for_each(|time_s| *time_s *= self.clock);
        observation
    }
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
