//! Windows bitmaps of 8, 24 or 32 bits without compression.

use std::path::Path;

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::mapping::map_file;
use crate::packing::Packing;
use crate::picture::{Gray, Picture, Strips};
use crate::raster::Raster;

/// Bytes before the information header.
const FILE_HEADER: u64 = 14;
/// The oldest information header that is read; all newer ones begin like it.
const LEAST_INFO_BYTES: u32 = 40;
const MOST_INFO_BYTES: u32 = 124;
const UNCOMPRESSED: u32 = 0;

/// Whether a file that starts with `head` is a bitmap: two letters, and a header of a size that exists.
pub(crate) fn is_bmp(head: &[u8]) -> bool {
    let size = head.get(FILE_HEADER as usize..).and_then(|rest| rest.first_chunk().copied());
    let sizes = LEAST_INFO_BYTES..=MOST_INFO_BYTES;
    head.starts_with(b"BM") && size.is_some_and(|size| sizes.contains(&u32::from_le_bytes(size)))
}

/// Opens a Windows bitmap: 8 bits with a gray palette, or 24 or 32 bits whose colours are equal.
pub(crate) fn load(path: &Path) -> Result<Picture, CameraError> {
    let map = map_file(path)?;
    let bytes = Bytes::new(path, &map);
    let header = BmpHeader::read(bytes)?;
    let stored = bytes.slice("pixels", header.pixels_offset, header.n_bytes())?;
    if header.bits > 8 {
        let gray = |pixel: &[u8]| (pixel[0] == pixel[1] && pixel[1] == pixel[2]).then_some(pixel[0]);
        return header.decoded(path, stored, gray).map(Picture::Decoded);
    }
    let levels = header.levels(bytes)?;
    let is_plain = levels.iter().enumerate().all(|(index, &level)| Some(index) == level.map(usize::from));
    match header.raster().filter(|_| is_plain) {
        Some(raster) => {
            let strips = Strips::whole(&raster, header.pixels_offset);
            Ok(Picture::Mapped { map, raster, strips, bits: 8 })
        }
        None => {
            let gray = |pixel: &[u8]| levels.get(usize::from(pixel[0])).copied().flatten();
            header.decoded(path, stored, gray).map(Picture::Decoded)
        }
    }
}

struct BmpHeader {
    pixels_offset: u64,
    info_bytes: u32,
    width_px: u32,
    height_px: u32,
    bottom_row_first: bool,
    /// 8, 24 or 32.
    bits: u16,
}

impl BmpHeader {
    fn read(bytes: Bytes) -> Result<Self, CameraError> {
        let info_bytes = bytes.u32("information header's size", FILE_HEADER)?;
        if info_bytes < LEAST_INFO_BYTES {
            return Err(bytes.malformed("information header's size", FILE_HEADER, "at least 40", info_bytes));
        }
        let (width_px, height_px) = (bytes.i32("image width", 18)?, bytes.i32("image height", 22)?);
        if width_px <= 0 || height_px == 0 {
            let found = format_args!("{width_px} x {height_px} px");
            return Err(bytes.malformed("image size", 18, "at least one pixel", found));
        }
        let bits = bytes.u16("bits per pixel", 28)?;
        let compression = bytes.u32("compression", 30)?;
        if !matches!(bits, 8 | 24 | 32) || compression != UNCOMPRESSED {
            return Err(CameraError::Unsupported {
                path: bytes.path().into(),
                what: format!("a bitmap of {bits} bits with compression {compression}"),
                hint: "8, 24 or 32 bits without compression are readable".into(),
            });
        }
        Ok(Self {
            pixels_offset: bytes.u32("pixels' offset", 10)?.into(),
            info_bytes,
            width_px: width_px.unsigned_abs(),
            height_px: height_px.unsigned_abs(),
            bottom_row_first: height_px > 0,
            bits,
        })
    }

    fn pixel_bytes(&self) -> usize {
        usize::from(self.bits / 8)
    }

    /// Rows are filled up to whole groups of four bytes.
    fn row_bytes(&self) -> usize {
        (self.width_px as usize * self.pixel_bytes()).next_multiple_of(4)
    }

    fn n_bytes(&self) -> u64 {
        (self.row_bytes() as u64).saturating_mul(self.height_px.into())
    }

    fn raster(&self) -> Option<Raster> {
        let plain = Raster::plain(Packing::Gray8, self.width_px as usize, self.height_px as usize)?;
        Some(Raster { row_bytes: self.row_bytes(), bottom_row_first: self.bottom_row_first, ..plain })
    }

    /// The palette's gray levels; `None` for a colour, which no pixel should have.
    fn levels(&self, bytes: Bytes) -> Result<Vec<Option<u8>>, CameraError> {
        let n_stated = bytes.u32("colours in the palette", 46)?;
        let n_colours = if n_stated == 0 { 256 } else { n_stated.min(256) };
        let start = FILE_HEADER + u64::from(self.info_bytes);
        let entries = bytes.slice("palette", start, u64::from(n_colours) * 4)?.as_chunks().0;
        let level = |&[blue, green, red, _]: &[u8; 4]| (blue == green && green == red).then_some(blue);
        Ok(entries.iter().map(level).collect())
    }

    /// The picture, each pixel by `level` of its bytes; refused when that is a colour.
    fn decoded(
        &self,
        path: &Path,
        stored: &[u8],
        level: impl Fn(&[u8]) -> Option<u8>,
    ) -> Result<Gray, CameraError> {
        let (width_px, height_px) = (self.width_px as usize, self.height_px as usize);
        let mut counts = Vec::with_capacity(width_px * height_px);
        for y in 0..height_px {
            let row = if self.bottom_row_first { height_px - 1 - y } else { y };
            let row = &stored[row * self.row_bytes()..][..width_px * self.pixel_bytes()];
            for pixel in row.chunks_exact(self.pixel_bytes()) {
                let level = level(pixel).ok_or_else(|| CameraError::Colour {
                    path: path.into(),
                    reason: format!("row {y} holds a pixel that is not gray"),
                })?;
                counts.push(level.into());
            }
        }
        Ok(Gray { width_px, height_px, bits: 8, counts })
    }
}
