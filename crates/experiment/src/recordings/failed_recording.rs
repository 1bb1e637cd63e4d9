//! A recording that nothing could be had of.

use crate::configuration::Trial;
use crate::error::Error;

/// A recording that could not be tracked.
pub struct FailedRecording {
    /// Its row of the trials table.
    pub trial: Trial,
    /// Why.
    pub error: Error,
}
