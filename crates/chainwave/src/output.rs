//! Files written whole or not at all.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::Error;

/// Writes a file under a temporary name beside `path` and renames it when `fill` has succeeded. What an interrupted command
/// left under that name is written over by the next one.
pub(crate) fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), Error>,
) -> Result<(), Error> {
    let unfinished = unfinished_name(path);
    let mut writer = BufWriter::new(File::create(&unfinished).map_err(Error::file(&unfinished, "create"))?);
    fill(&mut writer)?;
    writer.flush().map_err(Error::file(&unfinished, "write"))?;
    drop(writer);
    fs::rename(&unfinished, path).map_err(Error::file(path, "rename to"))
}

/// Writes a text file whole.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    write_whole(path, |writer| writer.write_all(text.as_bytes()).map_err(Error::file(path, "write")))
}

/// Refuses a file in a folder that is not there, before long work is done for it.
pub(crate) fn expect_folder_of(path: &Path) -> Result<(), Error> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) => fs::read_dir(folder).map(drop).map_err(Error::file(folder, "write into the folder")),
        None => Ok(()),
    }
}

/// Makes a folder with all its parents.
pub(crate) fn make_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(Error::file(path, "make the folder"))
}

/// Reads a text file.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    fs::read_to_string(path).map_err(Error::file(path, "read"))
}

fn unfinished_name(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".unfinished");
    path.with_file_name(name)
}
