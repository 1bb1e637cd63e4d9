//! What a mapped file's system reads from the disk, and when: what will be looked at, some frames ahead, and little else.

use std::ops::Range;

use chainwave_measurement::Region;
use memmap2::{Advice, Mmap};

use crate::raster::Raster;

/// Bytes of a page, the least that a system reads; larger ones are multiples of it.
const PAGE_BYTES: u64 = 4096;
/// Pieces of a frame that are asked for one by one; of more than that, neighbours are joined.
const MOST_PIECES: usize = 64;
/// Regions of at least so many bytes are asked for as a whole before they are looked at; smaller ones by who knows what comes next.
const LARGE_BYTES: u64 = 1 << 16;

/// Tells the system that pieces of the map will be looked at here and there, so that it does not read on behind each of them. What it
/// makes of that changes no byte.
pub(crate) fn expect_pieces(map: &Mmap) {
    #[cfg(unix)]
    let _only_slower = map.advise(Advice::Random);
}

/// Asks for the regions of frames that start at these bytes of the map.
pub(crate) fn ask_for(map: &Mmap, raster: &Raster, starts: impl Iterator<Item = u64>, regions: &[Region]) {
    let pieces = pieces(regions.iter().flat_map(|region| raster.bytes_of(*region)).collect());
    for start in starts {
        pieces.iter().for_each(|piece| ask(map, start + piece.start..start + piece.end));
    }
}

/// Asks for a region that is looked at now, where it is so large that page after page would take long.
pub(crate) fn ask_for_large(map: &Mmap, raster: &Raster, start: u64, region: Region) {
    let n_bytes: u64 = raster.bytes_of(region).map(|row| row.end - row.start).sum();
    if n_bytes >= LARGE_BYTES {
        ask_for(map, raster, std::iter::once(start), &[region]);
    }
}

fn ask(map: &Mmap, bytes: Range<u64>) {
    let end = bytes.end.min(map.len() as u64);
    #[cfg(unix)]
    if bytes.start < end {
        let _only_slower =
            map.advise_range(Advice::WillNeed, bytes.start as usize, (end - bytes.start) as usize);
    }
}

/// Ranges in their order, those joined between which no page lies, or of too many those that are nearest to each other.
fn pieces(mut ranges: Vec<Range<u64>>) -> Vec<Range<u64>> {
    ranges.sort_unstable_by_key(|range| range.start);
    let mut gap_bytes = PAGE_BYTES;
    loop {
        let mut joined: Vec<Range<u64>> = Vec::new();
        for range in &ranges {
            match joined.last_mut() {
                Some(last) if range.start < last.end + gap_bytes => last.end = last.end.max(range.end),
                _ => joined.push(range.clone()),
            }
        }
        if joined.len() <= MOST_PIECES {
            return joined;
        }
        (ranges, gap_bytes) = (joined, 2 * gap_bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_hold_every_range_and_leave_pages_between_them_out() {
        let rows: Vec<Range<u64>> = (0..40_u64).map(|row| 1920 * row + 300..1920 * row + 361).collect();
        let whole = 300..1920 * 39 + 361;
        assert_eq!(pieces(rows.iter().rev().cloned().collect()), std::slice::from_ref(&whole));
        let apart = vec![9000..9100, 0..100, 4000..4200];
        assert_eq!(pieces(apart), [0..4200, 9000..9100]);
        assert!(pieces(Vec::new()).is_empty());
    }

    #[test]
    fn many_pieces_are_joined_until_few_are_left() {
        let rows: Vec<Range<u64>> = (0..1000_u64).map(|row| 20_000 * row..20_000 * row + 60).collect();
        let joined = pieces(rows.clone());
        assert!(joined.len() <= MOST_PIECES);
        assert!(rows.iter().all(|row| joined.iter().any(|one| one.start <= row.start && row.end <= one.end)));
    }
}
