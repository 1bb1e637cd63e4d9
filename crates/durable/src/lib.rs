//! Files written whole or not at all.
//!
//! A [`NewFile`] has a temporary name beside its own, is synced, renamed, and the folder is synced: whoever reads sees the old file or the
//! whole new one, after a loss of power too. Processes may write one and the same file side by side; the last one to finish stands.
//! What a killed process left, [`remove_unfinished`] takes away, and never what another one is still writing.
//!
//! A link stays one: the file that it leads to is written. What is no file, such as a pipe, gets the bytes when they are all there.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

/// Ending of a file that is being written.
const UNFINISHED: &str = ".unfinished";

/// A file that appears under its name when it is finished; without that, nothing is left of it.
#[derive(Debug)]
pub struct NewFile {
    path: PathBuf,
    writer: BufWriter<File>,
    unfinished: TempPath,
    /// Whether `path` is, or is to be, a file that can be replaced.
    is_replaced: bool,
}

impl NewFile {
    /// Begins a file in the folder that `path` leads to, which must be there.
    ///
    /// # Errors
    /// As creating a file.
    pub fn create(path: &Path) -> io::Result<Self> {
        let path = led_to(path);
        let is_replaced = path.is_file() || !path.exists();
        let folder = if is_replaced { folder_of(&path).to_owned() } else { std::env::temp_dir() };
        loop {
            let (file, unfinished) = temporary_name().tempfile_in(&folder)?.into_parts();
            // Where a file system knows no locks, another process may take this file for one that was left behind.
            let _ = file.lock();
            // Before it was locked, another process may have done so already.
            if unfinished.exists() {
                return Ok(Self { path, writer: BufWriter::new(file), unfinished, is_replaced });
            }
        }
    }

    /// What was written so far, to be measured or cut.
    ///
    /// # Errors
    /// As writing.
    pub fn written(&mut self) -> io::Result<&File> {
        self.writer.flush()?;
        Ok(self.writer.get_ref())
    }

    /// Gives the file its name, in place of another one of that name.
    ///
    /// # Errors
    /// As writing, syncing and renaming a file; nothing is left then.
    pub fn finish(self) -> io::Result<()> {
        let mut file = self.writer.into_inner().map_err(|failure| failure.into_error())?;
        if !self.is_replaced {
            file.rewind()?;
            return io::copy(&mut file, &mut File::options().write(true).open(&self.path)?).map(drop);
        }
        file.sync_all()?;
        // The lock is held until the file has its name.
        self.unfinished.persist(&self.path).map_err(|failure| failure.error)?;
        drop(file);
        sync_folder(folder_of(&self.path))
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Seek for NewFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.writer.seek(to)
    }
}

/// Removes what killed processes left unfinished in a folder; what another one is still writing it has locked, and it
/// stays. A folder that is not there has none.
///
/// # Errors
/// As listing a folder and removing a file. That another process removed the same file meanwhile is none.
pub fn remove_unfinished(folder: &Path) -> io::Result<()> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let path = entry?.path();
        if path.to_string_lossy().ends_with(UNFINISHED) {
            match remove_abandoned(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => (),
            }
        }
    }
    Ok(())
}

/// Removes a file that nobody has locked; its lock is held meanwhile, so that whoever has just created it learns that it is gone.
fn remove_abandoned(path: &Path) -> io::Result<()> {
    let file = File::open(path)?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Ok(()),
        _ => fs::remove_file(path),
    }
}

/// The file that a path leads to, be it there or not.
fn led_to(path: &Path) -> PathBuf {
    match (fs::canonicalize(path), fs::read_link(path)) {
        (Ok(there), _) => there,
        // A link to what is not there yet.
        (Err(_), Ok(target)) => folder_of(path).join(target),
        (Err(_), Err(_)) => path.to_owned(),
    }
}

/// The folder that a path lies in; the present one of a bare name.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Makes a renamed file's new name last a loss of power; elsewhere than on Unix the system does so by itself.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finished_leaves_nothing_and_the_old_file_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        fs::write(&path, "old").unwrap();
        let mut file = NewFile::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_one_and_a_pipe_gets_the_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let [target, link] = ["there/table.csv", "table.csv"].map(|name| folder.path().join(name));
        fs::create_dir(folder.path().join("there")).unwrap();
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        let write = |path: &Path| {
            let mut file = NewFile::create(path).unwrap();
            file.write_all(b"new").unwrap();
            file.finish().unwrap();
        };
        let later = folder.path().join("later.csv");
        std::os::unix::fs::symlink("there/later.csv", &later).unwrap();
        write(&later);
        assert!(later.is_symlink() && folder.path().join("there/later.csv").is_file());
        write(&link);
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        write(Path::new("/dev/null"));
        assert!(!Path::new("/dev/null").is_file());
    }

    #[test]
    fn what_is_still_written_is_not_taken_for_left_behind() {
        let folder = tempfile::tempdir().unwrap();
        let abandoned = folder.path().join(".tmpdead.unfinished");
        fs::write(&abandoned, "half").unwrap();
        let path = folder.path().join("whole.txt");
        let mut file = NewFile::create(&path).unwrap();
        remove_unfinished(folder.path()).unwrap();
        assert!(!abandoned.exists());
        file.write_all(b"all of it").unwrap();
        file.finish().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "all of it");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn many_write_one_file_while_others_clean_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("figure.svg");
        // Longer than a buffer, so that it is written in several parts.
        let of = |writer: u8| vec![writer; 20_000];
        std::thread::scope(|scope| {
            for writer in 0..4 {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..50 {
                        let mut file = NewFile::create(path).unwrap();
                        file.write_all(&of(writer)).unwrap();
                        file.finish().unwrap();
                        remove_unfinished(folder_of(path)).unwrap();
                        let found = fs::read(path).unwrap();
                        assert!((0..4).any(|any| found == of(any)), "torn: {} bytes", found.len());
                    }
                });
            }
        });
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
