//! Files written whole or not at all: under a temporary name, synced, renamed, and the folder synced.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use serde::Serialize;

use crate::error::Error;

/// Ending of a file that is being written.
const UNFINISHED: &str = ".unfinished";

/// Writes a file under a temporary name beside `path` and renames it when `fill` has succeeded; a failure leaves nothing.
pub(crate) fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), Error>,
) -> Result<(), Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let unfinished = temporary_name().tempfile_in(folder).map_err(Error::file(path, "create"))?;
    let (file, name) = unfinished.into_parts();
    // Where a file system knows no locks, another process may take this file for one that was left behind.
    let _ = file.lock();
    let mut writer = BufWriter::new(file);
    fill(&mut writer)?;
    let file = writer.into_inner().map_err(|failure| Error::file(path, "write")(failure.into_error()))?;
    file.sync_all().map_err(Error::file(path, "write"))?;
    drop(file);
    name.persist(path).map_err(|failure| Error::file(path, "rename to")(failure.error))?;
    sync_folder(folder).map_err(Error::file(folder, "sync"))
}

/// Makes a renamed file's new name last a loss of power; where a folder cannot be opened, the system does so by itself.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

/// A name like `.tmpa1b2c3.unfinished`, readable by whom the folder's owner lets read new files.
fn temporary_name() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.suffix(UNFINISHED);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

/// Removes what a killed process left unfinished in a folder; what another one is still writing it has locked, and it stays.
pub(crate) fn remove_unfinished(folder: &Path) -> Result<(), Error> {
    for entry in fs::read_dir(folder).map_err(Error::file(folder, "list"))? {
        let path = entry.map_err(Error::file(folder, "list"))?.path();
        if path.to_string_lossy().ends_with(UNFINISHED) && !is_being_written(&path) {
            fs::remove_file(&path).map_err(Error::file(&path, "remove"))?;
        }
    }
    Ok(())
}

fn is_being_written(path: &Path) -> bool {
    let found = File::open(path).map(|file| file.try_lock());
    matches!(found, Ok(Err(TryLockError::WouldBlock)))
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

/// Makes a folder with all its parents.
pub(crate) fn make_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(Error::file(path, "make the folder"))
}

/// Reads a text file.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    fs::read_to_string(path).map_err(Error::file(path, "read"))
}

/// Reads a file of any kind.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    fs::read(path).map_err(Error::file(path, "read"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_another_process_writes_is_not_taken_for_left_behind() {
        let folder = tempfile::tempdir().unwrap();
        let abandoned = folder.path().join(".tmpdead.unfinished");
        fs::write(&abandoned, "half").unwrap();
        let whole = folder.path().join("whole.txt");
        write_whole(&whole, |writer| {
            remove_unfinished(folder.path())?;
            assert!(!abandoned.exists());
            writer.write_all(b"all of it").map_err(Error::file(&whole, "write"))
        })
        .unwrap();
        assert_eq!(fs::read_to_string(&whole).unwrap(), "all of it");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
