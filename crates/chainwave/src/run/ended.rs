//! What became of a striker velocity, and how far it went.

use chainwave_experiment::{Evaluation, RecordingState, Setup};

use crate::error::Error;

/// What became of a striker velocity.
pub(super) struct Done {
    /// Of every recording.
    pub(super) states: Vec<RecordingState>,
    pub(super) end: End,
}

/// How far it went.
pub(super) enum End {
    /// To its report.
    Evaluated(Box<Evaluated>),
    /// The tracks are written and could not be evaluated; the reason was named.
    Unsolved(String),
    /// There are not even tracks, or the experiment makes no sense; the reason is yet to be named.
    Nothing(Error),
}

/// What was found, and with which settings.
pub(super) struct Evaluated {
    pub(super) setup: Setup,
    pub(super) evaluation: Evaluation,
}
