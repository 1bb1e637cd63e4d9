//! What a recording format is to this crate: a name, how its files are recognised, which these are, and how they are opened.

use std::path::{Path, PathBuf};

use chainwave_measurement::Recording;

use crate::candidate::Candidate;
use crate::error::CameraError;
use crate::options::OpenOptions;

/// A recording, or why it could not be opened.
pub(crate) type Opened = Result<Box<dyn Recording>, CameraError>;

/// A recording format: how to know it, and how to open it.
pub(crate) struct Format {
    pub(crate) name: &'static str,
    pub(crate) recognises: fn(&Candidate) -> bool,
    pub(crate) open: fn(&Path, &OpenOptions) -> Opened,
    /// The files that a recording consists of, as [`crate::files_of`] says.
    pub(crate) files: fn(&Path) -> Result<Vec<PathBuf>, CameraError>,
}

/// Of a recording that is one file.
pub(crate) fn itself(path: &Path) -> Result<Vec<PathBuf>, CameraError> {
    Ok(vec![path.into()])
}
