//! The two fixed headers of a .cine: the file's own and the bitmap's.

use crate::bytes::Bytes;
use crate::error::CameraError;

const HEADER_BYTES: u16 = 44;
const BITMAP_BYTES: u64 = 40;

/// Time stamps and exposures count in units of 2^-32 s.
pub(super) const TICKS_PER_SECOND: f64 = 4_294_967_296.0;

/// What CINEFILEHEADER and BITMAPINFOHEADER say, as far as it matters here.
pub(super) struct CineHeader {
    /// 0: gray or interpolated colour; 1: compressed by a vendor library; 2: raw colour mosaic.
    pub(super) compression: u16,
    pub(super) pointer_width: PointerWidth,
    /// Number of the first image in the file; the trigger is image 0.
    pub(super) first_image: i32,
    /// Number of the first image that the camera's memory held, of which the file may be a part.
    pub(super) first_in_memory: i32,
    pub(super) n_images: u32,
    pub(super) bitmap_offset: u64,
    pub(super) setup_offset: u64,
    pub(super) pointers_offset: u64,
    /// Trigger time: seconds since 1970 in units of 2^-32 s.
    pub(super) trigger: u64,
    pub(super) width_px: usize,
    pub(super) height_px: usize,
    /// Bits of a stored pixel; 16 for packed pixels too.
    pub(super) bit_count: u16,
    /// 0: plain; otherwise how pixels are packed.
    pub(super) bitmap_compression: u32,
    /// Bytes of one frame's pixels.
    pub(super) image_bytes: u32,
    /// Number of gray levels.
    pub(super) n_levels: u32,
}

impl CineHeader {
    /// Seconds from 1970 to the trigger; `None` where the camera's clock was not set.
    pub(super) fn triggered_unix_s(&self) -> Option<f64> {
        (self.trigger >> 32 > 0).then_some(self.trigger as f64 / TICKS_PER_SECOND)
    }

    pub(super) fn read(bytes: Bytes) -> Result<Self, CameraError> {
        bytes.slice("cine header", 0, HEADER_BYTES.into())?;
        let size = bytes.u16("header size", 2)?;
        if size < HEADER_BYTES {
            return Err(bytes.malformed("header size", 2, HEADER_BYTES, size));
        }
        let bitmap = u64::from(bytes.u32("bitmap header offset", 0x18)?);
        bytes.slice("bitmap header", bitmap, BITMAP_BYTES)?;
        Ok(Self {
            compression: bytes.u16("compression", 4)?,
            pointer_width: PointerWidth::read(bytes)?,
            first_in_memory: bytes.i32("first image in memory", 8)?,
            first_image: bytes.i32("first image number", 0x10)?,
            n_images: n_images(bytes)?,
            bitmap_offset: bitmap,
            setup_offset: bytes.u32("setup offset", 0x1C)?.into(),
            pointers_offset: bytes.u32("image pointers offset", 0x20)?.into(),
            trigger: bytes.u64("trigger time", 0x24)?,
            width_px: side_px(bytes, "image width", bitmap + 4)?,
            height_px: side_px(bytes, "image height", bitmap + 8)?,
            bit_count: bytes.u16("bits per pixel", bitmap + 0xE)?,
            bitmap_compression: bytes.u32("bitmap compression", bitmap + 0x10)?,
            image_bytes: bytes.u32("image size", bitmap + 0x14)?,
            n_levels: bytes.u32("number of levels", bitmap + 0x24)?,
        })
    }
}

fn n_images(bytes: Bytes) -> Result<u32, CameraError> {
    match bytes.u32("image count", 0x14)? {
        0 => Err(bytes.malformed("image count", 0x14, "at least 1", 0)),
        count => Ok(count),
    }
}

fn side_px(bytes: Bytes, what: &str, offset: u64) -> Result<usize, CameraError> {
    let side = bytes.i32(what, offset)?;
    usize::try_from(side)
        .ok()
        .filter(|&side| side > 0)
        .ok_or_else(|| bytes.malformed(what, offset, "at least 1 px", side))
}

/// How wide the pointers to the frames are: four bytes in old files (below 4 GB), eight since.
#[derive(Clone, Copy)]
pub(super) enum PointerWidth {
    Bits32,
    Bits64,
}

impl PointerWidth {
    fn read(bytes: Bytes) -> Result<Self, CameraError> {
        match bytes.u16("header version", 6)? {
            0 => Ok(Self::Bits32),
            1 => Ok(Self::Bits64),
            other => Err(bytes.malformed("header version", 6, "0 or 1", other)),
        }
    }

    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::Bits32 => 4,
            Self::Bits64 => 8,
        }
    }

    /// Offsets from a table's bytes. A negative pointer becomes a huge one, which no file reaches.
    pub(super) fn decode(self, table: &[u8]) -> Vec<u64> {
        match self {
            Self::Bits32 => table.as_chunks().0.iter().map(|&raw| u32::from_le_bytes(raw).into()).collect(),
            Self::Bits64 => table.as_chunks().0.iter().map(|&raw| u64::from_le_bytes(raw)).collect(),
        }
    }
}
