//! The rows of an uncompressed frame: their order, stride and scale, and a region unpacked from them.

use chainwave_measurement::{PlainFrame, Region};

use crate::packing::Packing;

/// How the rows of uncompressed frames lie in a file.
#[derive(Clone, Debug)]
pub(crate) struct Raster {
    pub(crate) packing: Packing,
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    /// Bytes from the start of a row to the start of the next.
    pub(crate) row_bytes: usize,
    /// Whether the rows are stored like a bitmap's, from the bottom.
    pub(crate) bottom_row_first: bool,
    /// What a stored value is multiplied with: a power of two, below 1 where counts are stored left-aligned.
    pub(crate) scale: f32,
}

impl Raster {
    /// Rows from the top, without padding or scale; `None` when a row does not consist of whole bytes.
    pub(crate) fn plain(packing: Packing, width_px: usize, height_px: usize) -> Option<Self> {
        let row_bytes = packing.row_bytes(width_px)?;
        Some(Self { packing, width_px, height_px, row_bytes, bottom_row_first: false, scale: 1.0 })
    }

    /// Bytes of one frame's pixels.
    pub(crate) fn frame_bytes(&self) -> u64 {
        (self.row_bytes as u64).saturating_mul(self.height_px as u64)
    }

    /// Writes the linear counts of `region` of a frame into `pixels`, top row first, and says how many stored bytes
    /// it looked at.
    ///
    /// The region lies in the frame, `image` has [`Raster::frame_bytes`], and `pixels` the region's size.
    pub(crate) fn unpack(&self, image: &[u8], region: Region, pixels: &mut [f32]) -> u64 {
        self.unpack_rows(region, pixels, |row| &image[row * self.row_bytes..][..self.row_bytes])
    }

    /// A frame as it lies in memory, where its pixels are whole bytes and mean what they say; `image` has [`Raster::frame_bytes`].
    pub(crate) fn plain_frame<'a>(&self, image: &'a [u8]) -> Option<PlainFrame<'a>> {
        let (pixel_bytes, is_big_endian) = match self.packing {
            Packing::Gray8 => (1, false),
            Packing::Gray16Little => (2, false),
            Packing::Gray16Big => (2, true),
            Packing::P10 | Packing::Packed10 | Packing::Packed12 => return None,
        };
        let Self { row_bytes, bottom_row_first, .. } = *self;
        let is_unscaled = self.scale >= 1.0;
        is_unscaled.then_some(PlainFrame {
            bytes: image,
            pixel_bytes,
            is_big_endian,
            row_bytes,
            bottom_row_first,
        })
    }

    /// As [`Raster::unpack`], for rows that lie where `stored_row` finds them.
    pub(crate) fn unpack_rows<'a>(
        &self,
        region: Region,
        pixels: &mut [f32],
        stored_row: impl Fn(usize) -> &'a [u8],
    ) -> u64 {
        if region.n_pixels() == 0 {
            return 0;
        }
        let span = self.packing.span(region.x, region.width);
        for (y, target) in (region.y..).zip(pixels.chunks_exact_mut(region.width)) {
            let row = if self.bottom_row_first { self.height_px - 1 - y } else { y };
            self.packing.unpack(&stored_row(row)[span.clone()], region.x, target);
        }
        if self.scale < 1.0 {
            pixels.iter_mut().for_each(|pixel| *pixel *= self.scale);
        }
        (span.len() * region.height) as u64
    }
}
