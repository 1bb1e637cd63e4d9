//! Videos decoded by OpenCV's videoio, their pictures gray of eight bits or made so.

use std::path::{Path, PathBuf};

use chainwave_camera::{OpenedVideo, VideoFrames};
use opencv::core::Mat;
use opencv::prelude::*;
use opencv::{imgproc, videoio};

/// Opens a video, with what the file says of itself.
pub(crate) fn open(path: &Path) -> Result<OpenedVideo, String> {
    let capture = capture(path)?;
    let property = |property| capture.get(property).map_err(message);
    let side = |side| property(side).map(|side| side as usize);
    let size_px = (side(videoio::CAP_PROP_FRAME_WIDTH)?, side(videoio::CAP_PROP_FRAME_HEIGHT)?);
    let layout = property(videoio::CAP_PROP_CODEC_PIXEL_FORMAT)? as i64 as u32;
    Ok(OpenedVideo {
        size_px,
        rate_hz: property(videoio::CAP_PROP_FPS)?,
        n_stated: property(videoio::CAP_PROP_FRAME_COUNT)?,
        layout: layout.to_le_bytes(),
        frames: Box::new(Decoder { path: path.into(), capture, size_px }),
    })
}

/// OpenCV's decoder.
struct Decoder {
    path: PathBuf,
    capture: videoio::VideoCapture,
    /// Width and height.
    size_px: (usize, usize),
}

impl VideoFrames for Decoder {
    fn rewind(&mut self) -> Result<(), String> {
        self.capture = capture(&self.path)?;
        Ok(())
    }

    fn advance(&mut self) -> Result<bool, String> {
        self.capture.grab().map_err(message)
    }

    fn picture(&mut self) -> Result<Vec<u16>, String> {
        let gray = retrieved(&mut self.capture)?;
        let size_px = (gray.cols() as usize, gray.rows() as usize);
        if size_px != self.size_px {
            return Err(format!("expected a picture of {:?} px, found {size_px:?}", self.size_px));
        }
        Ok(gray.data_typed::<u8>().map_err(message)?.iter().map(|&count| count.into()).collect())
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
