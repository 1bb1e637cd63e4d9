//! Files mapped into memory for reading; the crate's only unsafe code.

use std::fs::File;
use std::path::Path;

use memmap2::Mmap;

use crate::error::CameraError;

/// Maps a whole file into memory for reading; the system then loads only the pages that are touched.
///
/// # Errors
/// [`CameraError::Io`] when the file cannot be opened or mapped.
#[expect(
    unsafe_code,
    reason = "memory-mapping is what makes reading by region cheap, and it is unsafe by nature"
)]
pub(crate) fn map_file(path: &Path) -> Result<Mmap, CameraError> {
    let io_error = |source| CameraError::Io { path: path.into(), source };
    let file = File::open(path).map_err(io_error)?;
    // SAFETY: the map is read-only and private to the returned value, and its bytes are only ever copied out as integers,
    // for which every bit pattern is valid. A recording is finished before it is analysed; should another process
    // change it meanwhile, later reads give other pixels, and should it be cut short, the system ends this process.
    unsafe { Mmap::map(&file) }.map_err(io_error)
}
