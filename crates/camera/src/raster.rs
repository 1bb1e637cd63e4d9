//! The rows of an uncompressed frame: their order, stride and scale, and a region unpacked from them.

use std::ops::Range;

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

    /// Which bytes of a frame, from its first, hold a region: a range for each row.
    pub(crate) fn bytes_of(&self, region: Region) -> impl Iterator<Item = Range<u64>> + '_ {
        let span = self.packing.span(region.x, region.width);
        (region.y..region.y + region.height).map(move |y| {
            let row = if self.bottom_row_first { self.height_px - 1 - y } else { y };
            let start = row as u64 * self.row_bytes as u64;
            start + span.start as u64..start + span.end as u64
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plain_frame_has_the_counts_that_are_read() {
        let (width_px, height_px) = (5, 3);
        for (packing, bottom_row_first) in
            [(Packing::Gray8, false), (Packing::Gray16Little, true), (Packing::Gray16Big, false)]
        {
            let plain = Raster::plain(packing, width_px, height_px).unwrap();
            // Two bytes of padding at the end of each row.
            let raster = Raster { row_bytes: plain.row_bytes + 2, bottom_row_first, ..plain };
            let image: Vec<u8> = (0..raster.frame_bytes()).map(|byte| (37 * byte + 11) as u8).collect();
            let mut read = vec![0.0; width_px * height_px];
            raster.unpack(&image, Region::whole(width_px, height_px), &mut read);
            let frame = raster.plain_frame(&image).unwrap();
            let count = |index: usize| {
                let (row, column) = (index / width_px, index % width_px);
                let stored_row = if frame.bottom_row_first { height_px - 1 - row } else { row };
                let bytes = &frame.bytes[stored_row * frame.row_bytes + column * frame.pixel_bytes..];
                match (frame.pixel_bytes, frame.is_big_endian) {
                    (1, _) => f32::from(bytes[0]),
                    (_, true) => f32::from(u16::from_be_bytes([bytes[0], bytes[1]])),
                    (_, false) => f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
                }
            };
            assert!(
                (0..read.len()).all(|index| count(index).to_bits() == read[index].to_bits()),
                "{packing:?}"
            );
        }
    }

    #[test]
    fn what_is_packed_or_scaled_is_no_plain_frame() {
        let packed = Raster::plain(Packing::Packed12, 4, 1).unwrap();
        assert!(packed.plain_frame(&[0; 6]).is_none());
        let scaled = Raster { scale: 0.0625, ..Raster::plain(Packing::Gray16Little, 3, 1).unwrap() };
        assert!(scaled.plain_frame(&[0; 6]).is_none());
    }
}
