//! Files that hold one array of NumPy: `.npy`, or a pickle.

use std::path::Path;

use super::numpy::{MAGIC, NumpyArray, of_npy};
use super::pickle;
use crate::error::Error;
use crate::output::read_bytes;

/// Reads a file, whichever of both it is.
pub(super) fn read(path: &Path) -> Result<NumpyArray, Error> {
    let bytes = read_bytes(path)?;
    let found = match bytes.strip_prefix(MAGIC) {
        Some(rest) => of_npy(rest),
        None => pickle::array(&bytes),
    };
    found.map_err(|(expected, found)| Error::place(path, "its bytes", &expected, &found))
}
