use chainwave_measurement::Region;

use super::header::Header;
use super::setup::Setup;
use crate::CameraError;
use crate::bytes::Bytes;
use crate::linearise::P10_LINEAR;

/// Bits of a linearised P10 pixel and of a P12L pixel.
const PACKED_DEPTH: u32 = 12;

/// How a frame's pixels lie in the file.
pub(super) struct Layout {
    pub(super) packing: Packing,
    pub(super) width_px: usize,
    pub(super) height_px: usize,
    /// Significant bits of an unpacked pixel.
    pub(super) bit_depth: u32,
    /// Bytes of one frame's pixels.
    pub(super) frame_bytes: u64,
    row_bytes: usize,
}

impl Layout {
    pub(super) fn of(bytes: Bytes, header: &Header, setup: &Setup) -> Result<Self, CameraError> {
        let packing = Packing::of(bytes, header, setup)?;
        let (width_px, height_px) = (header.width_px, header.height_px);
        let (group_px, group_bytes) = packing.group();
        let size_at = header.bitmap_offset + 0x14;
        if width_px % group_px != 0 {
            let expected = format_args!("a multiple of {group_px} px ({})", packing.name());
            return Err(bytes.malformed("image width", header.bitmap_offset + 4, expected, width_px));
        }
        // Both sides are positive 32-bit integers, so only the product can be too large.
        let row_bytes = width_px / group_px * group_bytes;
        let frame_bytes = row_bytes as u128 * height_px as u128;
        if frame_bytes != u128::from(header.image_bytes) {
            let expected = format_args!("{frame_bytes} bytes for {width_px} x {height_px} px");
            return Err(bytes.malformed("image size", size_at, expected, header.image_bytes));
        }
        let bit_depth = packing.bit_depth(header, setup);
        let frame_bytes = header.image_bytes.into();
        Ok(Self { packing, width_px, height_px, bit_depth, frame_bytes, row_bytes })
    }

    /// Writes the linear counts of `region` of a frame's stored `image` into `pixels`, top row first.
    ///
    /// The region lies in the frame, `image` has [`Layout::frame_bytes`] and `pixels` the region's size.
    pub(super) fn unpack(&self, image: &[u8], region: Region, pixels: &mut [f32]) {
        if region.width == 0 {
            return;
        }
        for (y, target) in (region.y..).zip(pixels.chunks_exact_mut(region.width)) {
            let row = if self.packing.bottom_row_first() { self.height_px - 1 - y } else { y };
            let stored = &image[row * self.row_bytes..][..self.row_bytes];
            self.packing.unpack_row(stored, region.x, target);
        }
    }
}

/// How pixels become bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    /// One byte.
    Gray8,
    /// Two bytes, little endian, value right-aligned.
    Gray16,
    /// Four companded 10-bit pixels in five bytes, highest bit first.
    P10,
    /// Two linear 12-bit pixels in three bytes, highest bit first.
    P12L,
}

impl Packing {
    fn of(bytes: Bytes, header: &Header, setup: &Setup) -> Result<Self, CameraError> {
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
                "readable: 8 or 16 bits unpacked, 16 bits packed as 256 (P10) or 1024 (P12L)",
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

    /// Pixels and bytes of the smallest whole group.
    fn group(self) -> (usize, usize) {
        match self {
            Self::Gray8 => (1, 1),
            Self::Gray16 => (1, 2),
            Self::P10 => (4, 5),
            Self::P12L => (2, 3),
        }
    }

    /// Whether frames are stored like bitmaps, from the bottom; packed frames begin at the top.
    fn bottom_row_first(self) -> bool {
        matches!(self, Self::Gray8 | Self::Gray16)
    }

    /// Significant bits: as the Setup block says, else as the number of gray levels says, else all that are stored.
    fn bit_depth(self, header: &Header, setup: &Setup) -> u32 {
        let from_levels = header.n_levels.is_power_of_two().then(|| header.n_levels.ilog2());
        let stated = setup.bit_depth.or(from_levels).filter(|bits| (8..=16).contains(bits));
        match self {
            Self::Gray8 => 8,
            Self::Gray16 => stated.unwrap_or(16),
            Self::P10 | Self::P12L => PACKED_DEPTH,
        }
    }

    /// Unpacks the pixels of one stored row from column `first` on.
    fn unpack_row(self, row: &[u8], first: usize, pixels: &mut [f32]) {
        match self {
            Self::Gray8 => {
                for (pixel, &byte) in pixels.iter_mut().zip(&row[first..]) {
                    *pixel = byte.into();
                }
            }
            Self::Gray16 => {
                for (pixel, &pair) in pixels.iter_mut().zip(row[2 * first..].as_chunks().0) {
                    *pixel = u16::from_le_bytes(pair).into();
                }
            }
            Self::P10 => unpack_groups(row, first, pixels, p10_group),
            Self::P12L => unpack_groups(row, first, pixels, p12l_group),
        }
    }
}

/// Unpacks a row whose pixels are stored in groups, of which the first and last may be needed in part.
fn unpack_groups<const BYTES: usize, const PIXELS: usize>(
    row: &[u8],
    first: usize,
    pixels: &mut [f32],
    group: impl Fn(&[u8; BYTES]) -> [f32; PIXELS],
) {
    let mut groups = row.as_chunks().0[first / PIXELS..].iter().map(group);
    let skipped = first % PIXELS;
    let n_lead = ((PIXELS - skipped) % PIXELS).min(pixels.len());
    let (lead, rest) = pixels.split_at_mut(n_lead);
    let (whole, tail) = rest.as_chunks_mut();
    if !lead.is_empty()
        && let Some(values) = groups.next()
    {
        lead.copy_from_slice(&values[skipped..skipped + n_lead]);
    }
    for (target, values) in whole.iter_mut().zip(&mut groups) {
        *target = values;
    }
    if !tail.is_empty()
        && let Some(values) = groups.next()
    {
        tail.copy_from_slice(&values[..tail.len()]);
    }
}

fn p10_group(bytes: &[u8; 5]) -> [f32; 4] {
    let [b0, b1, b2, b3, b4] = bytes.map(usize::from);
    let codes =
        [b0 << 2 | b1 >> 6, (b1 & 0x3F) << 4 | b2 >> 4, (b2 & 0x0F) << 6 | b3 >> 2, (b3 & 0x03) << 8 | b4];
    codes.map(|code| P10_LINEAR[code])
}

fn p12l_group(bytes: &[u8; 3]) -> [f32; 2] {
    let [b0, b1, b2] = bytes.map(u16::from);
    [b0 << 4 | b1 >> 4, (b1 & 0x0F) << 8 | b2].map(f32::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The slow obvious code: pixel `index` of a stream of `bits`-bit numbers, highest bit first.
    fn number(row: &[u8], bits: usize, index: usize) -> usize {
        (bits * index..bits * (index + 1))
            .fold(0, |value, bit| value << 1 | usize::from(row[bit / 8] >> (7 - bit % 8) & 1))
    }

    fn noise(n_bytes: usize) -> Vec<u8> {
        (0..n_bytes as u32).map(|index| (index.wrapping_mul(2_654_435_761) >> 13) as u8).collect()
    }

    #[test]
    fn packed_rows_equal_a_bit_by_bit_reading_at_every_start_and_width() {
        let n_px = 16;
        for (packing, bits) in [(Packing::P10, 10), (Packing::P12L, 12)] {
            let row = noise(n_px * bits / 8);
            let expected: Vec<f32> = (0..n_px)
                .map(|index| number(&row, bits, index))
                .map(|code| if bits == 10 { P10_LINEAR[code] } else { code as f32 })
                .collect();
            for first in 0..n_px {
                for width in 0..=n_px - first {
                    let mut pixels = vec![-1.0; width];
                    packing.unpack_row(&row, first, &mut pixels);
                    assert_eq!(pixels, expected[first..first + width], "{packing:?} {first} {width}");
                }
            }
        }
    }

    #[test]
    fn the_first_pixel_takes_the_highest_bits() {
        assert_eq!(p12l_group(&[0xAB, 0xC1, 0x23]).map(|pixel| pixel as u16), [0xABC, 0x123]);
        // Codes 64, 1014, 0 and 1023.
        let counts = p10_group(&[0x10, 0x3F, 0x60, 0x03, 0xFF]).map(|pixel| pixel as u16);
        assert_eq!(counts, [64, 4064, 2, 4095]);
    }
}
