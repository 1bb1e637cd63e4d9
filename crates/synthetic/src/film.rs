//! Writes a scene as a .cine file, with the faults that a file may have.

use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use chainwave_durable::NewFile;
use serde::{Deserialize, Serialize};

use crate::check::require;
use crate::cine::StatedRates;
use crate::packing::Packer;
use crate::{Scene, SyntheticError, cine};

/// What is wrong with a recording's file; by default nothing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FileFaults {
    /// Frames that were lost: the file goes on with the next one, whose time stamp tells.
    pub dropped_frames: Option<Range<usize>>,
    /// The frame rate that the header states; the time stamps stay right.
    pub header_rate_hz: Option<f64>,
    /// The frame rate that header and time stamps state, by a clock that is off.
    pub clock_rate_hz: Option<f64>,
    /// Share of the file's bytes after which it ends.
    pub kept_fraction: Option<f64>,
}

/// Films a scene and writes the recording as a Phantom .cine file, one frame at a time.
///
/// A file of that name is never a torn one by accident: it has it once it is whole, or as broken as it shall be.
///
/// # Errors
/// [`SyntheticError`] when a fault is not a possible one, or the file cannot be written; no file is left behind then.
pub fn film(path: &Path, scene: &Scene, faults: &FileFaults) -> Result<(), SyntheticError> {
    let frames = faults.frames(scene.n_frames())?;
    let mut file = NewFile::create(path).map_err(|source| write_error(path, source))?;
    write(&mut file, path, scene, &frames, faults)?;
    file.finish().map_err(|source| write_error(path, source))
}

impl FileFaults {
    fn rates(&self, true_hz: f64) -> StatedRates {
        let clock_hz = self.clock_rate_hz.unwrap_or(true_hz);
        StatedRates { header_hz: self.header_rate_hz.unwrap_or(clock_hz), clock_hz }
    }

    /// The frames that the file holds, once the faults are checked.
    fn frames(&self, n_frames: usize) -> Result<Vec<usize>, SyntheticError> {
        let rates =
            [("faults.header_rate_hz", self.header_rate_hz), ("faults.clock_rate_hz", self.clock_rate_hz)];
        for (name, rate_hz) in rates {
            let rate_hz = rate_hz.unwrap_or(1.0);
            let possible = rate_hz >= 1.0 && rate_hz <= f64::from(u32::MAX);
            require(possible, name, "1 to 4.29e9 frames per second", rate_hz)?;
        }
        let kept = self.kept_fraction.unwrap_or(1.0);
        require((0.0..=1.0).contains(&kept), "faults.kept_fraction", "0 to 1", kept)?;
        let dropped = self.dropped_frames.clone().unwrap_or(0..0);
        let frames: Vec<usize> = (0..n_frames).filter(|frame| !dropped.contains(frame)).collect();
        require(!frames.is_empty(), "faults.dropped_frames", "fewer than all frames", dropped.len())?;
        Ok(frames)
    }
}

fn write(
    file: &mut NewFile,
    path: &Path,
    scene: &Scene,
    frames: &[usize],
    faults: &FileFaults,
) -> Result<(), SyntheticError> {
    let mut put = |bytes: &[u8]| file.write_all(bytes).map_err(|source| write_error(path, source));
    let (camera, shot) = (scene.camera, scene.shot);
    put(&cine::header(camera, shot, frames, faults.rates(camera.rate_hz)))?;
    let packer = Packer::new(camera.packing);
    let (mut canvas, mut counts) = (scene.canvas(), Vec::new());
    let mut bytes = cine::empty_frame(camera);
    for &frame in frames {
        scene.record(frame, &mut canvas, &mut counts)?;
        packer.pack(&counts, camera.width_px, &mut bytes[cine::FRAME_PREFIX..]);
        put(&bytes)?;
    }
    let Some(kept) = faults.kept_fraction else { return Ok(()) };
    let cut = file.written().and_then(|file| file.set_len((kept * file.metadata()?.len() as f64) as u64));
    cut.map_err(|source| write_error(path, source))
}

fn write_error(path: &Path, source: io::Error) -> SyntheticError {
    SyntheticError::Write { path: path.into(), source }
}
