//! The checked cursor: every read of foreign bytes names what it reads and fails where the file ends.

use std::fmt::Display;
use std::path::Path;

use crate::error::CameraError;

/// The bytes of a file, readable only where they exist.
///
/// Offsets are from the start of the file. Every read names what it reads, so that an error can say so.
#[derive(Clone, Copy)]
pub(crate) struct Bytes<'a> {
    path: &'a Path,
    data: &'a [u8],
}

impl<'a> Bytes<'a> {
    pub(crate) fn new(path: &'a Path, data: &'a [u8]) -> Self {
        Self { path, data }
    }

    pub(crate) fn path(&self) -> &'a Path {
        self.path
    }

    pub(crate) fn len(&self) -> u64 {
        self.data.len() as u64
    }

    /// `len` bytes at `offset`.
    pub(crate) fn slice(&self, what: impl Display, offset: u64, len: u64) -> Result<&'a [u8], CameraError> {
        self.find(offset, len).ok_or_else(|| CameraError::Truncated {
            path: self.path.into(),
            what: what.to_string(),
            offset,
            expected: len,
            found: self.len().saturating_sub(offset),
        })
    }

    fn find(&self, offset: u64, len: u64) -> Option<&'a [u8]> {
        let start = usize::try_from(offset).ok()?;
        let end = usize::try_from(offset.checked_add(len)?).ok()?;
        self.data.get(start..end)
    }

    fn array<const N: usize>(&self, what: impl Display, offset: u64) -> Result<[u8; N], CameraError> {
        let mut array = [0; N];
        array.copy_from_slice(self.slice(what, offset, N as u64)?);
        Ok(array)
    }

    pub(crate) fn u16(&self, what: impl Display, offset: u64) -> Result<u16, CameraError> {
        self.array(what, offset).map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&self, what: impl Display, offset: u64) -> Result<u32, CameraError> {
        self.array(what, offset).map(u32::from_le_bytes)
    }

    pub(crate) fn i32(&self, what: impl Display, offset: u64) -> Result<i32, CameraError> {
        self.array(what, offset).map(i32::from_le_bytes)
    }

    pub(crate) fn u64(&self, what: impl Display, offset: u64) -> Result<u64, CameraError> {
        self.array(what, offset).map(u64::from_le_bytes)
    }

    /// The error for a value at `offset` that no valid file holds.
    pub(crate) fn malformed(
        &self,
        what: impl Display,
        offset: u64,
        expected: impl Display,
        found: impl Display,
    ) -> CameraError {
        CameraError::Malformed {
            path: self.path.into(),
            what: what.to_string(),
            offset,
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_little_endian() {
        let bytes = Bytes::new(Path::new("a"), &[0x43, 0x49, 0xFF, 0xFF, 1, 0, 0, 0]);
        assert_eq!(bytes.u16("type", 0).unwrap(), 18755);
        assert_eq!(bytes.i32("number", 0).unwrap(), -0xB6BD);
        assert_eq!(bytes.u64("stamp", 0).unwrap(), 0x0000_0001_FFFF_4943);
    }

    #[test]
    fn a_read_outside_names_file_place_and_sizes() {
        let bytes = Bytes::new(Path::new("short.cine"), &[0; 10]);
        let error = bytes.u32("image count", 8).unwrap_err();
        assert_eq!(error.to_string(), "short.cine: image count at byte 8: expected 4 bytes, found 2");
        assert!(bytes.slice("pixels", u64::MAX, 2).is_err());
        assert!(bytes.slice("pixels", 1, u64::MAX).is_err());
    }
}
