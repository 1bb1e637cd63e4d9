//! What contradicts an experiment, and the recordings that it leaves out.

use std::fmt;

use crate::configuration::Trial;

/// Something that contradicts what the experiment states; the work can go on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Its kind, in a word for programs.
    pub code: &'static str,
    /// What it is about: a key of the configuration, a view, recordings.
    pub subject: String,
    /// What was expected and found, with numbers, and what may be behind it.
    pub text: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.subject, self.text)
    }
}

impl Finding {
    /// Sentences of one kind, about one subject.
    pub(crate) fn all_of(
        code: &'static str,
        subject: &str,
        texts: impl IntoIterator<Item = String>,
    ) -> Vec<Self> {
        let of = |text| Self { code, subject: subject.to_owned(), text };
        texts.into_iter().map(of).collect()
    }
}

/// A recording that can be read and has no part in the motion.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOutRecording {
    /// Its name in the trials table.
    pub recording: String,
    /// Why.
    pub reason: String,
}

impl LeftOutRecording {
    /// Each of some trials, for one reason.
    pub fn each_of<'t>(trials: impl IntoIterator<Item = &'t Trial>, reason: &str) -> Vec<Self> {
        let of = |trial: &Trial| Self { recording: trial.recording.clone(), reason: reason.to_owned() };
        trials.into_iter().map(of).collect()
    }
}

/// What was found before work.
#[derive(Debug, Clone, Default)]
pub struct Sanity {
    /// What contradicts the experiment.
    pub findings: Vec<Finding>,
    /// Recordings that are not to be tracked, and why.
    pub left_out: Vec<LeftOutRecording>,
}

impl Sanity {
    /// Why a recording is left out, where it is.
    pub(crate) fn reason(&self, recording: &str) -> Option<&str> {
        self.left_out.iter().find(|one| one.recording == recording).map(|one| one.reason.as_str())
    }

    /// Leaves out all recordings of a view.
    pub(crate) fn leave_out(&mut self, trials: &[Trial], reason: &str) {
        self.left_out.extend(LeftOutRecording::each_of(trials, reason));
    }
}
