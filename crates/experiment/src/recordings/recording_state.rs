//! What became of each recording of an experiment.

use crate::configuration::Trial;
use crate::error::Error;
use crate::finding::LeftOutRecording;
use crate::recordings::failed_recording::FailedRecording;

/// What became of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingState {
    /// Its name in the trials table.
    pub recording: String,
    /// Number of its view.
    pub view: u32,
    /// Number of its trial.
    pub trial: u32,
    /// Whether the motion has it.
    pub state: State,
    /// Why the motion does not have it.
    pub reason: Option<String>,
}

/// Whether the motion has a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It has.
    Used,
    /// The recording can be read, and what it shows contradicts the experiment or the others, or is not needed for what was asked.
    LeftOut,
    /// It could not be read or tracked.
    Failed,
}

impl State {
    /// Its name in `results.json`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::LeftOut => "left_out",
            Self::Failed => "failed",
        }
    }
}

/// What became of each recording, in the order of the trials table: used unless it failed, or was left out for a reason.
pub fn recording_states(
    trials: &[Trial],
    failed: &[FailedRecording],
    left_out: &[LeftOutRecording],
) -> Vec<RecordingState> {
    let fate = |name: &str| -> (State, Option<String>) {
        let failure = failed.iter().find(|one| one.trial.recording == name).map(|one| &one.error);
        let left_out = left_out.iter().find(|one| one.recording == name).map(|one| &one.reason);
        match (failure, left_out) {
            (Some(Error::LeftOut { reason, .. }), _) | (None, Some(reason)) => {
                (State::LeftOut, Some(reason.clone()))
            }
            (Some(error), _) => (State::Failed, Some(error.to_string())),
            (None, None) => (State::Used, None),
        }
    };
    let of = |trial: &Trial| {
        let (state, reason) = fate(&trial.recording);
        let recording = trial.recording.clone();
        RecordingState { recording, view: trial.view, trial: trial.trial, state, reason }
    };
    trials.iter().map(of).collect()
}
