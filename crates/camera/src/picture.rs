//! One opened image: rows where they lie in the file, in strips, or decoded gray.

use std::fmt::{self, Display, Formatter};

use chainwave_measurement::{RecordingInfo, Region};
use memmap2::Mmap;

use crate::raster::Raster;

/// Decoded pixels per byte of a file beyond which a compressed image cannot be genuine: deflate and LZW stay below.
const MOST_EXPANSION: u64 = 1500;

/// Size and depth of a picture, the same in all frames of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PictureShape {
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    /// Significant bits of a pixel.
    pub(crate) bits: u32,
}

impl PictureShape {
    pub(crate) fn of_recording(info: &RecordingInfo) -> Self {
        Self { width_px: info.width_px, height_px: info.height_px, bits: info.bit_depth }
    }

    pub(crate) fn n_pixels(self) -> usize {
        self.width_px * self.height_px
    }
}

impl Display for PictureShape {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} x {} px of {} bits", self.width_px, self.height_px, self.bits)
    }
}

/// One image, opened.
pub(crate) enum Picture {
    /// Uncompressed: its rows are read where they lie.
    Mapped {
        /// The file.
        map: Mmap,
        raster: Raster,
        strips: Strips,
        /// Significant bits of a pixel.
        bits: u32,
    },
    /// Compressed: decoded as a whole.
    Decoded(Gray),
}

impl Picture {
    pub(crate) fn shape(&self) -> PictureShape {
        match self {
            Self::Mapped { raster, bits, .. } => {
                PictureShape { width_px: raster.width_px, height_px: raster.height_px, bits: *bits }
            }
            Self::Decoded(gray) => {
                PictureShape { width_px: gray.width_px, height_px: gray.height_px, bits: gray.bits }
            }
        }
    }

    /// Writes the counts of `region`, which lies in the picture, and says how many stored bytes it looked at.
    pub(crate) fn unpack(&self, region: Region, pixels: &mut [f32]) -> u64 {
        match self {
            Self::Mapped { map, raster, strips, .. } => strips.unpack(map, raster, region, pixels),
            Self::Decoded(gray) => {
                gray.copy(region, pixels);
                0
            }
        }
    }
}

/// Where the rows of an uncompressed picture lie: in strips of as many rows, the last of fewer.
pub(crate) struct Strips {
    rows: usize,
    /// Where each strip starts, in bytes from the start of the file.
    offsets: Vec<u64>,
}

impl Strips {
    /// A picture in one piece.
    pub(crate) fn whole(raster: &Raster, offset: u64) -> Self {
        Self { rows: raster.height_px, offsets: vec![offset] }
    }

    /// Strips of `rows` rows; those that lie back to back become one.
    pub(crate) fn new(raster: &Raster, rows: usize, offsets: Vec<u64>) -> Self {
        let strip_bytes = raster.row_bytes as u64 * rows as u64;
        let follow = offsets.windows(2).all(|pair| pair[0].checked_add(strip_bytes) == Some(pair[1]));
        match offsets.first() {
            Some(&first) if follow => Self::whole(raster, first),
            _ => Self { rows, offsets },
        }
    }

    /// Offset and size of each strip, for checking them against the file.
    pub(crate) fn extents(&self, raster: &Raster) -> impl Iterator<Item = (u64, u64)> {
        let (rows, height_px, row_bytes) = (self.rows, raster.height_px, raster.row_bytes as u64);
        self.offsets.iter().enumerate().map(move |(index, &offset)| {
            let n_rows = rows.min(height_px - (index * rows).min(height_px));
            (offset, row_bytes.saturating_mul(n_rows as u64))
        })
    }

    /// Offset of a picture in one piece; `None` when it is in several.
    pub(crate) fn in_one_piece(&self) -> Option<u64> {
        match self.offsets[..] {
            [offset] => Some(offset),
            _ => None,
        }
    }

    /// As [`Raster::unpack`]; the strips lie in `data` and cover the picture.
    pub(crate) fn unpack(&self, data: &[u8], raster: &Raster, region: Region, pixels: &mut [f32]) -> u64 {
        raster.unpack_rows(region, pixels, |row| {
            let start = self.offsets[row / self.rows] as usize + row % self.rows * raster.row_bytes;
            &data[start..start + raster.row_bytes]
        })
    }
}

/// A decoded picture.
pub(crate) struct Gray {
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    /// Bits of a pixel.
    pub(crate) bits: u32,
    /// Row by row from the top.
    pub(crate) counts: Vec<u16>,
}

impl Gray {
    /// The picture in `samples`, of which each pixel has `n_channels`: gray, gray and opacity, red, green and blue, or these
    /// and opacity. `None` unless red, green and blue are the same everywhere, or when samples are missing.
    pub(crate) fn from_channels(shape: PictureShape, n_channels: usize, samples: &[u16]) -> Option<Self> {
        let PictureShape { width_px, height_px, bits } = shape;
        let n_colours = if n_channels >= 3 { 3 } else { 1 };
        let pixel = |samples: &[u16]| {
            let (first, others) = samples.get(..n_colours)?.split_first()?;
            others.iter().all(|other| other == first).then_some(*first)
        };
        let counts: Vec<u16> = samples.chunks_exact(n_channels).map(pixel).collect::<Option<_>>()?;
        (counts.len() == shape.n_pixels()).then_some(Self { width_px, height_px, bits, counts })
    }

    pub(crate) fn copy(&self, region: Region, pixels: &mut [f32]) {
        if region.n_pixels() == 0 {
            return;
        }
        let rows = self.counts.chunks_exact(self.width_px).skip(region.y);
        for (row, target) in rows.zip(pixels.chunks_exact_mut(region.width)) {
            for (pixel, &count) in target.iter_mut().zip(&row[region.x..]) {
                *pixel = count.into();
            }
        }
    }
}

/// Whether a file of `file_bytes` bytes can hold a picture that decodes to `samples` numbers.
pub(crate) fn is_plausible(samples: u128, file_bytes: u64) -> bool {
    samples <= u128::from(file_bytes) * u128::from(MOST_EXPANSION)
}
