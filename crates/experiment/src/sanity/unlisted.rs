//! Recordings that lie among those of the trials table and are not in it: forgotten rows pass in silence, as if nothing had been filmed.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use crate::finding::Finding;
use crate::setup::Setup;

const UNLISTED: &str = "unlisted";
/// Names that a message has at most.
const MOST_NAMED: usize = 3;
/// Endings of files of one picture each, which may be anything: a board, a photograph, a figure.
const PICTURES: [&str; 7] = ["tif", "tiff", "png", "jpg", "jpeg", "bmp", "pgm"];

/// The recordings that the table does not have: files with the ending of one that it has, in the same folder. Nothing is said of files that
/// the experiment names otherwise.
pub(super) fn recordings(setup: &Setup) -> Option<Finding> {
    let listed: BTreeSet<PathBuf> =
        setup.table.iter().map(|trial| setup.recordings.join(&trial.recording)).collect();
    let camera = &setup.experiment.camera;
    let otherwise: BTreeSet<PathBuf> = [&camera.dark, &camera.flat]
        .into_iter()
        .flatten()
        .map(|name| setup.path.with_file_name(name))
        .collect();
    let kinds: BTreeSet<(&Path, OsString)> = listed.iter().filter_map(|path| kind(path)).collect();
    let others: BTreeSet<String> = kinds
        .iter()
        .filter_map(|(folder, _)| fs::read_dir(folder).ok())
        .flat_map(|entries| entries.flatten().map(|entry| entry.path()))
        .filter(|path| kind(path).is_some_and(|kind| kinds.contains(&kind)))
        .filter(|path| !listed.contains(path) && !otherwise.contains(path) && path.is_file())
        .filter_map(|path| path.file_name().map(|name| name.to_string_lossy().into_owned()))
        .filter(|name| !name.starts_with('.'))
        .collect();
    let named: Vec<&str> = others.iter().take(MOST_NAMED).map(String::as_str).collect();
    let more = others.len().saturating_sub(MOST_NAMED);
    (!others.is_empty()).then(|| Finding {
        code: UNLISTED,
        subject: setup.experiment.trials.display().to_string(),
        text: format!(
            "expected a row for each recording in the folder, found none for {}{} (hint: add the rows, or move what does not belong to the \
             experiment)",
            named.join(", "),
            if more > 0 { format!(" and {more} more") } else { String::new() },
        ),
    })
}

/// Folder and ending of a recording that is one file; `None` of a folder of pictures, and of a picture.
fn kind(path: &Path) -> Option<(&Path, OsString)> {
    let ending = path.extension()?.to_ascii_lowercase();
    let is_picture = PICTURES.iter().any(|picture| ending == *picture);
    Some((path.parent()?, ending)).filter(|_| !is_picture)
}
