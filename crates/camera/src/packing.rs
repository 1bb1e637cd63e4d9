//! Pixels of 8, 10, 12 and 16 bits unpacked from the bytes of a row.

use std::ops::Range;

use crate::linearise::P10_LINEAR;

/// How the pixels of a row become bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    /// One byte.
    Gray8,
    /// Two bytes, low byte first.
    Gray16Little,
    /// Two bytes, high byte first.
    Gray16Big,
    /// Four companded 10-bit pixels in five bytes, highest bit first; unpacked to linear 12-bit counts.
    P10,
    /// Four linear 10-bit pixels in five bytes, highest bit first.
    Packed10,
    /// Two linear 12-bit pixels in three bytes, highest bit first.
    Packed12,
}

impl Packing {
    /// Bits that a pixel takes.
    pub(crate) fn stored_bits(self) -> u32 {
        match self {
            Self::Gray8 => 8,
            Self::Gray16Little | Self::Gray16Big => 16,
            Self::P10 | Self::Packed10 => 10,
            Self::Packed12 => 12,
        }
    }

    /// Pixels of the smallest whole group.
    pub(crate) fn group_px(self) -> usize {
        self.group().0
    }

    /// Pixels and bytes of the smallest whole group.
    fn group(self) -> (usize, usize) {
        match self {
            Self::Gray8 => (1, 1),
            Self::Gray16Little | Self::Gray16Big => (1, 2),
            Self::P10 | Self::Packed10 => (4, 5),
            Self::Packed12 => (2, 3),
        }
    }

    /// Bytes of `width_px` pixels; `None` when these are no whole groups, or too many to count.
    pub(crate) fn row_bytes(self, width_px: usize) -> Option<usize> {
        let (group_px, group_bytes) = self.group();
        width_px.is_multiple_of(group_px).then(|| (width_px / group_px).checked_mul(group_bytes))?
    }

    /// The bytes of a row that hold `width_px` pixels from column `first` on, in whole groups.
    pub(crate) fn span(self, first: usize, width_px: usize) -> Range<usize> {
        let (group_px, group_bytes) = self.group();
        first / group_px * group_bytes..(first + width_px).div_ceil(group_px) * group_bytes
    }

    /// Unpacks `span`, the bytes of [`Packing::span`], into the pixels from column `first` on.
    pub(crate) fn unpack(self, span: &[u8], first: usize, pixels: &mut [f32]) {
        match self {
            Self::Gray8 => {
                for (pixel, &byte) in pixels.iter_mut().zip(span) {
                    *pixel = byte.into();
                }
            }
            Self::Gray16Little => unpack_pairs(span, pixels, u16::from_le_bytes),
            Self::Gray16Big => unpack_pairs(span, pixels, u16::from_be_bytes),
            Self::P10 => unpack_groups(span, first, pixels, |bytes| {
                codes10(bytes).map(|code| P10_LINEAR[usize::from(code)])
            }),
            Self::Packed10 => unpack_groups(span, first, pixels, |bytes| codes10(bytes).map(f32::from)),
            Self::Packed12 => unpack_12(span, first, pixels),
        }
    }
}

fn unpack_pairs(span: &[u8], pixels: &mut [f32], value: impl Fn([u8; 2]) -> u16) {
    for (pixel, &pair) in pixels.iter_mut().zip(span.as_chunks().0) {
        *pixel = value(pair).into();
    }
}

/// Unpacks pixels that are stored in groups, of which the first and last may be needed in part.
fn unpack_groups<const BYTES: usize, const PIXELS: usize>(
    span: &[u8],
    first: usize,
    pixels: &mut [f32],
    group: impl Fn(&[u8; BYTES]) -> [f32; PIXELS],
) {
    let mut groups = span.as_chunks().0.iter().map(group);
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

/// Twelve bytes at a time, three words of eight pixels, which is twice as fast as group by group.
fn unpack_12(span: &[u8], first: usize, pixels: &mut [f32]) {
    let (lead_bytes, n_lead) = if first.is_multiple_of(2) { (0, 0) } else { (3, pixels.len().min(1)) };
    let (lead, rest) = pixels.split_at_mut(n_lead);
    let (head, body) = span.split_at(lead_bytes.min(span.len()));
    unpack_groups(head, first, lead, |bytes| codes12(bytes).map(f32::from));
    let (runs, tail) = rest.as_chunks_mut();
    let (run_bytes, _) = body.as_chunks();
    for (run, bytes) in runs.iter_mut().zip(run_bytes) {
        *run = run12(bytes);
    }
    let tail_bytes = body.get(12 * runs.len()..).unwrap_or_default();
    unpack_groups(tail_bytes, 0, tail, |bytes| codes12(bytes).map(f32::from));
}

/// Three words of 32 bits, highest byte first, hold eight pixels, of which two lie across words.
fn run12(bytes: &[u8; 12]) -> [f32; 8] {
    let word = |at: usize| u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let [u, v, w] = [0, 4, 8].map(word);
    let even = [u >> 20, u << 4 | v >> 28, v >> 4, w >> 12];
    let odd = [u >> 8, v >> 16, v << 8 | w >> 24, w];
    let even = even.map(|code| (code & 0xFFF) as i32 as f32);
    let odd = odd.map(|code| (code & 0xFFF) as i32 as f32);
    [even[0], odd[0], even[1], odd[1], even[2], odd[2], even[3], odd[3]]
}

fn codes10(bytes: &[u8; 5]) -> [u16; 4] {
    let [b0, b1, b2, b3, b4] = bytes.map(u16::from);
    [b0 << 2 | b1 >> 6, (b1 & 0x3F) << 4 | b2 >> 4, (b2 & 0x0F) << 6 | b3 >> 2, (b3 & 0x03) << 8 | b4]
}

fn codes12(bytes: &[u8; 3]) -> [u16; 2] {
    let [b0, b1, b2] = bytes.map(u16::from);
    [b0 << 4 | b1 >> 4, (b1 & 0x0F) << 8 | b2]
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
    fn rows_equal_a_bit_by_bit_reading_at_every_start_and_width() {
        let n_px = 40;
        let packings =
            [Packing::Gray8, Packing::Gray16Big, Packing::P10, Packing::Packed10, Packing::Packed12];
        for packing in packings {
            let bits = packing.stored_bits() as usize;
            let row = noise(packing.row_bytes(n_px).unwrap());
            assert_eq!(row.len(), n_px * bits / 8);
            let linear = |code: usize| if packing == Packing::P10 { P10_LINEAR[code] } else { code as f32 };
            let expected: Vec<f32> = (0..n_px).map(|index| linear(number(&row, bits, index))).collect();
            for first in 0..n_px {
                for width in 0..=n_px - first {
                    let mut pixels = vec![-1.0; width];
                    packing.unpack(&row[packing.span(first, width)], first, &mut pixels);
                    assert_eq!(pixels, expected[first..first + width], "{packing:?} {first} {width}");
                }
            }
        }
    }

    #[test]
    fn sixteen_bits_come_in_both_byte_orders() {
        let mut pixels = [0.0; 2];
        Packing::Gray16Little.unpack(&[0x34, 0x12, 0xFF, 0x0F], 0, &mut pixels);
        assert_eq!(pixels.map(|pixel| pixel as u16), [0x1234, 4095]);
        Packing::Gray16Big.unpack(&[0x12, 0x34, 0x0F, 0xFF], 0, &mut pixels);
        assert_eq!(pixels.map(|pixel| pixel as u16), [0x1234, 4095]);
    }

    #[test]
    fn the_first_pixel_takes_the_highest_bits() {
        assert_eq!(codes12(&[0xAB, 0xC1, 0x23]), [0xABC, 0x123]);
        assert_eq!(codes10(&[0x10, 0x3F, 0x60, 0x03, 0xFF]), [64, 1014, 0, 1023]);
    }

    #[test]
    fn a_span_holds_whole_groups_and_no_more() {
        assert_eq!(Packing::Packed12.span(3, 2), 3..9);
        assert_eq!(Packing::P10.span(4, 4), 5..10);
        assert_eq!(Packing::Gray16Little.span(3, 41), 6..88);
        assert_eq!(Packing::Packed10.row_bytes(6), None);
    }
}
