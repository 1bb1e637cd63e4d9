//! One image of a TIFF: its tags checked, and where its rows or strips lie.

use super::directory::{Directory, Reader};
use crate::error::CameraError;
use crate::packing::Packing;
use crate::picture::{PictureShape, Strips, is_plausible};
use crate::raster::Raster;

const SUBFILE_TYPE: u16 = 254;
const WIDTH: u16 = 256;
const HEIGHT: u16 = 257;
const BITS: u16 = 258;
const COMPRESSION: u16 = 259;
const PHOTOMETRIC: u16 = 262;
const FILL_ORDER: u16 = 266;
const STRIP_OFFSETS: u16 = 273;
pub(super) const ORIENTATION: u16 = 274;
pub(super) const SAMPLES: u16 = 277;
const ROWS_PER_STRIP: u16 = 278;
const STRIP_SIZES: u16 = 279;
const PLANAR: u16 = 284;
const COLOUR_MAP: u16 = 320;
const TILE_WIDTH: u16 = 322;
const TILE_OFFSETS: u16 = 324;
const TILE_SIZES: u16 = 325;
const EXTRA_SAMPLES: u16 = 338;
const SAMPLE_FORMAT: u16 = 339;

/// Compressions that are decoded: none, LZW, deflate (two numbers) and PackBits.
const READABLE: [u64; 5] = [1, 5, 8, 32_773, 32_946];
const UNCOMPRESSED: u64 = 1;

/// One image of a TIFF.
pub(super) struct Page {
    pub(super) shape: PictureShape,
    /// A reduced copy of another image.
    pub(super) is_thumbnail: bool,
    pub(super) storage: PageStorage,
}

pub(super) enum PageStorage {
    /// Rows lie in the file as they are.
    Plain { raster: Raster, strips: Strips },
    /// Compressed, in tiles, inverted, or gray written as colours: the whole image is decoded.
    Coded,
}

impl Page {
    pub(super) fn read(reader: &Reader, directory: &Directory) -> Result<Self, CameraError> {
        let page = PageFields { reader, directory };
        let (width_px, height_px) = (page.side("image width", WIDTH)?, page.side("image height", HEIGHT)?);
        let bits = page.bits()?;
        page.refuse_other_kinds()?;
        page.refuse_other_samples()?;
        let storage = match page.packing(bits)? {
            Some(packing) => page.plain(packing, width_px, height_px)?,
            None => page.coded(width_px, height_px)?,
        };
        let is_thumbnail = page.number(SUBFILE_TYPE, 0)? & 1 == 1;
        Ok(Self { shape: PictureShape { width_px, height_px, bits }, is_thumbnail, storage })
    }
}

struct PageFields<'a> {
    reader: &'a Reader<'a>,
    directory: &'a Directory,
}

impl PageFields<'_> {
    fn number(&self, tag: u16, default: u64) -> Result<u64, CameraError> {
        Ok(self.reader.value(self.directory, tag)?.unwrap_or(default))
    }

    fn malformed(&self, what: &str, expected: &str, found: u64) -> CameraError {
        self.reader.bytes.malformed(what, self.directory.offset, expected, found)
    }

    fn unsupported(&self, what: &str, hint: &str) -> CameraError {
        let at = self.directory.offset;
        let what = format!("{what} (directory at byte {at})");
        CameraError::Unsupported { path: self.reader.bytes.path().into(), what, hint: hint.into() }
    }

    fn side(&self, what: &str, tag: u16) -> Result<usize, CameraError> {
        let side = self.number(tag, 0)?;
        // A side is a number of at most 32 bits, so that products of two fit into 64.
        let valid = u32::try_from(side).ok().filter(|&side| side > 0);
        valid.map(|side| side as usize).ok_or_else(|| self.malformed(what, "1 to 4294967295 px", side))
    }

    fn bits(&self) -> Result<u32, CameraError> {
        let bits = self.reader.values(self.directory, BITS)?.unwrap_or_else(|| vec![1]);
        match (bits.first().copied(), bits.windows(2).all(|pair| pair[0] == pair[1])) {
            (Some(bits @ (8 | 10 | 12 | 16)), true) => Ok(bits as u32),
            _ => Err(self.unsupported(&format!("{bits:?} bits per sample"), "8, 10, 12 or 16 are readable")),
        }
    }

    fn refuse_other_kinds(&self) -> Result<(), CameraError> {
        let path = || self.reader.bytes.path().into();
        match self.number(SAMPLE_FORMAT, 1)? {
            1 => {}
            2 => return Err(self.unsupported("signed integers", "save unsigned counts")),
            3 => return Err(self.unsupported("floating point", "save counts as integers of 16 bits")),
            other => return Err(self.malformed("sample format", "1, 2 or 3", other)),
        }
        // Cameras write the top row first; a turned picture would give positions along other axes than were filmed.
        if self.number(ORIENTATION, 1)? != 1 {
            return Err(self
                .unsupported("a turned or mirrored picture", "save with the top row first, orientation 1"));
        }
        match self.number(PHOTOMETRIC, 1)? {
            0..=2 => {}
            3 if self.is_gray_palette()? => {}
            3 => return Err(CameraError::Colour { path: path(), reason: "a palette of colours".into() }),
            other => {
                let reason = format!("photometric interpretation {other}");
                return Err(CameraError::Colour { path: path(), reason });
            }
        }
        let compression = self.number(COMPRESSION, UNCOMPRESSED)?;
        if !READABLE.contains(&compression) {
            let hint = "none, LZW, deflate and PackBits are readable";
            return Err(self.unsupported(&format!("compression {compression}"), hint));
        }
        Ok(())
    }

    /// Refuses pixels of several samples but gray written as colours, and either with opacity: other samples are other pictures.
    fn refuse_other_samples(&self) -> Result<(), CameraError> {
        const RGB: u64 = 2;
        let n_samples = self.number(SAMPLES, 1)?;
        if !(1..=4).contains(&n_samples) {
            return Err(self.malformed("samples per pixel", "1 to 4", n_samples));
        }
        if n_samples == 1 {
            return Ok(());
        }
        match self.number(PLANAR, 1)? {
            1 => {}
            2 => {
                let what = format!(
                    "{n_samples} samples a pixel, each in a plane of its own (planar configuration 2)"
                );
                return Err(self.unsupported(&what, "save as gray, with one sample a pixel"));
            }
            other => return Err(self.malformed("planar configuration", "1 or 2", other)),
        }
        let is_colours = self.number(PHOTOMETRIC, 1)? == RGB;
        // 1 and 2 of its kinds are opacity. Programs leave it out behind colours, where four samples can be nothing else.
        let extra = self.reader.values(self.directory, EXTRA_SAMPLES)?.unwrap_or_default();
        match (is_colours, n_samples, extra.as_slice()) {
            (true, 3 | 4, _) | (false, 2, [1 | 2]) => Ok(()),
            _ => {
                let what = format!("a picture of {n_samples} channels");
                Err(self.unsupported(&what, "save one channel, as gray with one sample a pixel"))
            }
        }
    }

    /// Whether the palette's entries are gray and rise in equal steps, so that a pixel's index is its count.
    fn is_gray_palette(&self) -> Result<bool, CameraError> {
        let map = self.reader.values(self.directory, COLOUR_MAP)?.unwrap_or_default();
        let n = map.len() / 3;
        let (red, others) = map.split_at(n);
        let is_gray = others.len() == 2 * n && others.chunks(n.max(1)).all(|colour| colour == red);
        // Programs write 16-bit entries as 257 or 256 times the index.
        let rises = |step: u64| red.iter().enumerate().all(|(index, &level)| level == step * index as u64);
        Ok(n > 1 && is_gray && (rises(257) || rises(256)))
    }

    /// How pixels are packed when they lie in the file as they are; `None` when they must be decoded.
    fn packing(&self, bits: u32) -> Result<Option<Packing>, CameraError> {
        let is_gray = self.number(SAMPLES, 1)? == 1 && matches!(self.number(PHOTOMETRIC, 1)?, 1 | 3);
        let is_plain = self.number(COMPRESSION, UNCOMPRESSED)? == UNCOMPRESSED
            && self.reader.value(self.directory, TILE_WIDTH)?.is_none();
        let packing = match (bits, self.reader.high_byte_first) {
            (8, _) => Packing::Gray8,
            (10, _) => Packing::Packed10,
            (12, _) => Packing::Packed12,
            (_, true) => Packing::Gray16Big,
            (_, false) => Packing::Gray16Little,
        };
        if self.number(FILL_ORDER, 1)? != 1 {
            return Err(self.unsupported("bits in reverse order", "save with fill order 1"));
        }
        Ok((is_gray && is_plain).then_some(packing))
    }

    fn plain(&self, packing: Packing, width_px: usize, height_px: usize) -> Result<PageStorage, CameraError> {
        let raster = Raster::plain(packing, width_px, height_px).ok_or_else(|| {
            let what = format!("rows of {width_px} pixels of {} bits", packing.stored_bits());
            self.unsupported(&what, &format!("a row is a multiple of {} pixels", packing.group_px()))
        })?;
        let rows = self.number(ROWS_PER_STRIP, u64::MAX)?;
        if rows == 0 {
            return Err(self.malformed("rows per strip", "at least 1", rows));
        }
        let rows = usize::try_from(rows).unwrap_or(usize::MAX).min(height_px);
        let offsets = self.reader.values(self.directory, STRIP_OFFSETS)?.unwrap_or_default();
        if offsets.len() != height_px.div_ceil(rows) {
            let expected = format!("{}", height_px.div_ceil(rows));
            return Err(self.malformed("number of strips", &expected, offsets.len() as u64));
        }
        let strips = Strips::new(&raster, rows, offsets);
        for (offset, n_bytes) in strips.extents(&raster) {
            self.reader.bytes.slice("strip", offset, n_bytes)?;
        }
        Ok(PageStorage::Plain { raster, strips })
    }

    fn coded(&self, width_px: usize, height_px: usize) -> Result<PageStorage, CameraError> {
        let n_samples = self.number(SAMPLES, 1)?;
        let n_numbers = width_px as u128 * height_px as u128 * u128::from(n_samples);
        if !is_plausible(n_numbers, self.reader.bytes.len()) {
            return Err(self.malformed("image size", "one that the file's bytes can hold", width_px as u64));
        }
        self.check_pieces()?;
        self.reader.check_all(self.directory)?;
        Ok(PageStorage::Coded)
    }

    /// Refuses strips or tiles that the file has no room for, for which the decoder would make room in memory.
    fn check_pieces(&self) -> Result<(), CameraError> {
        let values = |tag| self.reader.values(self.directory, tag).map(Option::unwrap_or_default);
        let mut n_pieces = 0;
        for (offsets, sizes) in [(STRIP_OFFSETS, STRIP_SIZES), (TILE_OFFSETS, TILE_SIZES)] {
            let (offsets, sizes) = (values(offsets)?, values(sizes)?);
            if offsets.len() != sizes.len() {
                let expected = format!("as many as the {} offsets", offsets.len());
                return Err(self.malformed("sizes of strips or tiles", &expected, sizes.len() as u64));
            }
            n_pieces += offsets.len();
            for (offset, size) in offsets.into_iter().zip(sizes) {
                self.reader.bytes.slice("strip or tile", offset, size)?;
            }
        }
        if n_pieces == 0 {
            return Err(self.malformed("strips or tiles", "at least 1", 0));
        }
        Ok(())
    }
}
