//! Why an experiment cannot be read, tracked, evaluated or filmed.

use std::path::{Path, PathBuf};

/// Why nothing, or not all, could be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A configuration that does not parse or makes no sense; the message points at the line.
    #[error("{}: {message}", path.display())]
    Configuration {
        /// The file.
        path: PathBuf,
        /// Line, column, what was expected and found.
        message: String,
    },
    /// A cell or column of an input table.
    #[error("{}, {place}: expected {expected}, found {found}", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// Line and column.
        place: String,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A file or folder that cannot be read.
    #[error("{}: cannot {action}: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The system's answer.
        source: std::io::Error,
    },
    /// A value of the experiment that makes no sense beside another.
    #[error("{0}")]
    Value(String),
    /// A recording that was left out before it was tracked.
    #[error("{recording} is left out: {reason}")]
    LeftOut {
        /// Its name in the trials table.
        recording: String,
        /// What contradicts the experiment.
        reason: String,
    },
    /// No input could be used; each reason was named before.
    #[error("{what}: none of {n} could be used (the reasons are named above)")]
    NothingLeft {
        /// What the inputs are.
        what: &'static str,
        /// How many there were.
        n: usize,
    },
    /// A store of tracks that cannot be read or written.
    #[error("{0}")]
    Store(Box<dyn std::error::Error + Send + Sync>),
    /// The caller asked to stop; what was tracked or filmed by then is kept.
    #[error("stopped{}: what was finished is kept", after(*n_done, *n))]
    Cancelled {
        /// Recordings that were gone through; none where that is not known.
        n_done: usize,
        /// Recordings in all.
        n: usize,
    },
    /// Reading a recording.
    #[error(transparent)]
    Camera(#[from] chainwave_camera::CameraError),
    /// Reading pixels.
    #[error(transparent)]
    Read(#[from] chainwave_measurement::ReadError),
    /// Tracking.
    #[error(transparent)]
    Correlation(#[from] chainwave_correlation::CorrelationError),
    /// Joining views and trials.
    #[error(transparent)]
    Stitching(#[from] chainwave_stitching::StitchingError),
    /// Simulating.
    #[error(transparent)]
    Mechanics(#[from] chainwave_mechanics::MechanicsError),
    /// Filming a synthetic chain.
    #[error(transparent)]
    Synthetic(#[from] chainwave_synthetic::SyntheticError),
    /// Evaluating a motion.
    #[error(transparent)]
    Analysis(#[from] chainwave_analysis::AnalysisError),
    /// Fitting.
    #[error(transparent)]
    Fit(#[from] chainwave_inference::FitError),
}

impl Error {
    /// Wraps an input error with its file.
    pub(crate) fn file(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::File { path, action, source }
    }
}

/// How far something went before it was stopped, where that is known.
fn after(n_done: usize, n: usize) -> String {
    match n_done {
        0 => String::new(),
        n_done => format!(" after {n_done} of {n} recordings"),
    }
}
