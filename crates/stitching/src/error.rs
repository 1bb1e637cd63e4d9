//! Why observations could not be stitched, with the recording and what was expected.

/// Why observations could not be stitched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StitchingError {
    /// Nothing to stitch.
    #[error("stitching: expected at least one recording with a tracked body, found none")]
    Empty,
    /// No recording lasts from one common time to the next.
    #[error(
        "stitching: expected recordings that last for frames one after the other, each {frame_interval_s} s, found none among {n_recordings}"
    )]
    TooShort {
        /// Number of recordings.
        n_recordings: usize,
        /// The common frame interval, in seconds.
        frame_interval_s: f64,
    },
    /// A body number outside the chain.
    #[error("stitching: recording {recording}: expected bodies 1 to {n_bodies}, found body {body}")]
    BodyOutside {
        /// Name of the recording.
        recording: String,
        /// The body's number.
        body: usize,
        /// Bodies in the chain.
        n_bodies: usize,
    },
    /// Tracks and times differ in length, or the times do not increase or are far from the other recordings'.
    #[error("stitching: recording {recording}: expected {expected}, found {found}")]
    Inconsistent {
        /// Name of the recording.
        recording: String,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// No sample before the wave, so displacements have no origin.
    #[error(
        "stitching: recording {recording}, body {body}: expected frames at rest before {rest_until_s} s, found none \
         (hint: record pre-trigger frames, or set a later rest_until_s)"
    )]
    NoRest {
        /// Name of the recording.
        recording: String,
        /// The body's number.
        body: usize,
        /// End of the rest, in seconds after the trigger.
        rest_until_s: f64,
    },
    /// Readings and priors do not tell a body's motion at some time.
    #[error(
        "stitching: body {body} at {time_s} s: expected readings that tell its motion, found none in {recordings} (hint: look at the \
         stated uncertainty of these tracks)"
    )]
    Undetermined {
        /// The body's number.
        body: usize,
        /// The time on the common time base, in seconds.
        time_s: f64,
        /// Names of the recordings that saw it.
        recordings: String,
    },
    /// No response to the drive explains how recordings differ, and no two of them saw a body at one time, so that nothing is left to average.
    #[error(
        "stitching: expected recordings that agree, or two that saw a body at one time, found neither in {recordings} (hint: is one of \
         them mislabelled?)"
    )]
    Contradictory {
        /// Names of the recordings.
        recordings: String,
    },
    /// The least-squares problem of the alignment has no unique solution.
    #[error("stitching: the trigger offsets of {n_recordings} recordings could not be solved for")]
    Singular {
        /// Number of recordings.
        n_recordings: usize,
    },
    /// The least-squares problem of the stage positions has no unique solution.
    #[error(
        "stitching: the stage positions of {n_views} views could not be solved for from {n_steps} steps (hint: a step's sigma \
         must be above 0)"
    )]
    SingularStages {
        /// Number of views.
        n_views: usize,
        /// Number of steps between them.
        n_steps: usize,
    },
}
