//! Things that go wrong in a laboratory, for synthetic experiments.

use std::path::Path;

use chainwave_synthetic::{Cover, FileFaults};
use serde::{Deserialize, Serialize};

use crate::configuration::Trial;
use crate::error::Error;
use crate::numbers::Positive;

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

/// The faults of an experiment, asked by recording.
pub(super) struct Faults<'a>(pub(super) &'a [Fault]);

impl Faults<'_> {
    /// Refuses a fault of a recording or view that the trials table does not have; `path` is the experiment.
    pub(super) fn check(&self, trials: &[Trial], path: &Path) -> Result<(), Error> {
        let missing = |what: String| Error::Configuration {
            path: path.to_owned(),
            message: format!(
                "[[synthetic.faults]]: expected a recording or view of the trials table, found {what}"
            ),
        };
        for fault in self.0 {
            if let Fault::MissingView { view } = fault
                && trials.iter().all(|trial| trial.view != *view)
            {
                return Err(missing(format!("view {view}")));
            }
            let unknown = |name: &&&String| trials.iter().all(|trial| trial.recording != ***name);
            if let Some(name) = fault.recordings().iter().find(unknown) {
                return Err(missing(format!("\"{name}\"")));
            }
        }
        Ok(())
    }

    /// The kinds of a trial's faults, for its truth.
    pub(super) fn names(&self, trial: &Trial) -> String {
        let names: Vec<&str> = self.of(trial).map(Fault::name).collect();
        names.join(" ")
    }

    /// Whether a trial's recording is lost.
    pub(super) fn is_lost(&self, trial: &Trial) -> bool {
        self.of(trial).any(|fault| matches!(fault, Fault::MissingView { .. }))
    }

    /// Whether the trial is one that the experiment's mean motion is about.
    pub(super) fn is_sound(&self, trial: &Trial) -> bool {
        !self.is_lost(trial) && !self.of(trial).any(|fault| matches!(fault, Fault::StruckTooFast { .. }))
    }

    /// Factor on the striker's drawn velocity.
    pub(super) fn striker_factor(&self, trial: &Trial) -> f64 {
        let factor = |fault: &Fault| match fault {
            Fault::StruckTooFast { factor, .. } => Some(factor.get()),
            _ => None,
        };
        self.of(trial).filter_map(factor).product()
    }

    /// The name under which a trial's recording is kept.
    pub(super) fn file_name<'b>(&'b self, trial: &'b Trial) -> &'b str {
        let swapped = self.of(trial).find_map(|fault| match fault {
            Fault::SwappedFiles { recordings } => recordings.iter().find(|name| **name != trial.recording),
            _ => None,
        });
        swapped.unwrap_or(&trial.recording)
    }

    /// What hides bodies in a trial.
    pub(super) fn covers(&self, trial: &Trial) -> Vec<Cover> {
        let cover = |fault: &Fault| match fault {
            Fault::CoveredBody { body, from_s, until_s, .. } => {
                Some(Cover { body: *body, from_s: *from_s, until_s: *until_s })
            }
            _ => None,
        };
        self.of(trial).filter_map(cover).collect()
    }

    /// What is wrong with a trial's file.
    pub(super) fn of_file(&self, trial: &Trial) -> FileFaults {
        let mut faults = FileFaults::default();
        for fault in self.of(trial) {
            match fault {
                Fault::TruncatedFile { kept_fraction, .. } => faults.kept_fraction = Some(*kept_fraction),
                Fault::DroppedFrames { first_frame, n_frames, .. } => {
                    faults.dropped_frames = Some(*first_frame..first_frame.saturating_add(*n_frames));
                }
                Fault::WrongRate { header_rate_hz, .. } => faults.header_rate_hz = Some(*header_rate_hz),
                _ => {}
            }
        }
        faults
    }

    fn of(&self, trial: &Trial) -> impl Iterator<Item = &Fault> {
        self.0.iter().filter(|fault| match fault {
            Fault::MissingView { view } => *view == trial.view,
            _ => fault.recordings().contains(&&trial.recording),
        })
    }
}

impl Fault {
    fn recordings(&self) -> Vec<&String> {
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
    fn name(&self) -> &'static str {
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
