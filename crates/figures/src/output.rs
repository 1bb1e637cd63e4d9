use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::drawing::Drawing;
use crate::{FigureError, png, svg};

/// Writes `STEM.svg` and `STEM.png`, each under a temporary name first, so that a reader never meets half a file.
pub(crate) fn write(stem: &Path, drawing: &Drawing) -> Result<(), FigureError> {
    let path = with_ending(stem, ".svg");
    let document =
        svg::document(drawing).map_err(|reason| FigureError::Draw { path: path.clone(), reason })?;
    in_two_steps(&path, &with_ending(stem, ".partial.svg"), |partial| {
        std::fs::write(partial, &document).map_err(|source| FigureError::Write { path: path.clone(), source })
    })?;
    let path = with_ending(stem, ".png");
    in_two_steps(&path, &with_ending(stem, ".partial.png"), |partial| {
        png::save(drawing, partial).map_err(|reason| FigureError::Draw { path: path.clone(), reason })
    })
}

fn in_two_steps(
    path: &Path,
    partial: &Path,
    write: impl FnOnce(&Path) -> Result<(), FigureError>,
) -> Result<(), FigureError> {
    write(partial)?;
    std::fs::rename(partial, path).map_err(|source| FigureError::Write { path: path.into(), source })
}

/// The stem with an ending put behind it; a dot in the stem stays.
fn with_ending(stem: &Path, ending: &str) -> PathBuf {
    let mut path = OsString::from(stem);
    path.push(ending);
    path.into()
}
