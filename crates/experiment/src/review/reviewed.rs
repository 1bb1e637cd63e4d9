//! What is reviewed.

use crate::tracks::RecordingTracks;

/// The tracks of one recording, for a review.
#[derive(Clone, Copy)]
pub struct ReviewedRecording<'a> {
    /// Name of the recording.
    pub recording: &'a str,
    /// Number of its view: recordings of one view show the same bodies in the same places.
    pub view: u32,
    /// The tracks.
    pub tracks: &'a RecordingTracks,
}
