//! What a request that cannot be answered is told.

use chainwave_measurement::ReadError;
use serde::Serialize;

/// Why a request is refused, in the terms of every other message: place, expected, found, hint.
#[derive(Debug, Serialize)]
pub(crate) struct Refusal {
    /// The status of HTTP.
    #[serde(skip)]
    pub(crate) status: u16,
    /// The address without its query, or the file.
    pub(crate) path: String,
    pub(crate) expected: String,
    pub(crate) found: String,
    pub(crate) hint: String,
}

impl Refusal {
    pub(crate) fn new(
        status: u16,
        path: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        let (path, expected, found) = (path.into(), expected.into(), found.into());
        Self { status, path, expected, found, hint: String::new() }
    }

    #[must_use]
    pub(crate) fn with_hint(self, hint: impl Into<String>) -> Self {
        Self { hint: hint.into(), ..self }
    }

    /// Something about a file that no request can mend.
    pub(crate) fn of_file(path: &std::path::Path, error: &impl std::error::Error) -> Self {
        Self::new(500, path.display().to_string(), "a readable file", error.to_string())
    }
}

impl From<ReadError> for Refusal {
    fn from(error: ReadError) -> Self {
        let status = match error {
            ReadError::FrameOutside { .. } => 404,
            ReadError::RegionOutside { .. } => 400,
            _ => 500,
        };
        Self::new(status, "", "pixels", error.to_string())
    }
}
