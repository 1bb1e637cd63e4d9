//! Counts to a file's bytes: 8, 16, 10 (companded) and 12 bits a pixel.

use crate::p10;
use crate::settings::Packing;

/// Turns counts into a file's bytes.
pub(crate) enum Packer {
    Bits8,
    Bits16,
    /// With the code of each 12-bit count.
    P10(Vec<u16>),
    P12L,
}

impl Packer {
    pub(crate) fn new(packing: Packing) -> Self {
        match packing {
            Packing::Bits8 => Self::Bits8,
            Packing::Bits16 => Self::Bits16,
            Packing::P10 => Self::P10(p10::codes_of_counts()),
            Packing::P12L => Self::P12L,
        }
    }

    /// Fills `bytes` with a frame given row by row from the top: plain pixels bottom row first, packed ones top row
    /// first. `bytes` holds [`n_bytes`] of it.
    pub(crate) fn pack(&self, counts: &[u16], width_px: usize, bytes: &mut [u8]) {
        let bottom_first = || counts.chunks_exact(width_px).rev();
        match self {
            Self::Bits8 => {
                for (row, bytes) in bottom_first().zip(bytes.chunks_exact_mut(width_px)) {
                    row.iter().zip(bytes).for_each(|(&count, byte)| *byte = count as u8);
                }
            }
            Self::Bits16 => {
                for (row, bytes) in bottom_first().zip(bytes.chunks_exact_mut(2 * width_px)) {
                    let pixels = bytes.as_chunks_mut().0;
                    row.iter().zip(pixels).for_each(|(count, pixel)| *pixel = count.to_le_bytes());
                }
            }
            Self::P10(codes) => {
                let code = |count: u16| codes[usize::from(count)];
                let (fours, packed) = (counts.as_chunks().0, bytes.as_chunks_mut().0);
                fours
                    .iter()
                    .zip(packed)
                    .for_each(|(four, bytes)| *bytes = pack_p10(<[u16; 4]>::map(*four, code)));
            }
            Self::P12L => {
                let (pairs, packed) = (counts.as_chunks().0, bytes.as_chunks_mut().0);
                pairs.iter().zip(packed).for_each(|(pair, bytes)| *bytes = pack_p12l(pair));
            }
        }
    }
}

/// Bytes of a frame of `n_pixels`, a multiple of the packing's group.
pub(crate) fn n_bytes(packing: Packing, n_pixels: usize) -> usize {
    match packing {
        Packing::Bits8 => n_pixels,
        Packing::Bits16 => n_pixels * 2,
        Packing::P10 => n_pixels / 4 * 5,
        Packing::P12L => n_pixels / 2 * 3,
    }
}

/// Four 10-bit codes, most significant bit first.
fn pack_p10(codes: [u16; 4]) -> [u8; 5] {
    let joined = codes.iter().fold(0_u64, |joined, &code| joined << 10 | u64::from(code));
    let [.., b0, b1, b2, b3, b4] = joined.to_be_bytes();
    [b0, b1, b2, b3, b4]
}

/// Two 12-bit counts, most significant bit first.
fn pack_p12l(counts: &[u16; 2]) -> [u8; 3] {
    let joined = u32::from(counts[0]) << 12 | u32::from(counts[1]);
    let [_, b0, b1, b2] = joined.to_be_bytes();
    [b0, b1, b2]
}
