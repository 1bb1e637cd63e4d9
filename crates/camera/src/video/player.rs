//! A video as a recording: frames decoded in order, the last of them kept.

use std::path::Path;

use chainwave_measurement::Region;

use super::container::{self, Cut};
use super::deep::DeepDecoder;
use super::layout::CodecLayout;
use super::timing;
use crate::cache::FrameCache;
use crate::error::CameraError;
use crate::file_recording::{FileRecording, PixelSource, without_camera};
use crate::format::Opened;
use crate::library::{OpenedVideo, VideoFrames, VisionLibrary};
use crate::options::OpenOptions;
use crate::partial;
use crate::picture::{Gray, PictureShape};

/// Memory for frames that are kept, so that going back costs a decoding from the start only once in many frames.
const KEPT_BYTES: usize = 64 << 20;

/// A compressed frame takes at least this many bytes of a file, its entry in the container's index alone.
const LEAST_FRAME_BYTES: u64 = 8;

/// Opens a video of a named container.
pub(super) fn open(
    path: &Path,
    container: &str,
    library: &dyn VisionLibrary,
    options: &OpenOptions,
) -> Opened {
    let failed = |reason: String| CameraError::Decoder { path: path.into(), reason };
    let cut = container::cut(path)?;
    let opened = library.open_video(path).map_err(|reason| unopened(path, cut.as_ref(), reason))?;
    let OpenedVideo { size_px, rate_hz: stated_hz, n_stated, layout, mut frames } = opened;
    let (width_px, height_px) = size_px;
    let n_stated = believable(path, n_stated)?;
    // Frames that the file does not hold any more are still counted by its header.
    let n_frames = match n_stated {
        Some(n_stated) if cut.is_none() && !options.partial => n_stated,
        _ => {
            let n_decoded = count(frames.as_mut()).map_err(failed)?;
            cut.as_ref().map_or(n_decoded, |cut| cut.n_whole(n_decoded))
        }
    };
    if n_frames == 0 {
        return Err(unopened(path, cut.as_ref(), "expected frames that can be decoded, found none".into()));
    }
    let layout = CodecLayout::of(layout);
    let (bit_depth, remark) = depth(layout);
    let timing = timing(0..n_frames as u64, options, stated_hz);
    let mut remarks = vec![remark.into()];
    if cut.is_some() || n_stated.is_some_and(|n_stated| n_frames < n_stated) {
        remarks.push(partial::warning(n_frames, n_stated));
    }
    let shape = PictureShape { width_px, height_px, bits: bit_depth };
    let info = without_camera(format!("{container} video"), shape, timing, remarks);
    let player = Player::new(in_depth(path, layout, frames, size_px)?, size_px, bit_depth);
    let n_kept = KEPT_BYTES / (size_of::<u16>() * width_px * height_px).max(1);
    let video = Video(FrameCache::of_frames(player, n_kept));
    video.0.get_run(0, |player, n_kept| player.run(0, n_kept)).map_err(failed)?;
    Ok(Box::new(FileRecording::new(path, info, video, options)))
}

/// The number of frames that the container states; `None` where it states none that the file's size allows.
fn believable(path: &Path, n_stated: f64) -> Result<Option<usize>, CameraError> {
    let about = std::fs::metadata(path).map_err(|source| CameraError::Io { path: path.into(), source })?;
    let is_possible = (1.0..(about.len() / LEAST_FRAME_BYTES) as f64).contains(&n_stated);
    Ok(is_possible.then_some(n_stated as usize))
}

/// The number of frames that can be decoded, by decoding them; the video then stands at its start again.
fn count(frames: &mut dyn VideoFrames) -> Result<usize, String> {
    let mut n_frames = 0;
    while frames.advance()? {
        n_frames += 1;
    }
    frames.rewind()?;
    Ok(n_frames)
}

/// Why a video could not be opened: it ends before its container does, or what the decoder says.
fn unopened(path: &Path, cut: Option<&Cut>, reason: String) -> CameraError {
    match cut {
        Some(cut) => CameraError::Truncated {
            path: path.into(),
            what: "video of which nothing can be decoded".into(),
            offset: 0,
            expected: cut.stated_bytes,
            found: cut.file_bytes,
        },
        None => CameraError::Decoder { path: path.into(), reason },
    }
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

/// Frames and the place that they stand at.
struct Player {
    frames: Box<dyn VideoFrames>,
    /// Columns and rows.
    size_px: (usize, usize),
    /// Significant bits of a pixel.
    bits: u32,
    /// The frame that comes next; `None` where the end or a failure has left no frame to go on from.
    next: Option<usize>,
}

impl Player {
    fn new(frames: Box<dyn VideoFrames>, size_px: (usize, usize), bits: u32) -> Self {
        Self { frames, size_px, bits, next: Some(0) }
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
                run.push(self.picture()?);
            }
        }
        self.next = Some(frame + 1);
        Ok(run)
    }

    /// The frame gone on to last.
    fn picture(&mut self) -> Result<Gray, String> {
        let counts = self.frames.picture()?;
        let ((width_px, height_px), bits) = (self.size_px, self.bits);
        if counts.len() != width_px * height_px {
            let found = counts.len();
            return Err(format!("expected a picture of {width_px} x {height_px} px, found {found} pixels"));
        }
        Ok(Gray { width_px, height_px, bits, counts })
    }
}

/// The library's frames where they keep the codec's depth, else FFmpeg's own.
fn in_depth(
    path: &Path,
    layout: CodecLayout,
    frames: Box<dyn VideoFrames>,
    size_px: (usize, usize),
) -> Result<Box<dyn VideoFrames>, CameraError> {
    match layout {
        CodecLayout::Eight => Ok(frames),
        CodecLayout::Deep { bits } => Ok(Box::new(DeepDecoder::open(path, size_px, bits)?)),
        CodecLayout::DeepColour => Err(CameraError::Colour {
            path: path.into(),
            reason: "a video of more than 8 bits without a plane of brightness".into(),
        }),
    }
}

/// Significant bits of a pixel, and what a careful reader should know of them.
fn depth(layout: CodecLayout) -> (u32, &'static str) {
    match layout {
        CodecLayout::Deep { bits } => (
            bits,
            "the pixels are the codec's brightness, at its depth; all of its bits are taken for significant",
        ),
        CodecLayout::Eight | CodecLayout::DeepColour => {
            (8, "frames are decoded to 8-bit gray, which the compression may have altered")
        }
    }
}
