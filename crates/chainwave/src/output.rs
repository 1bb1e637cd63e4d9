//! Files written whole or not at all, with the errors of the command; folders, and files that are read.

use std::fs;
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use chainwave_durable::{NewFile, folder_of};
use serde::Serialize;

use crate::error::Error;

/// Writes a file that has its name when `fill` has succeeded; a failure leaves nothing.
pub(crate) fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut NewFile) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut file = NewFile::create(path).map_err(Error::file(path, "create"))?;
    fill(&mut file)?;
    file.finish().map_err(Error::file(path, "write"))
}

/// Removes what a killed process left unfinished in a folder; what another one is still writing stays.
pub(crate) fn remove_unfinished(folder: &Path) -> Result<(), Error> {
    chainwave_durable::remove_unfinished(folder).map_err(Error::file(folder, "remove unfinished files of"))
}

/// Writes a text file whole.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    write_whole(path, |writer| writer.write_all(text.as_bytes()).map_err(Error::file(path, "write")))
}

/// Writes a value as indented JSON.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    write_text(path, &format!("{text}\n"))
}

/// Refuses a file in a folder that is not there, before long work is done for it.
pub(crate) fn expect_folder_of(path: &Path) -> Result<(), Error> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) => fs::read_dir(folder).map(drop).map_err(Error::file(folder, "write into the folder")),
        None => Ok(()),
    }
}

/// Refuses a name that promises another format than is written, before any work is done for it.
pub(crate) fn expect_ending(path: &Path, ending: &str) -> Result<(), Error> {
    let found = path.extension().unwrap_or_default();
    match found.eq_ignore_ascii_case(ending) {
        true => Ok(()),
        false => Err(Error::Argument(format!(
            "{}: expected a name that ends in .{ending}, found {:?}",
            path.display(),
            path.file_name().unwrap_or_default().to_string_lossy()
        ))),
    }
}

/// Refuses results that would replace each other, or a file that they are made from, before any work is done for them.
pub(crate) fn expect_apart(read: &[&Path], written: &[(&str, PathBuf)]) -> Result<(), Error> {
    let inputs: Vec<PathBuf> = read.iter().map(|path| place(path)).collect();
    let mut taken: Vec<(&str, &Path, PathBuf)> = Vec::new();
    for (what, path) in written {
        let there = place(path);
        if let Some(at) = inputs.iter().position(|input| *input == there) {
            return Err(Error::Argument(format!(
                "{}: {what} would replace {}, which is read (hint: give the result another name)",
                path.display(),
                read[at].display()
            )));
        }
        if let Some((other, one, _)) = taken.iter().find(|(.., known)| *known == there) {
            return Err(Error::Argument(format!(
                "{}: {what} would replace {other}, {} (hint: give one of them another name)",
                path.display(),
                one.display()
            )));
        }
        taken.push((what, path, there));
    }
    Ok(())
}

/// Refuses a folder of results among recordings, or within one that is a folder of images: results are many files, and those of an earlier run
/// are removed by their names.
pub(crate) fn expect_apart_from_recordings(
    out: &Path,
    recordings: impl IntoIterator<Item = PathBuf>,
) -> Result<(), Error> {
    let there = place(out);
    for recording in recordings {
        let is_beside = place(folder_of(&recording)) == there;
        let is_within = recording.is_dir() && there.starts_with(place(&recording));
        if is_beside || is_within {
            return Err(Error::Argument(format!(
                "{}: expected a folder of its own for the results, found that of {} (hint: --out {})",
                out.display(),
                recording.display(),
                folder_of(&recording).join("results").display()
            )));
        }
    }
    Ok(())
}

/// Refuses an input that is named twice: its results would stand twice in a table, and nothing would tell them apart.
pub(crate) fn expect_each_once(inputs: &[PathBuf]) -> Result<(), Error> {
    let places: Vec<PathBuf> = inputs.iter().map(|path| place(path)).collect();
    match (1..places.len()).find(|at| places[..*at].contains(&places[*at])) {
        None => Ok(()),
        Some(at) => Err(Error::Argument(format!(
            "{}: expected each recording once, found it twice",
            inputs[at].display()
        ))),
    }
}

/// A path by which files can be told apart, of files that are there and of those that are not yet.
fn place(path: &Path) -> PathBuf {
    if let Ok(known) = path.canonicalize() {
        return known;
    }
    let folder = match folder_of(path) {
        here if here == Path::new(".") => here.canonicalize().unwrap_or_default(),
        folder => place(folder),
    };
    path.file_name().map_or_else(|| folder.clone(), |name| folder.join(name))
}

/// Removes a file, if it is there.
pub(crate) fn remove(path: &Path) -> Result<(), Error> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::file(path, "remove")(error)),
        _ => Ok(()),
    }
}

/// Whether a name, such as a table has of a recording, stays in the folder that it is in.
pub(crate) fn stays_within(name: &str) -> bool {
    Path::new(name).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

/// Makes a folder with all its parents.
pub(crate) fn make_folder(path: &Path) -> Result<(), Error> {
    if path.is_file() {
        return Err(Error::Argument(format!(
            "{}: expected a folder for the results, found a file",
            path.display()
        )));
    }
    fs::create_dir_all(path).map_err(Error::file(path, "make the folder"))
}

/// What stands under a path where a folder with certain contents was expected.
pub(crate) fn found_in_place_of(folder: &Path, without: &'static str) -> &'static str {
    match (folder.is_dir(), folder.exists()) {
        (true, _) => without,
        (_, true) => "a file",
        _ => "no such folder",
    }
}

/// The folder of figures in a folder of results.
pub(crate) const FIGURES_FOLDER: &str = "figures";

/// The same by its path, made where it is missing.
pub(crate) fn figures_folder(out: &Path) -> Result<PathBuf, Error> {
    let folder = out.join(FIGURES_FOLDER);
    make_folder(&folder)?;
    Ok(folder)
}

/// Reads a file of any kind.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    fs::read(path).map_err(Error::file(path, "read"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_refused_among_recordings_and_in_a_folder_of_images() {
        let folder = tempfile::tempdir().unwrap();
        let [shots, frames] = ["shots", "shots/frames"].map(|name| folder.path().join(name));
        fs::create_dir_all(&frames).unwrap();
        let recordings = || [shots.join("a.cine"), frames.clone()];
        for wrong in ["shots", "shots/frames", "shots/frames/new/results", "shots/../shots"] {
            let refused = expect_apart_from_recordings(&folder.path().join(wrong), recordings());
            let said = refused.unwrap_err().to_string();
            assert!(said.contains("a folder of its own for the results"), "{wrong}: {said}");
        }
        for right in ["results", "shots/results", "shots/frames2", "new/results"] {
            expect_apart_from_recordings(&folder.path().join(right), recordings()).unwrap();
        }
    }
}
