//! Video of 8 bits, decoded by OpenCV's videoio.

use std::path::{Path, PathBuf};

use opencv::core::Mat;
use opencv::prelude::*;
use opencv::{imgproc, videoio};

use super::frames::Frames;
use super::layout::CodecLayout;
use crate::picture::Gray;

/// A compressed frame takes at least this many bytes of a file, its entry in the container's index alone.
const LEAST_FRAME_BYTES: u64 = 8;

/// OpenCV's decoder, whose pictures are gray of eight bits, or are made so.
pub(super) struct VideoDecoder {
    path: PathBuf,
    capture: videoio::VideoCapture,
    /// Width and height.
    size_px: (usize, usize),
}

impl VideoDecoder {
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        let capture = capture(path)?;
        let side = |property| capture.get(property).map(|side| side as usize).map_err(message);
        let size_px = (side(videoio::CAP_PROP_FRAME_WIDTH)?, side(videoio::CAP_PROP_FRAME_HEIGHT)?);
        Ok(Self { path: path.into(), capture, size_px })
    }

    /// How the codec keeps its pixels.
    pub(super) fn layout(&self) -> Result<CodecLayout, String> {
        let code = self.capture.get(videoio::CAP_PROP_CODEC_PIXEL_FORMAT).map_err(message)?;
        Ok(CodecLayout::of((code as i64 as u32).to_le_bytes()))
    }

    /// Width and height.
    pub(super) fn size_px(&self) -> (usize, usize) {
        self.size_px
    }

    pub(super) fn rate_hz(&self) -> Result<f64, String> {
        let rate_hz = self.capture.get(videoio::CAP_PROP_FPS).map_err(message)?;
        let is_rate = rate_hz.is_finite() && rate_hz > 0.0;
        is_rate.then_some(rate_hz).ok_or_else(|| format!("expected a frame rate above 0, found {rate_hz}"))
    }

    /// The number of frames that the container states; `None` where it states none that its size allows.
    pub(super) fn n_stated(&self) -> Result<Option<usize>, String> {
        let stated = self.capture.get(videoio::CAP_PROP_FRAME_COUNT).map_err(message)?;
        let file_bytes = std::fs::metadata(&self.path).map_err(|error| error.to_string())?.len();
        let is_possible = (1.0..(file_bytes / LEAST_FRAME_BYTES) as f64).contains(&stated);
        Ok(is_possible.then_some(stated as usize))
    }

    /// The number of frames that can be decoded, by decoding them.
    pub(super) fn count(&self) -> Result<usize, String> {
        let mut counter = capture(&self.path)?;
        let mut n_frames = 0;
        while counter.grab().map_err(message)? {
            n_frames += 1;
        }
        Ok(n_frames)
    }
}

impl Frames for VideoDecoder {
    fn rewind(&mut self) -> Result<(), String> {
        self.capture = capture(&self.path)?;
        Ok(())
    }

    fn advance(&mut self) -> Result<bool, String> {
        self.capture.grab().map_err(message)
    }

    fn picture(&mut self) -> Result<Gray, String> {
        let gray = retrieved(&mut self.capture)?;
        let size_px = (gray.cols() as usize, gray.rows() as usize);
        if size_px != self.size_px {
            return Err(format!("expected a picture of {:?} px, found {size_px:?}", self.size_px));
        }
        let counts = gray.data_typed::<u8>().map_err(message)?.iter().map(|&count| count.into()).collect();
        Ok(Gray { width_px: size_px.0, height_px: size_px.1, bits: 8, counts })
    }
}

fn capture(path: &Path) -> Result<videoio::VideoCapture, String> {
    // Left to choose, OpenCV also tries backends that take a path for a pattern or a pipeline.
    let has_ffmpeg = videoio::has_backend(videoio::VideoCaptureAPIs::CAP_FFMPEG).map_err(message)?;
    let backend = if has_ffmpeg { videoio::CAP_FFMPEG } else { videoio::CAP_ANY };
    let capture = videoio::VideoCapture::from_file(path, backend).map_err(message)?;
    if !capture.is_opened().map_err(message)? {
        return Err("expected a video that OpenCV can decode, found none".into());
    }
    Ok(capture)
}

/// The frame that was grabbed last, in gray.
fn retrieved(capture: &mut videoio::VideoCapture) -> Result<Mat, String> {
    let mut picture = Mat::default();
    capture.retrieve_def(&mut picture).map_err(message)?;
    let to_gray = match picture.channels() {
        1 => return Ok(picture),
        3 => imgproc::COLOR_BGR2GRAY,
        4 => imgproc::COLOR_BGRA2GRAY,
        other => return Err(format!("expected pictures of 1, 3 or 4 channels, found {other}")),
    };
    let mut gray = Mat::default();
    imgproc::cvt_color_def(&picture, &mut gray, to_gray).map_err(message)?;
    Ok(gray)
}

fn message(error: opencv::Error) -> String {
    error.message
}
