//! The header of a NumPy array: element type, order and shape.

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::packing::Packing;

pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// What the array's header says.
pub(super) struct NpyHeader {
    pub(super) packing: Packing,
    pub(super) n_frames: usize,
    pub(super) height_px: usize,
    pub(super) width_px: usize,
    /// Where the header's text starts.
    pub(super) text_offset: u64,
    /// Where the first element starts.
    pub(super) data_offset: u64,
}

impl NpyHeader {
    pub(super) fn read(bytes: Bytes) -> Result<Self, CameraError> {
        let version = bytes.slice("format version", 6, 2)?[0];
        let (text_offset, text_bytes) = match version {
            1 => (10, u64::from(bytes.u16("header size", 8)?)),
            2 | 3 => (12, u64::from(bytes.u32("header size", 8)?)),
            other => return Err(bytes.malformed("format version", 6, "1, 2 or 3", other)),
        };
        let text = String::from_utf8_lossy(bytes.slice("array header", text_offset, text_bytes)?);
        let text = Text { bytes, offset: text_offset, text: &text };
        let (n_frames, height_px, width_px) = text.shape()?;
        text.refuse_columns_first()?;
        let data_offset = text_offset + text_bytes;
        Ok(Self { packing: text.packing()?, n_frames, height_px, width_px, text_offset, data_offset })
    }
}

/// The header's text: a Python dictionary of three known keys.
struct Text<'a> {
    bytes: Bytes<'a>,
    offset: u64,
    text: &'a str,
}

impl Text<'_> {
    /// What follows `'key':`.
    fn value(&self, key: &str) -> Result<&str, CameraError> {
        let quoted = format!("'{key}':");
        let value = self.text.split_once(&quoted).map(|(_, value)| value.trim_start());
        value.ok_or_else(|| self.other(key, "a value", "none"))
    }

    fn other(&self, what: &str, expected: &str, found: &str) -> CameraError {
        self.bytes.malformed(format_args!("array's {what}"), self.offset, expected, found)
    }

    fn unsupported(&self, what: String, hint: &str) -> CameraError {
        CameraError::Unsupported { path: self.bytes.path().into(), what, hint: hint.into() }
    }

    fn packing(&self) -> Result<Packing, CameraError> {
        let value = self.value("descr")?;
        let descr = value.strip_prefix('\'').and_then(|rest| rest.split_once('\'')).map(|(descr, _)| descr);
        match descr {
            Some("|u1" | "<u1" | ">u1") => Ok(Packing::Gray8),
            Some("<u2") => Ok(Packing::Gray16Little),
            Some(">u2") => Ok(Packing::Gray16Big),
            Some(other) => Err(self.unsupported(
                format!("an array of type {other}"),
                "save the counts as numpy.uint8 or numpy.uint16",
            )),
            None => Err(self.unsupported("an array of records".into(), "save the counts as a plain array")),
        }
    }

    fn refuse_columns_first(&self) -> Result<(), CameraError> {
        let value = self.value("fortran_order")?;
        if value.starts_with("False") {
            return Ok(());
        }
        if !value.starts_with("True") {
            return Err(self.other("fortran_order", "True or False", value.get(..8).unwrap_or(value)));
        }
        Err(self.unsupported(
            "an array that is stored column by column".into(),
            "save numpy.ascontiguousarray(frames)",
        ))
    }

    /// Frames, rows and columns; an array of two axes is one frame.
    fn shape(&self) -> Result<(usize, usize, usize), CameraError> {
        let expected = "(frames, rows, columns), each at least 1";
        let value = self.value("shape")?;
        let inner = value.strip_prefix('(').and_then(|rest| rest.split_once(')')).map(|(inner, _)| inner);
        let parts = inner.unwrap_or_default().split(',').map(str::trim).filter(|part| !part.is_empty());
        let axes: Option<Vec<usize>> = parts.map(|part| part.parse().ok().filter(|&n| n > 0)).collect();
        match axes.as_deref() {
            Some(&[n_frames, height_px, width_px]) => Ok((n_frames, height_px, width_px)),
            Some(&[height_px, width_px]) => Ok((1, height_px, width_px)),
            _ => Err(self.other("shape", expected, inner.unwrap_or("none"))),
        }
    }
}
