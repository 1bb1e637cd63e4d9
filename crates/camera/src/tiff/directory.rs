//! Image file directories of TIFF and BigTIFF, read in either byte order.

use std::collections::BTreeSet;

use crate::bytes::Bytes;
use crate::error::CameraError;

/// Classic TIFF's and BigTIFF's numbers behind the byte order's mark.
const CLASSIC: u16 = 42;
const BIG: u16 = 43;
/// No tag of an image has more numbers than this; a damaged one must not fill the memory.
const MOST_VALUES: u64 = 1 << 20;

/// Whether a file that starts with `head` is a TIFF.
pub(crate) fn is_tiff(head: &[u8]) -> bool {
    [b"II\x2A\0", b"II\x2B\0", b"MM\0\x2A", b"MM\0\x2B"].iter().any(|mark| head.starts_with(*mark))
}

/// Reads a TIFF's numbers in its own byte order and width.
#[derive(Clone, Copy)]
pub(super) struct Reader<'a> {
    pub(super) bytes: Bytes<'a>,
    pub(super) high_byte_first: bool,
    is_big: bool,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: Bytes<'a>) -> Result<Self, CameraError> {
        let high_byte_first = bytes.slice("byte order", 0, 2)? == b"MM";
        let reader = Self { bytes, high_byte_first, is_big: false };
        match reader.number("TIFF's version", 2, 2)? as u16 {
            CLASSIC => Ok(reader),
            BIG => Ok(Self { is_big: true, ..reader }),
            other => Err(bytes.malformed("TIFF's version", 2, "42 or 43", other)),
        }
    }

    /// A number of `size` bytes, at most eight.
    fn number(&self, what: &str, offset: u64, size: u64) -> Result<u64, CameraError> {
        let stored = self.bytes.slice(what, offset, size)?.iter();
        let join = |value: u64, &byte: &u8| value << 8 | u64::from(byte);
        Ok(if self.high_byte_first { stored.fold(0, join) } else { stored.rev().fold(0, join) })
    }

    /// Bytes of an offset.
    fn word(&self) -> u64 {
        if self.is_big { 8 } else { 4 }
    }

    /// The directories of the file's images, in their order.
    pub(super) fn directories(&self) -> Result<Vec<Directory>, CameraError> {
        let mut directories = Vec::new();
        self.walk(&mut directories).map(|()| directories)
    }

    /// Appends the directories of the file's images, in their order, as far as they can be read, and says what ended it.
    pub(super) fn walk(&self, directories: &mut Vec<Directory>) -> Result<(), CameraError> {
        let mut seen = BTreeSet::new();
        let mut n_bytes = 0;
        let mut at = self.number("first directory's offset", if self.is_big { 8 } else { 4 }, self.word())?;
        while at != 0 {
            if !seen.insert(at) {
                return Err(self.bytes.malformed("directory", at, "each directory once", "it again"));
            }
            let directory = self.directory(at)?;
            n_bytes += directory.end - at;
            if n_bytes > self.bytes.len() {
                return Err(self.bytes.malformed(
                    "directory",
                    at,
                    "directories apart from each other",
                    "overlap",
                ));
            }
            at = self.number("next directory's offset", directory.end, self.word())?;
            directories.push(directory);
        }
        Ok(())
    }

    /// The error for a file without images.
    pub(super) fn no_image(&self) -> CameraError {
        self.bytes.malformed("first directory's offset", 4, "at least one image", "none")
    }

    fn directory(&self, offset: u64) -> Result<Directory, CameraError> {
        let count_bytes = if self.is_big { 8 } else { 2 };
        let entry_bytes = 4 + 2 * self.word();
        let n_entries = self.number("number of entries", offset, count_bytes)?;
        let first = offset + count_bytes;
        self.bytes.slice("directory", first, n_entries.saturating_mul(entry_bytes))?;
        let end = first + n_entries * entry_bytes;
        let starts = (0..n_entries).map(|index| first + index * entry_bytes);
        Ok(Directory { offset, end, entries: starts.map(|at| self.entry(at)).collect::<Result<_, _>>()? })
    }

    fn entry(&self, at: u64) -> Result<Entry, CameraError> {
        Ok(Entry {
            tag: self.number("tag", at, 2)? as u16,
            kind: self.number("type", at + 2, 2)? as u16,
            count: self.number("count", at + 4, self.word())?,
            value_at: at + 4 + self.word(),
        })
    }

    /// Where an entry's values start: in the entry itself when they fit.
    fn place(&self, entry: &Entry, value_bytes: u64) -> Result<u64, CameraError> {
        if entry.count.saturating_mul(value_bytes) <= self.word() {
            return Ok(entry.value_at);
        }
        self.number("values' offset", entry.value_at, self.word())
    }

    /// The unsigned numbers of a tag; `None` when the directory lacks it.
    pub(super) fn values(&self, directory: &Directory, tag: u16) -> Result<Option<Vec<u64>>, CameraError> {
        let Some(entry) = directory.find(tag) else { return Ok(None) };
        if !matches!(entry.kind, 1 | 3 | 4 | 16) {
            let what = format_args!("type of tag {tag}");
            return Err(self.bytes.malformed(what, entry.value_at, "unsigned integers", entry.kind));
        }
        let value_bytes = value_bytes(entry.kind);
        if entry.count > MOST_VALUES {
            let what = format_args!("number of values of tag {tag}");
            let expected = format_args!("at most {MOST_VALUES}");
            return Err(self.bytes.malformed(what, entry.value_at, expected, entry.count));
        }
        let start = self.place(entry, value_bytes)?;
        // Checked before anything is allocated for it.
        self.bytes.slice(format_args!("tag {tag}"), start, entry.count.saturating_mul(value_bytes))?;
        let starts = (0..entry.count).map(|index| start + index * value_bytes);
        starts.map(|at| self.number("value", at, value_bytes)).collect::<Result<_, _>>().map(Some)
    }

    /// The only or first number of a tag.
    pub(super) fn value(&self, directory: &Directory, tag: u16) -> Result<Option<u64>, CameraError> {
        Ok(self.values(directory, tag)?.and_then(|values| values.first().copied()))
    }

    /// Refuses a directory with values, of whatever tag, that the file has no room for.
    pub(super) fn check_all(&self, directory: &Directory) -> Result<(), CameraError> {
        for entry in &directory.entries {
            let n_bytes = entry.count.saturating_mul(value_bytes(entry.kind));
            let start = self.place(entry, value_bytes(entry.kind))?;
            self.bytes.slice(format_args!("tag {}", entry.tag), start, n_bytes)?;
        }
        Ok(())
    }

    /// The text of a tag.
    pub(super) fn text(&self, directory: &Directory, tag: u16) -> Option<String> {
        let entry = directory.find(tag).filter(|entry| entry.kind == 2)?;
        let text = self.bytes.slice("text", self.place(entry, 1).ok()?, entry.count).ok()?;
        // Older programs write one byte a character.
        let latin1 = || text.iter().map(|&byte| char::from(byte)).collect();
        let text = std::str::from_utf8(text).map_or_else(|_| latin1(), str::to_owned);
        Some(text.trim_end_matches('\0').to_owned())
    }
}

/// Bytes of one value of a type; 1 of a type that does not exist.
fn value_bytes(kind: u16) -> u64 {
    match kind {
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        _ => 1,
    }
}

/// What describes one image.
pub(super) struct Directory {
    /// Where it starts, in bytes from the start of the file.
    pub(super) offset: u64,
    end: u64,
    entries: Vec<Entry>,
}

impl Directory {
    fn find(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }
}

struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    value_at: u64,
}
