//! The geometry of pixels without a header, as a person states it: `WIDTHxHEIGHTxBITS`, and the order of bytes or bits.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

use crate::error::CameraError;
use crate::packing::Packing;
use crate::raster::Raster;

/// How the frames of a file without header lie in it: back to back, rows from the top, without padding.
///
/// Written as `1280x800x8`, `1280x800x12le` (two bytes a pixel, low byte first, which is meant where nothing stands),
/// `1280x800x16be` (high byte first), or `1280x800x12p` (10 or 12 bits packed without gaps, highest bit first).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawGeometry {
    width_px: usize,
    height_px: usize,
    bits: u32,
    packing: Packing,
}

impl RawGeometry {
    /// Columns of a frame.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows of a frame.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// Significant bits of a pixel.
    pub fn bits(&self) -> u32 {
        self.bits
    }

    /// How the rows lie in the file; `None` when a row of packed pixels does not consist of whole bytes.
    pub(crate) fn raster(&self) -> Option<Raster> {
        Raster::plain(self.packing, self.width_px, self.height_px)
    }
}

impl FromStr for RawGeometry {
    type Err = CameraError;

    fn from_str(text: &str) -> Result<Self, CameraError> {
        let refused =
            |expected: &str| CameraError::RawGeometry { expected: expected.into(), found: text.into() };
        let form = "WIDTHxHEIGHTxBITS[le|be|p], such as 1280x800x12le";
        let lower = text.trim().to_ascii_lowercase();
        let parts: Vec<&str> = lower.split('x').collect();
        let [width, height, storage] = parts[..] else { return Err(refused(form)) };
        let digits = storage.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
        // A side is a number of at most 32 bits, so that products of two fit into 64.
        let side = |text: &str| text.parse().ok().filter(|&side: &u32| side > 0).map(|side| side as usize);
        let (Some(width_px), Some(height_px), Ok(bits)) = (side(width), side(height), digits.parse()) else {
            return Err(refused(form));
        };
        let packing = match (bits, &storage[digits.len()..]) {
            (8, "" | "le" | "be") => Packing::Gray8,
            (9..=16, "" | "le") => Packing::Gray16Little,
            (9..=16, "be") => Packing::Gray16Big,
            (10, "p") => Packing::Packed10,
            (12, "p") => Packing::Packed12,
            (_, "p") => return Err(refused("10 or 12 bits where pixels are packed (p)")),
            (8..=16, _) => return Err(refused("le, be, p or nothing behind the bits")),
            _ => return Err(refused("8 to 16 bits")),
        };
        let geometry = Self { width_px, height_px, bits, packing };
        let group_px = packing.group_px();
        let is_whole = geometry.raster().is_some();
        is_whole
            .then_some(geometry)
            .ok_or_else(|| refused(&format!("rows of a multiple of {group_px} pixels")))
    }
}

impl Display for RawGeometry {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let order = match self.packing {
            Packing::Gray8 => "",
            Packing::Gray16Little => "le",
            Packing::Gray16Big => "be",
            Packing::P10 | Packing::Packed10 | Packing::Packed12 => "p",
        };
        write!(formatter, "{}x{}x{}{order}", self.width_px, self.height_px, self.bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geometry_is_read_as_it_is_written() {
        for text in ["1280x800x8", "1280x800x12le", "640x1x16be", "4x4x10p", "1280x800x12p", "3x3x9le"] {
            assert_eq!(text.parse::<RawGeometry>().unwrap().to_string(), text);
        }
        assert_eq!(" 1280X800x16 ".parse::<RawGeometry>().unwrap().to_string(), "1280x800x16le");
        assert_eq!("16x4x8be".parse::<RawGeometry>().unwrap().to_string(), "16x4x8");
    }

    #[test]
    fn what_is_no_geometry_says_what_is_expected() {
        for (text, part) in [
            ("", "WIDTHxHEIGHTxBITS"),
            ("1280x800", "WIDTHxHEIGHTxBITS"),
            ("1280x800x8x2", "WIDTHxHEIGHTxBITS"),
            ("0x800x8", "WIDTHxHEIGHTxBITS"),
            ("-3x800x8", "WIDTHxHEIGHTxBITS"),
            ("99999999999x800x8", "WIDTHxHEIGHTxBITS"),
            ("1280x800xle", "WIDTHxHEIGHTxBITS"),
            ("1280x800x7", "8 to 16 bits"),
            ("1280x800x17", "8 to 16 bits"),
            ("1280x800x12me", "le, be, p"),
            ("1280x800x16p", "10 or 12 bits"),
            ("1279x800x12p", "multiple of 2"),
            ("1282x800x10p", "multiple of 4"),
            ("1280x800x\u{B5}", "WIDTHxHEIGHTxBITS"),
        ] {
            let message = text.parse::<RawGeometry>().unwrap_err().to_string();
            assert!(message.contains(part) && message.contains(&format!("`{text}`")), "{message}");
        }
    }
}
