//! The files of a folder, to compare one with another.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The files of a folder and all below it, by their paths from it.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    collect(folder, Path::new(""), &mut found);
    found.sort();
    found
}

fn collect(top: &Path, below: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(top.join(below)).expect("the folder can be listed") {
        let path = below.join(entry.expect("the folder can be listed").file_name());
        if top.join(&path).is_dir() { collect(top, &path, found) } else { found.push(path) }
    }
}

/// Asserts that two folders hold the same files with the same bytes.
pub(crate) fn assert_same(left: &Path, right: &Path) {
    assert_eq!(files(left), files(right), "{} and {}", left.display(), right.display());
    let read = |folder: &Path, file: &Path| fs::read(folder.join(file)).expect("a listed file can be read");
    let differ: Vec<PathBuf> =
        files(left).into_iter().filter(|file| read(left, file) != read(right, file)).collect();
    assert!(differ.is_empty(), "{} and {} differ in {differ:?}", left.display(), right.display());
}

/// When each file with this ending was last written; a file that is not there yet, or a folder, has no time.
pub(crate) fn times_of(folder: &Path, ending: &str) -> BTreeMap<PathBuf, SystemTime> {
    let names = fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    names
        .filter(|path| path.extension().is_some_and(|found| found == ending))
        .filter_map(|path| Some((path.clone(), fs::metadata(&path).ok()?.modified().ok()?)))
        .collect()
}
