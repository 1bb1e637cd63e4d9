use std::path::{Path, PathBuf};

use chainwave_measurement::Region;
use opencv::core::Mat;
use opencv::prelude::*;
use opencv::{imgproc, videoio};

use super::layout::Layout;
use super::player::Frames;

/// A compressed frame takes at least this many bytes of a file, its entry in the container's index alone.
const LEAST_FRAME_BYTES: u64 = 8;

/// OpenCV's decoder, whose pictures are gray of eight bits, or are made so.
pub(super) struct Decoder {
    path: PathBuf,
    capture: videoio::VideoCapture,
    /// The last frame, once a region of it was asked for.
    gray: Option<Mat>,
}

impl Decoder {
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        Ok(Self { path: path.into(), capture: capture(path)?, gray: None })
    }

    /// How the codec keeps its pixels.
    pub(super) fn layout(&self) -> Result<Layout, String> {
        let code = self.capture.get(videoio::CAP_PROP_CODEC_PIXEL_FORMAT).map_err(message)?;
        Ok(Layout::of((code as i64 as u32).to_le_bytes()))
    }

    /// Width and height.
    pub(super) fn size_px(&self) -> Result<(usize, usize), String> {
        let side = |property| self.capture.get(property).map(|side| side as usize).map_err(message);
        Ok((side(videoio::CAP_PROP_FRAME_WIDTH)?, side(videoio::CAP_PROP_FRAME_HEIGHT)?))
    }

    pub(super) fn rate_hz(&self) -> Result<f64, String> {
        let rate_hz = self.capture.get(videoio::CAP_PROP_FPS).map_err(message)?;
        let is_rate = rate_hz.is_finite() && rate_hz > 0.0;
        is_rate.then_some(rate_hz).ok_or_else(|| format!("expected a frame rate above 0, found {rate_hz}"))
    }

    /// The number of frames that the container states, or, where it states none that its size allows, as many as can
    /// be decoded.
    pub(super) fn n_frames(&self) -> Result<usize, String> {
        let stated = self.capture.get(videoio::CAP_PROP_FRAME_COUNT).map_err(message)?;
        let file_bytes = std::fs::metadata(&self.path).map_err(|error| error.to_string())?.len();
        if (1.0..(file_bytes / LEAST_FRAME_BYTES) as f64).contains(&stated) {
            return Ok(stated as usize);
        }
        let mut counter = capture(&self.path)?;
        let mut n_frames = 0;
        while counter.grab().map_err(message)? {
            n_frames += 1;
        }
        Ok(n_frames)
    }
}

impl Frames for Decoder {
    fn rewind(&mut self) -> Result<(), String> {
        self.gray = None;
        self.capture = capture(&self.path)?;
        Ok(())
    }

    fn advance(&mut self) -> Result<bool, String> {
        self.gray = None;
        self.capture.grab().map_err(message)
    }

    fn copy(&mut self, region: Region, pixels: &mut [f32]) -> Result<(), String> {
        let gray = match self.gray.take() {
            Some(gray) => gray,
            None => retrieved(&mut self.capture)?,
        };
        let gray = self.gray.insert(gray);
        let (width_px, height_px) = (gray.cols() as usize, gray.rows() as usize);
        if region.x + region.width > width_px || region.y + region.height > height_px {
            return Err(format!(
                "expected a picture as large as the first, found {width_px} x {height_px} px"
            ));
        }
        let rows = gray.data_typed::<u8>().map_err(message)?.chunks_exact(width_px).skip(region.y);
        for (row, target) in rows.zip(pixels.chunks_exact_mut(region.width)) {
            for (pixel, &count) in target.iter_mut().zip(&row[region.x..]) {
                *pixel = count.into();
            }
        }
        Ok(())
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
