//! `[[synthetic.faults]]`: things that go wrong in a laboratory.

use serde::{Deserialize, Serialize};

use super::Trial;
use crate::input::numbers::Positive;

/// Something that goes wrong in the laboratory: an entry of `[[synthetic.faults]]`. Recordings go by the names in the trials
/// table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Fault {
    /// A file ends after a share of its bytes.
    TruncatedFile {
        /// File name of the recording.
        recording: String,
        /// Share of its bytes that is left.
        kept_fraction: f64,
    },
    /// No file of a view was kept.
    MissingView {
        /// Number of the view.
        view: u32,
    },
    /// The striker was faster than its draw by a factor.
    StruckTooFast {
        /// File name of the recording.
        recording: String,
        /// On the velocity that was drawn.
        factor: Positive,
    },
    /// Two files under each other's name.
    SwappedFiles {
        /// File names of both.
        recordings: [String; 2],
    },
    /// Something hides a body's marker in the frames stamped within `[from_s, until_s)`.
    CoveredBody {
        /// File name of the recording.
        recording: String,
        /// Number of the body, from 1.
        body: usize,
        /// First time at which it is hidden, in seconds after the trigger.
        from_s: f64,
        /// First time at which it is seen again, in seconds.
        until_s: f64,
    },
    /// Frames were lost; the time stamps tell.
    DroppedFrames {
        /// File name of the recording.
        recording: String,
        /// The first frame that is lost.
        first_frame: usize,
        /// How many are.
        n_frames: usize,
    },
    /// The header states another frame rate; the time stamps are right.
    WrongRate {
        /// File name of the recording.
        recording: String,
        /// The rate that the header states.
        header_rate_hz: f64,
    },
}

/// The kinds of faults, as in the experiment file.
pub const FAULT_KINDS: [&str; 7] = [
    "truncated_file",
    "missing_view",
    "struck_too_fast",
    "swapped_files",
    "covered_body",
    "dropped_frames",
    "wrong_rate",
];

impl Fault {
    /// The recordings that it names.
    pub(crate) fn recordings(&self) -> Vec<&String> {
        match self {
            Self::MissingView { .. } => Vec::new(),
            Self::SwappedFiles { recordings } => recordings.iter().collect(),
            Self::TruncatedFile { recording, .. }
            | Self::StruckTooFast { recording, .. }
            | Self::CoveredBody { recording, .. }
            | Self::DroppedFrames { recording, .. }
            | Self::WrongRate { recording, .. } => vec![recording],
        }
    }

    /// One of each kind for an experiment's trials, as a laboratory might have it; `None` for an unknown kind, or where the trials do
    /// not suffice for it.
    pub fn usual(kind: &str, trials: &[Trial], rate_hz: f64) -> Option<Self> {
        let first = trials.first()?;
        let recording =
            |k: usize| trials.get(k).map_or_else(|| first.recording.clone(), |one| one.recording.clone());
        let other = trials.iter().rev().find(|trial| trial.view != first.view);
        Some(match kind {
            "truncated_file" => Self::TruncatedFile { recording: recording(0), kept_fraction: 0.6 },
            "missing_view" => Self::MissingView { view: other?.view },
            "struck_too_fast" => {
                Self::StruckTooFast { recording: recording(1), factor: Positive::try_from(1.05).ok()? }
            }
            "swapped_files" => Self::SwappedFiles { recordings: [recording(0), other?.recording.clone()] },
            "covered_body" => {
                Self::CoveredBody { recording: recording(2), body: 2, from_s: 2e-3, until_s: 4e-3 }
            }
            "dropped_frames" => {
                Self::DroppedFrames { recording: recording(3), first_frame: 100, n_frames: 12 }
            }
            "wrong_rate" => Self::WrongRate { recording: recording(4), header_rate_hz: 0.96 * rate_hz },
            _ => return None,
        })
    }

    /// What a report has to say for the fault to count as named: the recording, or the first one of a view.
    pub fn subject(&self, trials: &[Trial]) -> Option<String> {
        match self {
            Self::MissingView { view } => {
                trials.iter().find(|trial| trial.view == *view).map(|trial| trial.recording.clone())
            }
            _ => self.recordings().first().map(|name| (*name).clone()),
        }
    }

    /// As in the experiment file.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::TruncatedFile { .. } => "truncated_file",
            Self::MissingView { .. } => "missing_view",
            Self::StruckTooFast { .. } => "struck_too_fast",
            Self::SwappedFiles { .. } => "swapped_files",
            Self::CoveredBody { .. } => "covered_body",
            Self::DroppedFrames { .. } => "dropped_frames",
            Self::WrongRate { .. } => "wrong_rate",
        }
    }
}
