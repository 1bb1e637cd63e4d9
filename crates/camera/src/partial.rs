//! Recordings that end before their last frame: refused, or read as far as frames are whole when that was asked for.

use crate::error::CameraError;
use crate::options::OpenOptions;

/// Whether an error says no more than that the file ends early, and the caller wants what there is before. A contradiction
/// is an error in any case.
pub(crate) fn forgives(options: &OpenOptions, error: &CameraError) -> bool {
    options.partial && matches!(error, CameraError::Truncated { .. })
}

/// The warning of a recording of which only a part is there.
pub(crate) fn warning(n_whole: usize, n_stated: Option<usize>) -> String {
    let stated = n_stated.map_or("its frames".into(), |n_stated| format!("the {n_stated} frames it states"));
    format!("the recording is cut short: of {stated}, the first {n_whole} are whole and are read")
}
