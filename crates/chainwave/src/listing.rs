//! The recordings of a folder, in the order in which people count.

use std::path::{Path, PathBuf};

use chainwave_camera::{CameraError, OpenOptions};
use chainwave_measurement::RecordingInfo;

use crate::error::Error;
use crate::on_demand;
use crate::output::found_in_place_of;

/// Recordings with what they say of themselves, and why others cannot be opened.
pub(crate) type Listed = (Vec<(PathBuf, RecordingInfo)>, Vec<CameraError>);

/// The recordings in a folder with what they say of themselves, and why others cannot be opened. A single image is no recording; a
/// folder of them is. What is of no known format is passed over.
pub(crate) fn recordings_in(folder: &Path, options: &OpenOptions) -> Result<Listed, Error> {
    let (mut found, mut failed) = (Vec::new(), Vec::new());
    for path in entries_of(folder)? {
        match chainwave_camera::open_with(&path, options) {
            Ok(recording) if recording.info().n_frames > 1 => found.push((path, recording.info().clone())),
            Ok(_) | Err(CameraError::UnknownFormat { .. }) => {}
            Err(_) if path.is_dir() => {}
            Err(error @ CameraError::NeedsOpenCv { .. }) if on_demand::is_there() => return Err(error.into()),
            Err(error) => failed.push(error),
        }
    }
    Ok((found, failed))
}

/// Endings of files that hold one picture each: alone they are no recordings, as a photograph of the bench, or what `init` draws.
const PICTURES: [&str; 5] = ["png", "jpg", "jpeg", "bmp", "pgm"];

/// What lies in the folder by name, numbers in their natural order, without pictures that lie there alone.
pub(crate) fn entries_of(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    if !folder.is_dir() {
        return Err(Error::Argument(format!(
            "{}: expected a folder of recordings, found {}",
            folder.display(),
            found_in_place_of(folder, "one")
        )));
    }
    let entries = std::fs::read_dir(folder).map_err(Error::file(folder, "list"))?;
    let mut paths = Vec::new();
    for entry in entries {
        paths.push(entry.map_err(Error::file(folder, "list"))?.path());
    }
    // A Photron header and its pixels are one recording.
    let with_pixels = |path: &PathBuf| path.with_extension("mraw").exists();
    paths.retain(|path| {
        !(path.extension().is_some_and(|ending| ending == "cih" || ending == "cihx") && with_pixels(path))
    });
    paths.retain(|path| !(is_picture(path) && path.is_file()));
    paths.sort_by_key(|path| natural_key(&path.to_string_lossy()));
    Ok(paths)
}

fn is_picture(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| PICTURES.contains(&&*ending))
}

/// Texts and numbers of a name in turn, so that `view10` comes after `view9`.
fn natural_key(name: &str) -> Vec<(String, u64)> {
    let mut parts: Vec<(String, String)> = vec![(String::new(), String::new())];
    for character in name.chars() {
        let after_digits = parts.last().is_some_and(|(_, digits)| !digits.is_empty());
        if !character.is_ascii_digit() && after_digits {
            parts.push((String::new(), String::new()));
        }
        if let Some((text, digits)) = parts.last_mut() {
            if character.is_ascii_digit() { digits.push(character) } else { text.push(character) }
        }
    }
    parts.into_iter().map(|(text, digits)| (text, digits.parse().unwrap_or(u64::MAX))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_that_lie_alone_are_no_recordings() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["markers.png", "bench.JPG", "shot.cine"] {
            std::fs::write(folder.path().join(name), b"x").unwrap();
        }
        std::fs::create_dir(folder.path().join("frames.png")).unwrap();
        let found = entries_of(folder.path()).unwrap();
        let names: Vec<_> = found.iter().map(|path| path.file_name().unwrap()).collect();
        assert_eq!(names, ["frames.png", "shot.cine"]);
    }

    #[test]
    fn names_sort_as_people_count() {
        let mut names = vec!["view10_trial1", "view2_trial1", "view2_trial10", "view2_trial9"];
        names.sort_by_key(|name| natural_key(name));
        assert_eq!(names, ["view2_trial1", "view2_trial9", "view2_trial10", "view10_trial1"]);
    }
}
