//! What is odd about an otherwise readable .cine: garbage sizes, dummy frames, decimation, companding.

use super::blocks::Blocks;
use super::header::{CineHeader, TICKS_PER_SECOND};
use super::pixels::{CineStorage, PixelLayout};
use super::setup::Setup;
use crate::bytes::Bytes;

/// A last frame exposed this many times longer or shorter than the others is a dummy.
const DUMMY_EXPOSURE_RATIO: f64 = 10.0;

/// What a careful reader of the pixels should know of an otherwise readable file.
pub(super) fn warnings(
    bytes: Bytes,
    header: &CineHeader,
    setup: &Setup,
    layout: &PixelLayout,
    blocks: &Blocks,
    frames: &[u64],
) -> Vec<String> {
    let findings = [
        other_size_word(bytes, layout, frames),
        dummy_last_frame(blocks),
        decimation(setup),
        companding(setup, layout),
        unstated_depth(setup, layout),
        colour_filter(header, setup),
        display_turns(setup),
    ];
    findings.into_iter().flatten().chain(blocks.short.iter().chain(&blocks.odd).cloned()).collect()
}

/// Some cameras write garbage into a frame's own size word. The first and the last frame tell, and no more are touched.
fn other_size_word(bytes: Bytes, layout: &PixelLayout, frames: &[u64]) -> Option<String> {
    let (first, last) = (*frames.first()?, *frames.last()?);
    [(0, first), (frames.len() - 1, last)].into_iter().find_map(|(index, start)| {
        let head = u64::from(bytes.u32("frame head", start).ok()?);
        let word_at = start + head.checked_sub(4)?;
        let word = bytes.u32("frame size", word_at).ok()?;
        (u64::from(word) != layout.frame_bytes).then(|| {
            let expected = layout.frame_bytes;
            format!("frame {index}: its size word at byte {word_at} says {word} bytes; the header's {expected} are used")
        })
    })
}

/// Recordings that a camera saved by itself may end in a frame that it never exposed.
fn dummy_last_frame(blocks: &Blocks) -> Option<String> {
    let usual_s = blocks.exposure_s()?;
    let exposures = blocks.exposures.as_ref()?;
    let last_s = f64::from(*exposures.last()?) / TICKS_PER_SECOND;
    let usual = usual_s / DUMMY_EXPOSURE_RATIO..=usual_s * DUMMY_EXPOSURE_RATIO;
    let index = exposures.len() - 1;
    (!usual.contains(&last_s)).then(|| {
        format!("frame {index}, the last, looks like a dummy: exposed {last_s:.3e} s where {usual_s:.3e} s is usual")
    })
}

fn decimation(setup: &Setup) -> Option<String> {
    let every = setup.decimation;
    (every > 1.0).then(|| format!("only one image in {every} was saved"))
}

fn companding(setup: &Setup, layout: &PixelLayout) -> Option<String> {
    match layout.storage {
        CineStorage::P10 => {
            Some("pixels were stored as companded 10-bit codes; they are linearised to 12-bit counts".into())
        }
        _ if setup.was_companded => {
            Some("pixels were companded to 10 bits before they were saved as they are".into())
        }
        _ => None,
    }
}

fn unstated_depth(setup: &Setup, layout: &PixelLayout) -> Option<String> {
    let stated = setup.bit_depth == Some(layout.bit_depth);
    (layout.storage == CineStorage::Gray16 && !stated).then(|| match setup.bit_depth {
        Some(bits) => format!("the header states {bits} significant bits; {} are assumed", layout.bit_depth),
        None => format!("the header states no number of significant bits; {} are assumed", layout.bit_depth),
    })
}

/// A mosaic is refused; a colour filter in the settings of a file that calls itself gray is only odd.
fn colour_filter(header: &CineHeader, setup: &Setup) -> Option<String> {
    let filter = setup.colour_filter;
    (header.compression == 0 && filter != 0)
        .then(|| format!("the settings name colour filter {filter}, but the pictures are stored as gray"))
}

fn display_turns(setup: &Setup) -> Option<String> {
    let turns = setup.display_turns.join(", ");
    (!turns.is_empty()).then(|| format!("display settings are not applied to pixels: {turns}"))
}
