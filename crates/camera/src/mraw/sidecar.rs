//! The .cih or .cihx beside a folder's images: at what rate they were recorded.

use std::path::{Path, PathBuf};

use super::fields::is_header;
use super::header::Shot;
use crate::candidate::{files_in, has_extension, read_head};
use crate::error::CameraError;

/// A header beside images, and what it says of the shot.
pub(crate) struct Sidecar {
    /// The header's name, for messages.
    pub(crate) name: String,
    pub(crate) shot: Shot,
}

/// The header of the images in a folder: in it, or beside it under the folder's name. Of several, the one whose name begins that
/// of the images; a warning where none or more than one does, or where it cannot be read.
///
/// # Errors
/// [`CameraError::Colour`] where the header says that the images were filmed in colour, and when the folder cannot be read.
pub(crate) fn sidecar(folder: &Path, image: &Path) -> Result<Result<Option<Sidecar>, String>, CameraError> {
    let mut headers = headers(folder)?;
    if headers.len() > 1 {
        let image = stem(image);
        headers.retain(|header| image.starts_with(&stem(header)));
        if headers.len() != 1 {
            return Ok(Err("several .cih or .cihx lie beside the images, of which no single one has their name: no rate is taken \
                           from them"
                .into()));
        }
    }
    let Some(path) = headers.pop() else { return Ok(Ok(None)) };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match Shot::read(&path) {
        Ok(shot) => Ok(Ok(Some(Sidecar { name, shot }))),
        Err(error @ CameraError::Colour { .. }) => Err(error),
        Err(error) => Ok(Err(format!("no rate is taken from {name} beside the images: {error}"))),
    }
}

/// The headers in a folder and beside it; of a .cih and a .cihx with one name, the second, which is kept with more care.
fn headers(folder: &Path) -> Result<Vec<PathBuf>, CameraError> {
    let mut found: Vec<PathBuf> = Vec::new();
    for file in files_in(folder)? {
        if (has_extension(&file, "cih") || has_extension(&file, "cihx")) && is_header(&read_head(&file)?) {
            found.push(file);
        }
    }
    found.extend(header_beside(folder));
    let doubled = |file: &PathBuf| has_extension(file, "cih") && found.contains(&file.with_extension("cihx"));
    Ok(found.iter().filter(|file| !doubled(file)).cloned().collect())
}

/// The header beside a folder: the file whose name is the folder's and the ending of a header. Where such ones are of both kinds, the .cihx.
pub(crate) fn header_beside(folder: &Path) -> Option<PathBuf> {
    // By the path that was given, as the folder's own files are named; a path such as `.` has no name of its own.
    let found = |folder: &Path| ["cihx", "cih"].iter().find_map(|extension| beside(folder, extension));
    found(folder).or_else(|| found(&folder.canonicalize().ok()?))
}

/// The header whose name is the folder's, with an extension.
fn beside(folder: &Path, extension: &str) -> Option<PathBuf> {
    let name = folder.file_name()?;
    let named = [extension.to_owned(), extension.to_ascii_uppercase()].map(|extension| {
        let mut name = name.to_owned();
        name.push(".");
        name.push(extension);
        folder.with_file_name(name)
    });
    named.into_iter().find(|file| read_head(file).is_ok_and(|head| is_header(&head)))
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
