//! What a recording format is to this crate: a name, how its files are recognised, and how they are opened.

use std::path::Path;

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
}
