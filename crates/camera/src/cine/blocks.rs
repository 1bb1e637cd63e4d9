//! The tagged blocks of a .cine: time stamps and exposures of the images.

use super::header::{CineHeader, TICKS_PER_SECOND};
use super::setup::Setup;
use crate::bytes::Bytes;
use crate::error::CameraError;

/// Size (u32), type (u16) and a reserved u16.
const BLOCK_HEAD_BYTES: u64 = 8;
/// As many zeros as this between blocks are no padding.
const MOST_PADDING_BYTES: u64 = 4096;
/// Time stamps of all images in the camera's memory, as older cameras wrote them.
const MEMORY_TIMES: u16 = 1001;
const IMAGE_TIMES: u16 = 1002;
const EXPOSURES: u16 = 1003;

/// The tagged blocks between the Setup block and the image pointers, as far as they matter here.
#[derive(Default)]
pub(super) struct Blocks {
    /// Time of each image: seconds since 1970 in units of 2^-32 s.
    pub(super) stamps: Option<Vec<u64>>,
    /// Exposure of each image in units of 2^-32 s.
    pub(super) exposures: Option<Vec<u32>>,
    /// Blocks that hold less than one entry for each image, and are left out: pixels are as certain without them.
    pub(super) short: Vec<String>,
    /// What stands first between the blocks and is none, and what became of it.
    pub(super) odd: Option<String>,
}

impl Blocks {
    pub(super) fn read(bytes: Bytes, header: &CineHeader, setup: &Setup) -> Result<Self, CameraError> {
        let mut blocks = Self::default();
        let mut offset = header.setup_offset + setup.length;
        while offset < header.pointers_offset {
            let padding = n_zero_bytes(bytes, offset, header.pointers_offset)?;
            if (1..MOST_PADDING_BYTES).contains(&padding) {
                blocks.odd.get_or_insert_with(|| {
                    format!("{padding} zero bytes at byte {offset} are no tagged block; they are passed over")
                });
                offset += padding;
                continue;
            }
            let block = match TaggedBlock::read(bytes, offset, header.pointers_offset)? {
                Ok(block) => block,
                Err(odd) => {
                    blocks.odd.get_or_insert(odd);
                    break;
                }
            };
            match block.kind {
                IMAGE_TIMES => match block.per_image(bytes, "time stamps", header.n_images)? {
                    Ok(table) => {
                        blocks.stamps = Some(table.iter().map(|&raw| u64::from_le_bytes(raw)).collect());
                    }
                    Err(short) => blocks.short.push(short),
                },
                MEMORY_TIMES if blocks.stamps.is_none() => {
                    blocks.stamps = block.stamps_of_memory(bytes, header);
                }
                EXPOSURES => match block.per_image(bytes, "exposures", header.n_images)? {
                    Ok(table) => {
                        blocks.exposures = Some(table.iter().map(|&raw| u32::from_le_bytes(raw)).collect());
                    }
                    Err(short) => blocks.short.push(short),
                },
                _ => {}
            }
            offset += block.size;
        }
        Ok(blocks)
    }

    /// Forgets what belongs to frames behind the first `n_frames`.
    pub(super) fn keep_first(&mut self, n_frames: usize) {
        if let Some(stamps) = &mut self.stamps {
            stamps.truncate(n_frames);
        }
        if let Some(exposures) = &mut self.exposures {
            exposures.truncate(n_frames);
        }
    }

    /// Median exposure in seconds, which a dummy frame does not move.
    pub(super) fn exposure_s(&self) -> Option<f64> {
        let mut exposures = self.exposures.clone()?;
        exposures.sort_unstable();
        let median = *exposures.get(exposures.len() / 2)?;
        (median > 0).then(|| f64::from(median) / TICKS_PER_SECOND)
    }
}

/// Bytes of the words of zeros at `offset`, as far as they fill up a part of a file. No block has a size of zero.
fn n_zero_bytes(bytes: Bytes, offset: u64, end: u64) -> Result<u64, CameraError> {
    const WORD_BYTES: u64 = 4;
    let mut n_bytes = 0;
    while offset + n_bytes < end && n_bytes < MOST_PADDING_BYTES {
        let n_left = (end - offset - n_bytes).min(WORD_BYTES);
        if bytes.slice("tagged block", offset + n_bytes, n_left)?.iter().any(|&byte| byte != 0) {
            break;
        }
        n_bytes += n_left;
    }
    Ok(n_bytes)
}

struct TaggedBlock {
    offset: u64,
    /// Bytes of the block, its head included.
    size: u64,
    kind: u16,
}

impl TaggedBlock {
    /// The block at `offset`, which must end at `end` at the latest; or what to say where none lies there: pixels are as certain without what follows.
    fn read(bytes: Bytes, offset: u64, end: u64) -> Result<Result<Self, String>, CameraError> {
        let room = end - offset;
        if room < BLOCK_HEAD_BYTES {
            return Ok(Err(format!(
                "the last {room} bytes before the image pointers, at byte {offset}, are no tagged block"
            )));
        }
        let size = u64::from(bytes.u32("block size", offset)?);
        if !(BLOCK_HEAD_BYTES..=room).contains(&size) {
            return Ok(Err(format!(
                "tagged block at byte {offset}: expected a size of {BLOCK_HEAD_BYTES} to {room} bytes, found {size}; it and what follows it \
                 are left out"
            )));
        }
        Ok(Ok(Self { offset, size, kind: bytes.u16("block type", offset + 4)? }))
    }

    /// The file's part of the time stamps of a camera's whole memory; `None` where it lies outside, and nothing is certain.
    fn stamps_of_memory(&self, bytes: Bytes, header: &CineHeader) -> Option<Vec<u64>> {
        let before = u64::try_from(i64::from(header.first_image) - i64::from(header.first_in_memory)).ok()?;
        let wanted = 8 * before..8 * (before + u64::from(header.n_images));
        if wanted.end > self.size - BLOCK_HEAD_BYTES {
            return None;
        }
        let start = self.offset + BLOCK_HEAD_BYTES + wanted.start;
        let table = bytes.slice("time stamps", start, wanted.end - wanted.start).ok()?;
        Some(table.as_chunks().0.iter().map(|&raw| u64::from_le_bytes(raw)).collect())
    }

    /// The block's data as `N` bytes for each image, or what to say of a block that is too short for it.
    fn per_image<'a, const N: usize>(
        &self,
        bytes: Bytes<'a>,
        what: &str,
        n_images: u32,
    ) -> Result<Result<&'a [[u8; N]], String>, CameraError> {
        let needed = u64::from(n_images) * N as u64;
        let found = self.size - BLOCK_HEAD_BYTES;
        if found < needed {
            let short = format!(
                "{what} at byte {}: expected {needed} bytes for {n_images} images, found {found}; they are left out",
                self.offset
            );
            return Ok(Err(short));
        }
        Ok(Ok(bytes.slice(what, self.offset + BLOCK_HEAD_BYTES, needed)?.as_chunks().0))
    }
}
