//! The pixel layout of a codec, from FFmpeg's four-letter codes.

/// How a codec keeps its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CodecLayout {
    /// Eight bits, gray or in colours.
    Eight,
    /// More than eight bits, the brightness in a plane of its own.
    Deep {
        /// Bits of a pixel's brightness.
        bits: u32,
    },
    /// More than eight bits, and no plane of brightness: red, green and blue, a filter mosaic, or floating point.
    DeepColour,
}

impl CodecLayout {
    /// From FFmpeg's code of the layout, whose bytes come backwards where the pixels' high byte comes first.
    ///
    /// `Y` and the number of planes start a layout with a plane of brightness, `G` one with a plane for each colour, both with
    /// the bits of a component in the fourth byte; `RGB` and the like count the bits of a pixel there. Every other code is of
    /// eight bits.
    pub(super) fn of(code: [u8; 4]) -> Self {
        let backwards = [code[3], code[2], code[1], code[0]];
        [code, backwards].into_iter().find_map(Self::deep).unwrap_or(Self::Eight)
    }

    fn deep(code: [u8; 4]) -> Option<Self> {
        match code {
            [b'Y', b'1'..=b'4', _, bits @ 9..=16] => Some(Self::Deep { bits: bits.into() }),
            [b'Y' | b'G', b'1'..=b'4', _, 9..=32]
            | [b'R' | b'B', b'G' | b'B' | b'R', b'A' | b'B' | b'R', 48 | 64]
            | [b'X', b'Y', b'Z', 36]
            | [0xBA, b'R' | b'G' | b'B', b'R' | b'G' | b'B', 16] => Some(Self::DeepColour),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_known_by_their_codes() {
        for (code, layout) in [
            (*b"Y800", CodecLayout::Eight),
            (*b"I420", CodecLayout::Eight),
            ([b'R', b'G', b'B', 24], CodecLayout::Eight),
            ([b'Y', b'1', 0, 10], CodecLayout::Deep { bits: 10 }),
            ([16, 0, b'1', b'Y'], CodecLayout::Deep { bits: 16 }),
            ([b'Y', b'3', 11, 12], CodecLayout::Deep { bits: 12 }),
            ([b'Y', b'1', 0, 32], CodecLayout::DeepColour),
            ([12, 0, b'3', b'G'], CodecLayout::DeepColour),
            ([b'R', b'G', b'B', 48], CodecLayout::DeepColour),
            ([0xBA, b'B', b'G', 16], CodecLayout::DeepColour),
        ] {
            assert_eq!(CodecLayout::of(code), layout, "{code:?}");
        }
    }
}
