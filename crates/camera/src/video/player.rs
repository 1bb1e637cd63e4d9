use std::path::Path;

use chainwave_measurement::{RecordingInfo, Region};

use super::decoder::Decoder;
use super::deep::DeepDecoder;
use super::layout::Layout;
use crate::cache::FrameCache;
use crate::file_recording::{FileRecording, PixelSource};
use crate::picture::Gray;
use crate::{CameraError, OpenOptions, Opened};

/// Memory for frames that are kept, so that going back costs a decoding from the start only once in many frames.
const KEPT_BYTES: usize = 64 << 20;

/// Opens a video of a named container.
pub(super) fn open(path: &Path, container: &str, options: &OpenOptions) -> Opened {
    let failed = |reason: String| CameraError::Decoder { path: path.into(), reason };
    let decoder = Decoder::open(path).map_err(failed)?;
    let stated_hz = decoder.rate_hz().map_err(failed)?;
    let rate_hz = options.rate_hz.unwrap_or(stated_hz);
    let (width_px, height_px) = decoder.size_px();
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
    let player = Player::new(frames(path, layout, decoder, (width_px, height_px))?);
    let n_kept = KEPT_BYTES / (size_of::<u16>() * width_px * height_px).max(1);
    let video = Video(FrameCache::of_frames(player, n_kept));
    video.0.get_run(0, |player, n_kept| player.run(0, n_kept)).map_err(failed)?;
    Ok(Box::new(FileRecording::new(path, info, video, options)))
}

/// A video, of which the last frames are kept: all regions of a frame cost one decoding.
struct Video(FrameCache<Player, Gray>);

impl PixelSource for Video {
    fn read(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<u64, String> {
        self.0.get_run(frame, |player, n_kept| player.run(frame, n_kept))?.copy(region, pixels);
        Ok(0)
    }

    fn is_sequential(&self) -> bool {
        true
    }
}

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

    /// Frame `frame` and those passed on the way to it, `n_most` at most.
    fn run(&mut self, frame: usize, n_most: usize) -> Result<Vec<Gray>, String> {
        let next = self.next.take().filter(|&next| next <= frame);
        if next.is_none() {
            self.frames.rewind()?;
        }
        let mut run = Vec::new();
        for passed in next.unwrap_or(0)..=frame {
            if !self.frames.advance()? {
                return Err(format!("expected a frame {passed}, found the end of the video"));
            }
            if passed + n_most > frame {
                run.push(self.frames.picture()?);
            }
        }
        self.next = Some(frame + 1);
        Ok(run)
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
