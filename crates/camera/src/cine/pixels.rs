//! How a .cine stores its pixels: bit depth, packing, order of rows.

use super::header::CineHeader;
use super::setup::Setup;
use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::packing::Packing;
use crate::raster::Raster;
use crate::stated_depth::CheckedRows;

/// A frame begins with two sizes of four bytes; annotations may stand between them.
pub(super) const FRAME_HEAD_BYTES: u64 = 8;
/// Bits of a linearised P10 pixel and of a P12L pixel.
const PACKED_DEPTH: u32 = 12;

/// How a frame's pixels lie in the file.
pub(super) struct PixelLayout {
    pub(super) storage: CineStorage,
    pub(super) raster: Raster,
    /// Significant bits of an unpacked pixel.
    pub(super) bit_depth: u32,
    /// Bytes of one frame's pixels.
    pub(super) frame_bytes: u64,
}

impl PixelLayout {
    pub(super) fn of(bytes: Bytes, header: &CineHeader, setup: &Setup) -> Result<Self, CameraError> {
        let storage = CineStorage::of(bytes, header, setup)?;
        let (width_px, height_px) = (header.width_px, header.height_px);
        let size_at = header.bitmap_offset + 0x14;
        let Some(raster) = storage.raster(width_px, height_px) else {
            let group_px = storage.packing().group_px();
            let expected = format_args!("a multiple of {group_px} px ({})", storage.name());
            return Err(bytes.malformed("image width", header.bitmap_offset + 4, expected, width_px));
        };
        // Both sides are positive 32-bit integers, so only their product can be too large for the size word.
        let frame_bytes = raster.frame_bytes();
        if frame_bytes != u64::from(header.image_bytes) {
            let expected = format_args!("{frame_bytes} bytes for {width_px} x {height_px} px");
            return Err(bytes.malformed("image size", size_at, expected, header.image_bytes));
        }
        let bit_depth = storage.bit_depth(header, setup);
        Ok(Self { storage, raster, bit_depth, frame_bytes })
    }

    /// The pixels of the frame at `start`, whose head states that they begin so many bytes behind; `None` where none can lie there.
    pub(super) fn pixels<'a>(&self, bytes: Bytes<'a>, start: u64, head: u32) -> Option<&'a [u8]> {
        let head = u64::from(head);
        (head >= FRAME_HEAD_BYTES).then(|| bytes.slice("pixels", start + head, self.frame_bytes).ok())?
    }

    /// Takes all bits that are stored for significant, and says so, where the first frame, at `start`, has counts above the stated depth.
    pub(super) fn take_stored_depth(&mut self, bytes: Bytes, start: u64) -> Option<String> {
        let (stated, stored) = (self.bit_depth, self.storage.packing().stored_bits());
        if self.storage != CineStorage::Gray16 || stated >= stored {
            return None;
        }
        let image = self.pixels(bytes, start, bytes.u32("frame head", start).ok()?)?;
        let highest = CheckedRows::of(&self.raster, image).above(stated)?;
        self.bit_depth = stored;
        Some(format!(
            "{stated} bits are stated, but pixels of the first frame have counts up to {highest}; all {stored} stored bits are taken for significant"
        ))
    }
}

/// How a .cine file stores its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CineStorage {
    /// One byte a pixel.
    Gray8,
    /// Two bytes a pixel, value right-aligned.
    Gray16,
    /// Companded to 10 bits and packed.
    P10,
    /// Packed linear 12-bit counts.
    P12L,
}

impl CineStorage {
    fn of(bytes: Bytes, header: &CineHeader, setup: &Setup) -> Result<Self, CameraError> {
        let path = bytes.path();
        let unsupported = |what: String, hint: &str| CameraError::Unsupported {
            path: path.into(),
            what,
            hint: hint.into(),
        };
        let colour = |reason: String| CameraError::Colour { path: path.into(), reason };
        match (header.compression, header.bit_count, header.bitmap_compression) {
            (2, ..) => Err(colour(format!(
                "raw colour mosaic (compression 2, colour filter {})",
                setup.colour_filter
            ))),
            (0, 24 | 48, _) => Err(colour(format!("{} bits per pixel: blue, green, red", header.bit_count))),
            (0, 8, 0) => Ok(Self::Gray8),
            (0, 16, 0) => Ok(Self::Gray16),
            (0, 16, 256) => Ok(Self::P10),
            (0, 16, 1024) => Ok(Self::P12L),
            (1, ..) => Err(unsupported(
                "LEAD JPEG compression".into(),
                "save the recording as an uncompressed .cine with the camera's software",
            )),
            (0, bits, packing) => Err(unsupported(
                format!("packing {packing} at {bits} bits per pixel"),
                "8 or 16 bits unpacked, and 16 bits packed as 256 (P10) or 1024 (P12L), are readable",
            )),
            (other, ..) => Err(bytes.malformed("compression", 4, "0, 1 or 2", other)),
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Gray8 => "cine 8 bit",
            Self::Gray16 => "cine 16 bit",
            Self::P10 => "cine P10",
            Self::P12L => "cine P12L",
        }
    }

    fn packing(self) -> Packing {
        match self {
            Self::Gray8 => Packing::Gray8,
            Self::Gray16 => Packing::Gray16Little,
            Self::P10 => Packing::P10,
            Self::P12L => Packing::Packed12,
        }
    }

    /// Frames are stored like bitmaps, from the bottom, but packed frames begin at the top.
    fn raster(self, width_px: usize, height_px: usize) -> Option<Raster> {
        let bottom_row_first = matches!(self, Self::Gray8 | Self::Gray16);
        Some(Raster { bottom_row_first, ..Raster::plain(self.packing(), width_px, height_px)? })
    }

    /// Significant bits: as the Setup block says, else as the number of gray levels says, else all that are stored.
    fn bit_depth(self, header: &CineHeader, setup: &Setup) -> u32 {
        let from_levels = header.n_levels.is_power_of_two().then(|| header.n_levels.ilog2());
        let stated = setup.bit_depth.or(from_levels).filter(|bits| (8..=16).contains(bits));
        match self {
            Self::Gray8 => 8,
            Self::Gray16 => stated.unwrap_or(16),
            Self::P10 | Self::P12L => PACKED_DEPTH,
        }
    }
}
