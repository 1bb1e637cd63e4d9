//! What a library of computer vision does for this crate, where a program brings one: it decodes videos and finds boards.
//!
//! The crate itself links none, so that a program which reads plain recordings starts at once and builds without. Who brings one
//! registers it before anything is opened; without, videos and boards are refused with [`CameraError::NeedsOpenCv`].

use std::path::Path;
use std::sync::OnceLock;

use chainwave_measurement::Recording;

use crate::board::{Board, Corner};
use crate::error::CameraError;

/// A library that decodes videos and finds the corners of boards in pictures.
pub trait VisionLibrary: Send + Sync {
    /// Its version, such as `4.6.0`.
    fn version(&self) -> String;

    /// Opens a video at its first frame.
    ///
    /// # Errors
    /// What the library has against it.
    fn open_video(&self, path: &Path) -> Result<OpenedVideo, String>;

    /// The corners of a board that makes sense, in a frame; never none.
    ///
    /// # Errors
    /// [`CameraError`] where the board is not found, or the library cannot find such ones.
    fn find_corners(
        &self,
        recording: &dyn Recording,
        frame: usize,
        board: &Board,
    ) -> Result<Vec<Corner>, CameraError>;
}

/// A video that a library has opened, with what the file says of itself; none of it is believed.
pub struct OpenedVideo {
    /// Columns and rows of a frame.
    pub size_px: (usize, usize),
    /// Frames per second at which it is meant to be shown.
    pub rate_hz: f64,
    /// Frames that the container states.
    pub n_stated: f64,
    /// How the codec keeps its pixels, by FFmpeg's four letters.
    pub layout: [u8; 4],
    /// Its frames, gray of eight bits or made so.
    pub frames: Box<dyn VideoFrames>,
}

/// Frames of a video that are decoded one after the other, because seeking in compressed video is not exact with every codec.
pub trait VideoFrames: Send {
    /// Goes back to before the first frame.
    ///
    /// # Errors
    /// What the decoder says.
    fn rewind(&mut self) -> Result<(), String>;

    /// Goes on to the next frame; false at the end of the video.
    ///
    /// # Errors
    /// What the decoder says.
    fn advance(&mut self) -> Result<bool, String>;

    /// The counts of the frame gone on to last, row by row from the top.
    ///
    /// # Errors
    /// What the decoder says.
    fn picture(&mut self) -> Result<Vec<u16>, String>;
}

static LIBRARY: OnceLock<&'static dyn VisionLibrary> = OnceLock::new();

/// Brings a library. The first one stays.
pub fn register_vision(library: &'static dyn VisionLibrary) {
    LIBRARY.get_or_init(|| library);
}

/// The library that the program has brought.
pub fn vision_library() -> Option<&'static dyn VisionLibrary> {
    LIBRARY.get().copied()
}

/// The library, or the error that names what needs one.
pub(crate) fn needed(path: &Path, what: &'static str) -> Result<&'static dyn VisionLibrary, CameraError> {
    vision_library().ok_or_else(|| CameraError::NeedsOpenCv { path: path.into(), what })
}
