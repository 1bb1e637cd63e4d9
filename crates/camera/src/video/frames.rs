//! What a decoder of video does: frames one after the other, from the start.

use crate::picture::Gray;

/// Frames of a video that are decoded one after the other, because seeking in compressed video is not exact with
/// every codec.
pub(super) trait Frames: Send {
    /// Goes back to before the first frame.
    fn rewind(&mut self) -> Result<(), String>;
    /// Goes on to the next frame; false at the end of the video.
    fn advance(&mut self) -> Result<bool, String>;
    /// The frame gone on to last.
    fn picture(&mut self) -> Result<Gray, String>;
}
