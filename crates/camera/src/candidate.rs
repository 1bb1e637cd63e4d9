//! Paths that may hold a recording: their first bytes, and the files beside and inside them.

use std::ffi::OsStr;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::CameraError;

/// Bytes at the start of a file that suffice to recognise every format, also those that are only named.
const HEAD_BYTES: u64 = 4100;

/// A path that may hold a recording, with what its format is found from.
pub(crate) struct Candidate<'a> {
    pub(crate) path: &'a Path,
    /// The first bytes of a file; empty for a folder.
    pub(crate) head: Vec<u8>,
    pub(crate) is_folder: bool,
}

impl<'a> Candidate<'a> {
    pub(crate) fn read(path: &'a Path) -> Result<Self, CameraError> {
        let is_folder = path.is_dir();
        let head = if is_folder { Vec::new() } else { read_head(path)? };
        Ok(Self { path, head, is_folder })
    }

    /// Whether the file's name ends in `.extension`, in capitals or not.
    pub(crate) fn has_extension(&self, extension: &str) -> bool {
        has_extension(self.path, extension)
    }
}

pub(crate) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// The first bytes of a file.
pub(crate) fn read_head(path: &Path) -> Result<Vec<u8>, CameraError> {
    let io_error = |source| CameraError::Io { path: path.into(), source };
    let mut head = Vec::new();
    File::open(path).map_err(io_error)?.take(HEAD_BYTES).read_to_end(&mut head).map_err(io_error)?;
    Ok(head)
}

/// The files of a folder whose names do not begin with a dot, by name.
pub(crate) fn files_in(folder: &Path) -> Result<Vec<PathBuf>, CameraError> {
    let io_error = |source| CameraError::Io { path: folder.into(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io_error)? {
        let path = entry.map_err(io_error)?.path();
        let is_hidden = path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
        if !is_hidden && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The file beside `path` whose name differs only in its extension, which is `extension` in capitals or not.
pub(crate) fn sibling(path: &Path, extension: &str) -> Option<PathBuf> {
    let plain = path.with_extension(extension);
    if plain.is_file() {
        return Some(plain);
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let files = files_in(folder.unwrap_or(Path::new("."))).ok()?;
    let stem = path.file_stem().unwrap_or(OsStr::new(""));
    files.into_iter().find(|file| file.file_stem() == Some(stem) && has_extension(file, extension))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sibling_is_found_whatever_the_case_of_its_extension() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in ["shot.CIH", "shot.mraw", "shot2.cihx"] {
            std::fs::write(path(name), b"").unwrap();
        }
        assert_eq!(sibling(&path("shot.mraw"), "cih"), Some(path("shot.CIH")));
        assert_eq!(sibling(&path("shot.mraw"), "cihx"), None);
        assert_eq!(sibling(&path("shot.CIH"), "mraw"), Some(path("shot.mraw")));
    }
}
