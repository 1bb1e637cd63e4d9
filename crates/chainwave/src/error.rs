//! Why a command could do nothing (exit code 2).

use std::path::{Path, PathBuf};

use chainwave_camera::CameraError;

/// Why a command could do nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum Error {
    /// What the library refuses: configurations, input tables, recordings, stages of an experiment.
    #[error("{0}{hint}", hint = hint_of(.0))]
    Experiment(#[from] chainwave_experiment::Error),
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
        source: polars_core::error::PolarsError,
    },
    /// A choice among methods of which OpenCV does some, in a program that is without it.
    #[error("a choice among all methods takes OpenCV, which this program is without")]
    ChoiceWithOpenCv,
    /// An option that makes no sense here.
    #[error("{0}")]
    Argument(String),
    /// Reading a recording.
    #[error("{0}{hint}", hint = hint_of_recording(.0))]
    Camera(#[from] CameraError),
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
    /// Serving a page.
    #[error(transparent)]
    View(#[from] chainwave_view::ViewError),
    /// Drawing.
    #[error(transparent)]
    Figure(#[from] chainwave_figures::FigureError),
}

/// What helps against an error of the library, by an option that it does not know.
pub(crate) fn hint_of(error: &chainwave_experiment::Error) -> &'static str {
    match error {
        chainwave_experiment::Error::Camera(error) => hint_of_recording(error),
        _ => "",
    }
}

fn hint_of_recording(error: &CameraError) -> &'static str {
    match error {
        CameraError::Truncated { .. } => {
            " (hint: --partial of inspect, track and run takes the frames of it that are whole)"
        }
        CameraError::UnknownFormat { found, .. } if found.starts_with("bytes") => {
            " (hint: --raw WxHxBITS of inspect, track and correlate states the geometry of pixels without a header)"
        }
        _ => "",
    }
}

impl Error {
    /// Wraps an input or output error with its file.
    pub(crate) fn file(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::File { path, action, source }
    }

    /// Wraps a table error with its file.
    pub(crate) fn table(path: &Path) -> impl FnOnce(polars_core::error::PolarsError) -> Self {
        let path = path.to_owned();
        move |source| Self::Table { path, source }
    }

    /// A configuration that does not parse or makes no sense; the message points at the line.
    pub(crate) fn configuration(path: &Path, message: String) -> Self {
        chainwave_experiment::Error::Configuration { path: path.to_owned(), message }.into()
    }

    /// A place in an input file that holds something else than expected.
    pub(crate) fn place(path: &Path, place: &str, expected: &str, found: &str) -> Self {
        chainwave_experiment::Error::Cell {
            path: path.to_owned(),
            place: place.into(),
            expected: expected.into(),
            found: found.into(),
        }
        .into()
    }

    /// Whether the user asked to stop.
    pub(crate) fn is_interruption(&self) -> bool {
        matches!(self, Self::Experiment(chainwave_experiment::Error::Cancelled { .. }))
    }

    /// Whether it ends whatever else there is to do, as no input can help it: the user asked to stop, the program with OpenCV is to take over, or
    /// the disk gives or takes nothing.
    pub(crate) fn ends_all(&self) -> bool {
        self.is_interruption()
            || self.needs_opencv()
            || matches!(self, Self::File { .. } | Self::Table { .. })
    }

    /// No input could be used; each reason was named before.
    pub(crate) fn nothing_left(what: &'static str, n: usize) -> Self {
        chainwave_experiment::Error::NothingLeft { what, n }.into()
    }
}
