//! Portable graymaps (PGM): P5, whose pixels are bytes or words, and P2, whose pixels are written as numbers.

use std::path::Path;

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::mapping::map_file;
use crate::packing::Packing;
use crate::picture::{Gray, Picture, Strips};
use crate::raster::Raster;

/// Whether a file that starts with `head` is of the Netpbm family, of which only gray is read.
pub(crate) fn is_netpbm(head: &[u8]) -> bool {
    let is_gap = |byte: &u8| byte.is_ascii_whitespace() || *byte == b'#';
    matches!(head, [b'P', b'1'..=b'7', gap, ..] if is_gap(gap))
}

/// Opens a graymap. Its significant bits follow from the largest value that its header states.
pub(crate) fn load(path: &Path) -> Result<Picture, CameraError> {
    let map = map_file(path)?;
    let bytes = Bytes::new(path, &map);
    let is_text = match bytes.slice("graymap's mark", 0, 2)? {
        b"P5" => false,
        b"P2" => true,
        other => return Err(other_kind(path, other)),
    };
    let mut text = Text { bytes, at: 2 };
    let header = PgmHeader::read(&mut text)?;
    if is_text {
        return header.numbers(text).map(Picture::Decoded);
    }
    // One byte ends the header, and pixels may look like white space.
    let start = text.at + 1;
    let (raster, pixels) = header.pixels(bytes, start)?;
    if header.most == 255 || header.most == 65_535 {
        let strips = Strips::whole(&raster, start);
        return Ok(Picture::Mapped { map, raster, strips, bits: header.bits() });
    }
    let counts: Vec<u16> = match raster.packing {
        Packing::Gray8 => pixels.iter().map(|&byte| byte.into()).collect(),
        _ => pixels.as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect(),
    };
    header.checked(bytes, start, counts).map(Picture::Decoded)
}

fn other_kind(path: &Path, mark: &[u8]) -> CameraError {
    match mark {
        b"P3" | b"P6" => CameraError::Colour { path: path.into(), reason: "a portable pixmap (PPM)".into() },
        _ => CameraError::Unsupported {
            path: path.into(),
            what: format!("a Netpbm image of kind {}", String::from_utf8_lossy(mark)),
            hint: "save it as a graymap, P5".into(),
        },
    }
}

struct PgmHeader {
    width_px: usize,
    height_px: usize,
    /// The largest value that a pixel can have.
    most: u16,
}

impl PgmHeader {
    fn read(text: &mut Text) -> Result<Self, CameraError> {
        let mut side = |what: &str| {
            let at = text.at;
            let side = text.number(what)?;
            let fits = (1..=u64::from(u32::MAX)).contains(&side);
            fits.then_some(side as usize)
                .ok_or_else(|| text.bytes.malformed(what, at, "1 to 4294967295 px", side))
        };
        let (width_px, height_px) = (side("image width")?, side("image height")?);
        let at = text.at;
        let most = text.number("largest value")?;
        match u16::try_from(most) {
            Ok(most @ 1..) => Ok(Self { width_px, height_px, most }),
            _ => Err(text.bytes.malformed("largest value", at, "1 to 65535", most)),
        }
    }

    fn bits(&self) -> u32 {
        u16::BITS - self.most.leading_zeros()
    }

    /// Where the pixels of a P5 lie, of which the file has room for all.
    fn pixels<'a>(&self, bytes: Bytes<'a>, start: u64) -> Result<(Raster, &'a [u8]), CameraError> {
        let packing = if self.most < 256 { Packing::Gray8 } else { Packing::Gray16Big };
        let raster = Raster::plain(packing, self.width_px, self.height_px)
            .ok_or_else(|| bytes.malformed("image width", 2, "a row that fits into a file", self.width_px))?;
        let pixels = bytes.slice("pixels", start, raster.frame_bytes())?;
        let end = start + raster.frame_bytes();
        if bytes.slice("another image", end, 3).is_ok_and(is_netpbm) {
            return Err(CameraError::Unsupported {
                path: bytes.path().into(),
                what: "a file of several graymaps".into(),
                hint: "give each image a file of its own, with its number in the name".into(),
            });
        }
        Ok((raster, pixels))
    }

    /// The pixels of a P2.
    fn numbers(&self, mut text: Text) -> Result<Gray, CameraError> {
        let (bytes, start) = (text.bytes, text.at);
        let n_pixels = self.width_px as u64 * self.height_px as u64;
        // A number takes a digit, and a gap parts it from the next: nothing is allocated that the file cannot fill.
        bytes.slice("pixels", start, n_pixels.saturating_mul(2).saturating_sub(1))?;
        let mut counts = Vec::with_capacity(n_pixels as usize);
        for _ in 0..n_pixels {
            // What is too large for 16 bits is above the largest value.
            counts.push(u16::try_from(text.number("pixel")?).unwrap_or(u16::MAX));
        }
        self.checked(bytes, start, counts)
    }

    fn checked(&self, bytes: Bytes, start: u64, counts: Vec<u16>) -> Result<Gray, CameraError> {
        if let Some(count) = counts.iter().find(|&&count| count > self.most) {
            return Err(bytes.malformed("pixel", start, format_args!("at most {}", self.most), count));
        }
        Ok(Gray { width_px: self.width_px, height_px: self.height_px, bits: self.bits(), counts })
    }
}

/// Numbers with white space and comments between them.
struct Text<'a> {
    bytes: Bytes<'a>,
    at: u64,
}

impl Text<'_> {
    fn next(&self) -> Option<u8> {
        self.bytes.slice("", self.at, 1).ok().and_then(|byte| byte.first().copied())
    }

    fn number(&mut self, what: &str) -> Result<u64, CameraError> {
        self.skip_gap();
        let start = self.at;
        let mut number = None;
        while let Some(digit) = self.next().and_then(|byte| char::from(byte).to_digit(10)) {
            number = Some(number.unwrap_or(0_u64).saturating_mul(10).saturating_add(digit.into()));
            self.at += 1;
        }
        match (number, self.next()) {
            (Some(number), Some(byte)) if byte.is_ascii_whitespace() || byte == b'#' => Ok(number),
            // A number at the very end may have lost digits.
            (_, None) => {
                let n_found = self.at - start;
                self.bytes.slice(what, start, n_found + 1).map(|_| 0)
            }
            (_, Some(byte)) => {
                Err(self.bytes.malformed(what, self.at, "a number", format_args!("byte {byte:02X}")))
            }
        }
    }

    fn skip_gap(&mut self) {
        let mut is_comment = false;
        while let Some(byte) = self.next() {
            is_comment = if is_comment { byte != b'\n' } else { byte == b'#' };
            if !is_comment && !byte.is_ascii_whitespace() {
                break;
            }
            self.at += 1;
        }
    }
}
