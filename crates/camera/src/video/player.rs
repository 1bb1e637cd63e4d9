use std::path::{Path, PathBuf};
use std::sync::Mutex;

use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region};

use super::decoder::Decoder;
use super::deep::DeepDecoder;
use super::layout::Layout;
use crate::{CameraError, OpenOptions};

/// Frames of a video that are decoded one after the other, because seeking in compressed video is not exact with
/// every codec.
pub(super) trait Frames: Send {
    /// Goes back to before the first frame.
    fn rewind(&mut self) -> Result<(), String>;
    /// Goes on to the next frame; false at the end of the video.
    fn advance(&mut self) -> Result<bool, String>;
    /// Copies a region of the frame gone on to last; the region lies in the frame and holds as many pixels as `pixels`.
    fn copy(&mut self, region: Region, pixels: &mut [f32]) -> Result<(), String>;
}

/// A video. The last decoded frame is kept, so that all regions of a frame cost one decoding.
pub(super) struct Video {
    path: PathBuf,
    info: RecordingInfo,
    player: Mutex<Player>,
}

impl Video {
    pub(super) fn open(path: &Path, container: &str, options: &OpenOptions) -> Result<Self, CameraError> {
        let failed = |reason: String| CameraError::Decoder { path: path.into(), reason };
        let decoder = Decoder::open(path).map_err(failed)?;
        let stated_hz = decoder.rate_hz().map_err(failed)?;
        let rate_hz = options.rate_hz.unwrap_or(stated_hz);
        let (width_px, height_px) = decoder.size_px().map_err(failed)?;
        let n_frames = decoder.n_frames().map_err(failed)?;
        let layout = decoder.layout().map_err(failed)?;
        let (bit_depth, remark) = depth(layout);
        let info = RecordingInfo {
            format: format!("{container} video"),
            width_px,
            height_px,
            n_frames,
            bit_depth,
            rate_hz: Some(rate_hz),
            times_s: (0..n_frames).map(|frame| frame as f64 / rate_hz).collect(),
            first_image: 0,
            camera: None,
            exposure_s: None,
            warnings: vec![
                format!(
                    "a video holds no trigger: t = 0 is its first frame, at {rate_hz} Hz; the file states {stated_hz} Hz"
                ),
                remark.into(),
            ],
        };
        let mut player = Player::new(frames(path, layout, decoder, (width_px, height_px))?);
        player.show(0).map_err(failed)?;
        Ok(Self { path: path.into(), info, player: Mutex::new(player) })
    }
}

impl Recording for Video {
    fn path(&self) -> &Path {
        &self.path
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        if region.n_pixels() == 0 {
            return Ok(());
        }
        let unreadable = |reason| ReadError::Unreadable { path: self.path.clone(), frame, reason };
        let mut player =
            self.player.lock().map_err(|_| unreadable("an earlier decoding was cut off".into()))?;
        player.show(frame).map_err(unreadable)?;
        player.frames.copy(region, pixels).map_err(unreadable)
    }
}

/// Frames and the place that they stand at.
struct Player {
    frames: Box<dyn Frames>,
    /// The frame that comes next; `None` where the end or a failure has left no frame to go on from.
    next: Option<usize>,
}

impl Player {
    fn new(frames: Box<dyn Frames>) -> Self {
        Self { frames, next: Some(0) }
    }

    /// Makes `frame` the one gone on to last.
    fn show(&mut self, frame: usize) -> Result<(), String> {
        let next = self.next.take().filter(|&next| next <= frame + 1);
        if next.is_none() {
            self.frames.rewind()?;
        }
        for passed in next.unwrap_or(0)..=frame {
            if !self.frames.advance()? {
                return Err(format!("expected a frame {passed}, found the end of the video"));
            }
        }
        self.next = Some(frame + 1);
        Ok(())
    }
}

/// OpenCV's frames where it keeps their depth, else FFmpeg's own.
fn frames(
    path: &Path,
    layout: Layout,
    decoder: Decoder,
    size_px: (usize, usize),
) -> Result<Box<dyn Frames>, CameraError> {
    match layout {
        Layout::Eight => Ok(Box::new(decoder)),
        Layout::Deep { bits } => Ok(Box::new(DeepDecoder::open(path, size_px, bits)?)),
        Layout::DeepColour => Err(CameraError::Colour {
            path: path.into(),
            reason: "a video of more than 8 bits without a plane of brightness".into(),
        }),
    }
}

/// Significant bits of a pixel, and what a careful reader should know of them.
fn depth(layout: Layout) -> (u32, &'static str) {
    match layout {
        Layout::Deep { bits } => (
            bits,
            "the pixels are the codec's brightness, at its depth; all of its bits are taken for significant",
        ),
        Layout::Eight | Layout::DeepColour => {
            (8, "frames are decoded to 8-bit gray, which the compression may have altered")
        }
    }
}
