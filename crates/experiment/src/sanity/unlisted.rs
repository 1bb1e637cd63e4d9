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
    let others = others_beside(&listed, &otherwise);
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

/// Names of the files in the folders of those that are listed, with the ending of one there, that neither stand among these nor are named otherwise.
fn others_beside(listed: &BTreeSet<PathBuf>, otherwise: &BTreeSet<PathBuf>) -> BTreeSet<String> {
    let kinds: BTreeSet<(&Path, OsString)> = listed.iter().filter_map(|path| kind(path)).collect();
    let folders: BTreeSet<&Path> = kinds.iter().map(|(folder, _)| *folder).collect();
    folders
        .iter()
        .filter_map(|folder| fs::read_dir(folder).ok())
        .flat_map(|entries| entries.flatten().map(|entry| entry.path()))
        .filter(|path| kind(path).is_some_and(|kind| kinds.contains(&kind)))
        .filter(|path| !listed.contains(path) && !otherwise.contains(path) && path.is_file())
        .filter_map(|path| path.file_name().map(|name| name.to_string_lossy().into_owned()))
        .filter(|name| !name.starts_with('.'))
        .collect()
}

/// Folder and ending of a recording that is one file; `None` of a folder of pictures, and of a picture.
fn kind(path: &Path) -> Option<(&Path, OsString)> {
    let ending = path.extension()?.to_ascii_lowercase();
    let is_picture = PICTURES.iter().any(|picture| ending == *picture);
    Some((path.parent()?, ending)).filter(|_| !is_picture)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_without_a_row_are_named_and_nothing_else_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let files = [
            "view1.cine",
            "View2.CINE",
            "forgotten.cine",
            "dark.cine",
            ".view1.cine",
            "other.mraw",
            "board.tif",
        ];
        for name in files {
            fs::write(path(name), "").unwrap();
        }
        fs::create_dir(path("folder.cine")).unwrap();
        let set = |names: &[&str]| names.iter().map(|name| path(name)).collect::<BTreeSet<PathBuf>>();

        let forgotten = others_beside(&set(&["view1.cine", "View2.CINE"]), &set(&["dark.cine"]));
        assert_eq!(forgotten, BTreeSet::from(["forgotten.cine".to_owned()]));
        // A picture may be anything, and so may what lies beside it; a folder that is not there says nothing.
        assert_eq!(others_beside(&set(&["board.tif"]), &set(&[])), BTreeSet::new());
        assert_eq!(
            others_beside(&BTreeSet::from([PathBuf::from("gone/view1.cine")]), &set(&[])),
            BTreeSet::new()
        );
    }
}
