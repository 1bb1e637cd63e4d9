use std::path::{Path, PathBuf};
use std::sync::Mutex;

use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region};
use opencv::core::{CV_16U, Mat};
use opencv::prelude::*;
use opencv::{imgproc, videoio};

use crate::{CameraError, OpenOptions};

/// A compressed frame takes at least this many bytes of a file, its entry in the container's index alone.
const LEAST_FRAME_BYTES: u64 = 8;

/// A video whose frames are decoded in their order.
///
/// The last decoded frame is kept, so that all regions of a frame cost one decoding. Going back means decoding
/// from the start, because seeking in compressed video is not exact with every codec.
pub(super) struct Video {
    path: PathBuf,
    info: RecordingInfo,
    decoder: Mutex<Decoder>,
}

impl Video {
    pub(super) fn open(path: &Path, container: &str, options: &OpenOptions) -> Result<Self, CameraError> {
        let failed = |reason: String| CameraError::Decoder { path: path.into(), reason };
        let mut decoder = Decoder::open(path).map_err(failed)?;
        decoder.show(0).map_err(failed)?;
        if let Some(bits) = decoder.cut_from() {
            return Err(CameraError::Unsupported {
                path: path.into(),
                what: format!("video of {bits} bits, which this OpenCV cuts to 8,"),
                hint: "save the frames as 16-bit images, for example ffmpeg -i VIDEO -pix_fmt gray16le frame_%05d.tif".into(),
            });
        }
        let stated_hz = decoder.rate_hz().map_err(failed)?;
        let rate_hz = options.rate_hz.unwrap_or(stated_hz);
        let n_frames = decoder.n_frames().map_err(failed)?;
        let info = RecordingInfo {
            format: format!("{container} video"),
            width_px: decoder.gray.cols() as usize,
            height_px: decoder.gray.rows() as usize,
            n_frames,
            bit_depth: decoder.stored.bit_depth(),
            rate_hz: Some(rate_hz),
            times_s: (0..n_frames).map(|frame| frame as f64 / rate_hz).collect(),
            first_image: 0,
            camera: None,
            exposure_s: None,
            warnings: vec![
                format!(
                    "a video holds no trigger: t = 0 is its first frame, at {rate_hz} Hz; the file states {stated_hz} Hz"
                ),
                decoder.stored.warning().into(),
            ],
        };
        Ok(Self { path: path.into(), info, decoder: Mutex::new(decoder) })
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
        let unreadable = |reason| ReadError::Unreadable { path: self.path.clone(), frame, reason };
        let mut decoder =
            self.decoder.lock().map_err(|_| unreadable("an earlier decoding was cut off".into()))?;
        decoder.show(frame).map_err(unreadable)?;
        decoder.copy(region, self.info.width_px, self.info.height_px, pixels).map_err(unreadable)
    }
}

/// How the codec keeps its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stored {
    /// Eight bits, gray or in colours.
    Eight,
    /// Gray of 16 bits, which OpenCV from 4.7 on hands on untouched where it is asked for the codec's own pixels.
    Gray16,
    /// More than eight bits in a layout that OpenCV would cut to eight.
    Deep { bits: u8 },
}

impl Stored {
    /// From FFmpeg's code of the layout: `Y1` and `Y3` with the bits of a component in the fourth byte, or the same backwards
    /// where the high byte comes first; other codes are of eight bits.
    fn of([first, second, third, fourth]: [u8; 4]) -> Self {
        match (first, second, third, fourth) {
            (b'Y', b'1', 0, 16) => Self::Gray16,
            (b'Y', b'1' | b'3' | b'4', _, bits @ 9..=16) | (bits @ 9..=16, _, b'1' | b'3' | b'4', b'Y') => {
                Self::Deep { bits }
            }
            _ => Self::Eight,
        }
    }

    fn bit_depth(self) -> u32 {
        if self == Self::Gray16 { 16 } else { 8 }
    }

    fn warning(self) -> &'static str {
        match self {
            Self::Gray16 => "the file does not say how many of its 16 bits are significant; all are assumed",
            _ => "frames are decoded to 8-bit gray, which the compression may have altered",
        }
    }
}

/// OpenCV's decoder and the frame that it stands at.
struct Decoder {
    path: PathBuf,
    stored: Stored,
    capture: videoio::VideoCapture,
    /// The frame that is decoded next.
    next: usize,
    /// The frame in `gray`.
    shown: Option<usize>,
    gray: Mat,
}

impl Decoder {
    fn open(path: &Path) -> Result<Self, String> {
        // Left to choose, OpenCV also tries backends that take a path for a pattern or a pipeline.
        let has_ffmpeg = videoio::has_backend(videoio::VideoCaptureAPIs::CAP_FFMPEG).map_err(message)?;
        let backend = if has_ffmpeg { videoio::CAP_FFMPEG } else { videoio::CAP_ANY };
        let mut capture = videoio::VideoCapture::from_file(path, backend).map_err(message)?;
        if !capture.is_opened().map_err(message)? {
            return Err("expected a video that OpenCV can decode, found none".into());
        }
        let layout = capture.get(videoio::CAP_PROP_CODEC_PIXEL_FORMAT).map_err(message)?;
        let stored = Stored::of((layout as i64 as u32).to_le_bytes());
        if stored == Stored::Gray16 {
            capture.set(videoio::CAP_PROP_CONVERT_RGB, 0.0).map_err(message)?;
        }
        Ok(Self { path: path.into(), stored, capture, next: 0, shown: None, gray: Mat::default() })
    }

    /// Makes `frame` the decoded one.
    fn show(&mut self, frame: usize) -> Result<(), String> {
        if self.shown == Some(frame) {
            return Ok(());
        }
        self.shown = None;
        if frame < self.next {
            *self = Self::open(&self.path)?;
        }
        while self.next <= frame {
            if !self.capture.grab().map_err(message)? {
                return Err(format!("expected a frame {}, found the end of the video", self.next));
            }
            self.next += 1;
        }
        self.retrieve()?;
        self.shown = Some(frame);
        Ok(())
    }

    /// The codec's bits, where the shown picture has fewer.
    fn cut_from(&self) -> Option<u8> {
        match self.stored {
            Stored::Deep { bits } => Some(bits),
            Stored::Gray16 if self.gray.depth() != CV_16U => Some(16),
            _ => None,
        }
    }

    fn retrieve(&mut self) -> Result<(), String> {
        let mut picture = Mat::default();
        self.capture.retrieve_def(&mut picture).map_err(message)?;
        let to_gray = match picture.channels() {
            1 => {
                self.gray = picture;
                return Ok(());
            }
            3 => imgproc::COLOR_BGR2GRAY,
            4 => imgproc::COLOR_BGRA2GRAY,
            other => return Err(format!("expected pictures of 1, 3 or 4 channels, found {other}")),
        };
        imgproc::cvt_color_def(&picture, &mut self.gray, to_gray).map_err(message)
    }

    fn copy(
        &self,
        region: Region,
        width_px: usize,
        height_px: usize,
        pixels: &mut [f32],
    ) -> Result<(), String> {
        if (self.gray.cols() as usize, self.gray.rows() as usize) != (width_px, height_px) {
            return Err(format!(
                "expected a picture of {width_px} x {height_px} px, found {} x {}",
                self.gray.cols(),
                self.gray.rows()
            ));
        }
        if self.stored == Stored::Gray16 {
            copy_rows(self.gray.data_typed::<u16>().map_err(message)?, width_px, region, pixels);
        } else {
            copy_rows(self.gray.data_typed::<u8>().map_err(message)?, width_px, region, pixels);
        }
        Ok(())
    }

    fn rate_hz(&self) -> Result<f64, String> {
        let rate_hz = self.capture.get(videoio::CAP_PROP_FPS).map_err(message)?;
        let is_rate = rate_hz.is_finite() && rate_hz > 0.0;
        is_rate.then_some(rate_hz).ok_or_else(|| format!("expected a frame rate above 0, found {rate_hz}"))
    }

    /// The number of frames that the container states, or, where it states none that its size allows, as many as can
    /// be decoded.
    fn n_frames(&self) -> Result<usize, String> {
        let stated = self.capture.get(videoio::CAP_PROP_FRAME_COUNT).map_err(message)?;
        let file_bytes = std::fs::metadata(&self.path).map_err(|error| error.to_string())?.len();
        if (1.0..(file_bytes / LEAST_FRAME_BYTES) as f64).contains(&stated) {
            return Ok(stated as usize);
        }
        let mut counter = Self::open(&self.path)?;
        while counter.capture.grab().map_err(message)? {
            counter.next += 1;
        }
        Ok(counter.next)
    }
}

fn copy_rows<T: Copy + Into<f32>>(gray: &[T], width_px: usize, region: Region, pixels: &mut [f32]) {
    if region.n_pixels() == 0 {
        return;
    }
    let rows = gray.chunks_exact(width_px).skip(region.y);
    for (row, target) in rows.zip(pixels.chunks_exact_mut(region.width)) {
        for (pixel, &count) in target.iter_mut().zip(&row[region.x..]) {
            *pixel = count.into();
        }
    }
}

fn message(error: opencv::Error) -> String {
    error.message
}
