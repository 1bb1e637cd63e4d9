//! Why a recording could not be synthesized.

use std::path::PathBuf;

/// Why a recording could not be synthesized.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SyntheticError {
    /// A setting has a value that no camera, specimen or trial can have.
    #[error("setting `{name}`: expected {expected}, found {found}")]
    Setting {
        /// The setting, with the struct it stands in.
        name: &'static str,
        /// What was expected.
        expected: &'static str,
        /// The value that was given.
        found: String,
    },
    /// The motion is not a proper table of samples.
    #[error("motion: expected {expected}, found {found}")]
    Motion {
        /// What was expected.
        expected: &'static str,
        /// What was given.
        found: String,
    },
    /// A frame lies after the end of the motion.
    #[error(
        "frame {frame} is exposed {needed_s:.6e} s after the impact: expected a motion at least that long, found \
         samples up to {last_s:.6e} s (simulate longer, or film fewer frames)"
    )]
    MotionTooShort {
        /// The frame.
        frame: usize,
        /// Time of the frame after the impact.
        needed_s: f64,
        /// Time of the last sample of the motion.
        last_s: f64,
    },
    /// A frame outside the recording was asked for.
    #[error("frame {frame}: expected a frame below {n_frames}")]
    FrameOutside {
        /// The frame asked for.
        frame: usize,
        /// Frames in the recording.
        n_frames: usize,
    },
    /// The recording could not be written.
    #[error("{}: cannot write the recording: {source}", path.display())]
    Write {
        /// The recording.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}
