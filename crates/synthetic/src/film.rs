//! Writes a scene as a .cine file, with the faults that a file may have.

use std::fs::File;
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::check::require;
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
    /// Share of the file's bytes after which it ends.
    pub kept_fraction: Option<f64>,
}

/// Films a scene and writes the recording as a Phantom .cine file, one frame at a time.
///
/// The file is written under the name `<path>.part` and renamed when it is whole (or as broken as it shall be), so a file of
/// the final name is never a torn one by accident.
///
/// # Errors
/// [`SyntheticError`] when a fault is not a possible one, or the file cannot be written; no file is left behind then.
pub fn film(path: &Path, scene: &Scene, faults: &FileFaults) -> Result<(), SyntheticError> {
    let frames = faults.frames(scene.n_frames())?;
    let part = part_of(path);
    let written = write(&part, scene, &frames, faults).and_then(|()| {
        std::fs::rename(&part, path)
            .and_then(|()| sync_folder_of(path))
            .map_err(|source| write_error(path, source))
    });
    if written.is_err() {
        // The first error is the one to report; a part that cannot be removed does no harm.
        let _ = std::fs::remove_file(&part);
    }
    written
}

impl FileFaults {
    /// The frames that the file holds, once the faults are checked.
    fn frames(&self, n_frames: usize) -> Result<Vec<usize>, SyntheticError> {
        let rate_hz = self.header_rate_hz.unwrap_or(1.0);
        let possible = rate_hz >= 1.0 && rate_hz <= f64::from(u32::MAX);
        require(possible, "faults.header_rate_hz", "1 to 4.29e9 frames per second", rate_hz)?;
        let kept = self.kept_fraction.unwrap_or(1.0);
        require((0.0..=1.0).contains(&kept), "faults.kept_fraction", "0 to 1", kept)?;
        let dropped = self.dropped_frames.clone().unwrap_or(0..0);
        let frames: Vec<usize> = (0..n_frames).filter(|frame| !dropped.contains(frame)).collect();
        require(!frames.is_empty(), "faults.dropped_frames", "fewer than all frames", dropped.len())?;
        Ok(frames)
    }
}

fn part_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// Makes a renamed file's new name last a loss of power; elsewhere than on Unix the system does so by itself.
fn sync_folder_of(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

fn write(part: &Path, scene: &Scene, frames: &[usize], faults: &FileFaults) -> Result<(), SyntheticError> {
    let mut file = File::create(part).map_err(|source| write_error(part, source))?;
    let mut put = |bytes: &[u8]| file.write_all(bytes).map_err(|source| write_error(part, source));
    let (camera, shot) = (scene.camera, scene.shot);
    put(&cine::header(camera, shot, frames, faults.header_rate_hz.unwrap_or(camera.rate_hz)))?;
    let packer = Packer::new(camera.packing);
    let (mut canvas, mut counts) = (scene.canvas(), Vec::new());
    let mut bytes = cine::empty_frame(camera);
    for &frame in frames {
        scene.record(frame, &mut canvas, &mut counts)?;
        packer.pack(&counts, camera.width_px, &mut bytes[cine::FRAME_PREFIX..]);
        put(&bytes)?;
    }
    let cut = |kept: f64| file.set_len((kept * file.metadata()?.len() as f64) as u64);
    faults
        .kept_fraction
        .map_or(Ok(()), cut)
        .and_then(|()| file.sync_all())
        .map_err(|source| write_error(part, source))
}

fn write_error(path: &Path, source: io::Error) -> SyntheticError {
    SyntheticError::Write { path: path.into(), source }
}
