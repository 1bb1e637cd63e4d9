//! Video of more than 8 bits, decoded by the program `ffmpeg` through a pipe.

use std::ffi::OsString;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use crate::error::CameraError;
use crate::library::VideoFrames;

/// Frames of more than eight bits, which OpenCV would cut to eight: the program `ffmpeg` decodes them with the same codecs and
/// hands on their plane of brightness as it was coded.
pub(super) struct DeepDecoder {
    path: PathBuf,
    bits: u32,
    width_px: usize,
    height_px: usize,
    /// The last frame, two bytes a pixel, low byte first.
    frame: Vec<u8>,
    process: Option<Process>,
}

impl DeepDecoder {
    /// Starts decoding a video of `bits` (9 to 16) a pixel.
    pub(super) fn open(path: &Path, size_px: (usize, usize), bits: u32) -> Result<Self, CameraError> {
        let (width_px, height_px) = size_px;
        let process = Process::start(path, bits).map_err(|error| CameraError::Unsupported {
            path: path.into(),
            what: format!("video of {bits} bits, which OpenCV would cut to 8,"),
            hint: format!("install the program ffmpeg, which could not be started: {error}"),
        })?;
        Ok(Self { path: path.into(), bits, width_px, height_px, frame: Vec::new(), process: Some(process) })
    }
}

impl VideoFrames for DeepDecoder {
    fn rewind(&mut self) -> Result<(), String> {
        // The old process ends before the new one starts.
        self.process = None;
        self.process =
            Some(Process::start(&self.path, self.bits).map_err(|error| format!("ffmpeg: {error}"))?);
        Ok(())
    }

    fn advance(&mut self) -> Result<bool, String> {
        let Some(process) = &mut self.process else {
            return Ok(false);
        };
        let expected = 2 * self.width_px * self.height_px;
        self.frame.clear();
        let found = process.pictures.by_ref().take(expected as u64).read_to_end(&mut self.frame);
        Ok(found.map_err(|error| format!("ffmpeg: {error}"))? == expected)
    }

    fn picture(&mut self) -> Result<Vec<u16>, String> {
        Ok(self.frame.chunks_exact(2).map(|count| u16::from_le_bytes([count[0], count[1]])).collect())
    }
}

/// A running `ffmpeg`, stopped when it is dropped.
struct Process {
    child: Child,
    pictures: ChildStdout,
}

impl Process {
    fn start(path: &Path, bits: u32) -> std::io::Result<Self> {
        // A frame in gives a frame out: at a constant rate of stamps nothing is doubled or dropped to keep time.
        let filters = format!("extractplanes=y,format=gray{bits}le,settb=1/25,setpts=N");
        // With its scheme no name is taken for an option, a pattern or an address.
        let mut input = OsString::from("file:");
        input.push(path);
        let mut child = Command::new("ffmpeg")
            .args(["-nostdin", "-loglevel", "quiet", "-i"])
            .arg(input)
            .args(["-map", "0:v:0", "-vf", &filters, "-r", "25", "-f", "rawvideo", "-"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let pictures = child.stdout.take().ok_or_else(|| std::io::Error::other("it has no output"))?;
        Ok(Self { child, pictures })
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended by itself, and there is nobody left to tell.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
