//! Why something could not be done, as Python exceptions: `chainwave.ChainwaveError`, or `chainwave.MissingFileError` of a file that is not
//! there.

use std::error::Error;
use std::io;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;

/// Why something could not be done.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// What the library refuses.
    #[error(transparent)]
    Experiment(#[from] chainwave_experiment::Error),
    /// Reading a recording.
    #[error(transparent)]
    Camera(#[from] chainwave_camera::CameraError),
    /// Reading pixels.
    #[error(transparent)]
    Read(#[from] chainwave_measurement::ReadError),
    /// Matching, and names of its methods.
    #[error(transparent)]
    Correlation(#[from] chainwave_correlation::CorrelationError),
    /// Simulating.
    #[error(transparent)]
    Mechanics(#[from] chainwave_mechanics::MechanicsError),
    /// Joining views and trials.
    #[error(transparent)]
    Stitching(#[from] chainwave_stitching::StitchingError),
    /// Measuring a motion.
    #[error(transparent)]
    Analysis(#[from] chainwave_analysis::AnalysisError),
    /// Fitting a chain.
    #[error(transparent)]
    Fit(#[from] chainwave_inference::FitError),
    /// Fitting a contact law.
    #[error(transparent)]
    Contact(#[from] chainwave_inference::contact_fit::ContactFitError),
    /// Drawing.
    #[error(transparent)]
    Figure(#[from] chainwave_figures::FigureError),
    /// An argument that makes no sense: what was expected and found.
    #[error("{0}")]
    Argument(String),
    /// A file that cannot be read.
    #[error("{}: cannot read: {source}", path.display())]
    File {
        /// The file.
        path: std::path::PathBuf,
        /// The system's answer.
        source: io::Error,
    },
}

impl Failure {
    /// Whether a file is not there.
    fn is_missing_file(&self) -> bool {
        let mut cause: Option<&(dyn Error + 'static)> = Some(self);
        while let Some(error) = cause {
            if let Some(error) = error.downcast_ref::<io::Error>() {
                return error.kind() == io::ErrorKind::NotFound;
            }
            cause = error.source();
        }
        false
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        static USUAL: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        static MISSING: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let (known, name) = match failure.is_missing_file() {
            true => (&MISSING, "MissingFileError"),
            false => (&USUAL, "ChainwaveError"),
        };
        let message = failure.to_string();
        Python::attach(|py| match known.import(py, "chainwave._errors", name) {
            Ok(class) => PyErr::from_type(class.clone(), message),
            Err(_not_installed) => PyRuntimeError::new_err(message),
        })
    }
}
