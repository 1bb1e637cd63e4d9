//! Errors that readings of several tracks have in common, as what lies on a sensor makes them in every trial.

use crate::ErrorSource;

/// An error that readings of several tracks share, with a random amplitude of unit variance. It is no part of their sigmas.
#[derive(Debug, Clone, PartialEq)]
pub struct SharedReadingError {
    /// Where it comes from.
    pub source: ErrorSource,
    /// What one standard deviation of it makes of each track that has it.
    pub of_tracks: Vec<TrackDeviation>,
}

/// The part of an error that one track has.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackDeviation {
    /// Name of the recording.
    pub recording: String,
    /// Number of the body.
    pub body: usize,
    /// Error of the position in metres, frame by frame.
    pub error_m: Vec<f64>,
}
