use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use chainwave_measurement::Trajectory;

use crate::packing::Packer;
use crate::settings::{Camera, Shot, Specimen};
use crate::{Scene, SyntheticError, cine};

/// Films the moving specimen and writes the recording as a Phantom .cine file, one frame at a time.
///
/// The file is written under the name `<path>.part` and renamed when it is whole, so a file of the final name is
/// never a torn one.
///
/// # Errors
/// [`SyntheticError`] when a setting is not usable, the motion ends before the last frame, or the file cannot be
/// written; no file is left behind then.
pub fn film(
    path: &Path,
    camera: &Camera,
    specimen: &Specimen,
    shot: &Shot,
    motion: &Trajectory,
) -> Result<(), SyntheticError> {
    let scene = Scene::new(camera, specimen, shot, motion)?;
    let part = part_of(path);
    let written = write(&part, &scene, camera, shot)
        .and_then(|()| std::fs::rename(&part, path).map_err(|source| write_error(path, source)));
    if written.is_err() {
        // The first error is the one to report; a part that cannot be removed does no harm.
        let _ = std::fs::remove_file(&part);
    }
    written
}

fn part_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

fn write(part: &Path, scene: &Scene, camera: &Camera, shot: &Shot) -> Result<(), SyntheticError> {
    let mut file = File::create(part).map_err(|source| write_error(part, source))?;
    let mut put = |bytes: &[u8]| file.write_all(bytes).map_err(|source| write_error(part, source));
    put(&cine::header(camera, shot))?;
    let packer = Packer::new(camera.packing);
    let (mut canvas, mut counts) = (scene.canvas(), Vec::new());
    let mut bytes = cine::empty_frame(camera);
    for frame in 0..shot.n_frames {
        scene.record(frame, &mut canvas, &mut counts)?;
        packer.pack(&counts, camera.width_px, &mut bytes[cine::FRAME_PREFIX..]);
        put(&bytes)?;
    }
    Ok(())
}

fn write_error(path: &Path, source: std::io::Error) -> SyntheticError {
    SyntheticError::Write { path: path.into(), source }
}
