use std::path::{Path, PathBuf};

/// Why a command could do nothing (exit code 2).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum Error {
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
    /// A file or folder that cannot be read or written.
    #[error("{}: cannot {action}: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The system's answer.
        source: std::io::Error,
    },
    /// A table that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What the table library says.
        source: polars::error::PolarsError,
    },
    /// An option that makes no sense here.
    #[error("{0}")]
    Argument(String),
    /// No input could be used; each reason was named before.
    #[error("{what}: none of {n} could be used (the reasons are named above)")]
    NothingLeft {
        /// What the inputs are.
        what: &'static str,
        /// How many there were.
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
    Fit(#[from] chainwave_analysis::fit::FitError),
    /// Drawing.
    #[error(transparent)]
    Figure(#[from] chainwave_figures::FigureError),
}

impl Error {
    /// Wraps an input or output error with its file.
    pub(crate) fn file(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::File { path, action, source }
    }

    /// Wraps a table error with its file.
    pub(crate) fn table(path: &Path) -> impl FnOnce(polars::error::PolarsError) -> Self {
        let path = path.to_owned();
        move |source| Self::Table { path, source }
    }
}
