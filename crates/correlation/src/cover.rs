//! Something that stands still before the subsets, such as a cable, a rod, a scratched or dirty window, a letter on it; or behind them, such as
//! ground in the corners of a subset that is larger than its marker.
//!
//! The reference shows it in front of the texture, and so does every frame, elsewhere on the texture. A match then sees two pictures of it that
//! do not belong together, which no half or third of the subset is free of where it runs across; and it is the sharpest thing in there.
//!
//! But it stays where it is on the sensor. A pixel over which a texture moves changes as the reference and the track foretell it; one before
//! which something stands keeps still. So the variance of a pixel over frames is held against the one that is foretold for it. Where that is
//! much less in many pixels that hang together, they are no part of the picture, neither of the reference nor of the frames, and the subset is
//! followed by the others. Tracks that a cover pulled aside foretell about as much variance as right ones.
//!
//! Ground is seen where the marker has gone from, and covered where it has gone to, so that its pixels do change, later on. But while the marker goes its
//! first pixels, what is seen at its place in the reference is still the same, and what has gone along with the subset is not. Those pixels
//! are no part of the reference; in other frames all are looked at.

mod ground;
mod pixels;

use std::ops::Range;
use std::path::Path;

use chainwave_measurement::{Lost, Position, ReadError, Recording, RecordingInfo, Region, Subset, Track};

use crate::cover::pixels::{LEAST_FRAMES, Pixels};
use crate::{CorrelationError, ReferenceFrames};

/// What matches leave in the frame where that is most, over what they leave in most others, from which on pixels are asked: twice as much is no noise.
const SUSPICIOUS_RATIO: f64 = 2.0;
/// What a match leaves over what one around the cover leaves, at least. Masks that hide what bends most leave up to 2.8 times less.
const EXPLAINED_RATIO: f64 = 3.0;
/// Parts of the way that frames are taken from, and frames of each.
const WAY: [usize; 2] = [24, 2];
/// Share of a subset's pixels from which on what seems to stand before it is something else, such as a motion that blurs it.
const MOST_COVERED: f64 = 0.5;
/// Pixels that a subset has gone, over which ground is told from what goes along: a texture has changed by a half of itself then, and a track that
/// ground holds back is not yet lost.
const FIRST_PX: [f64; 2] = [0.7, 12.0];
/// Frames on that way that are looked at, evenly spread.
const GROUND_FRAMES: usize = 16;

/// Pixels of a recording that show something that stands still.
#[derive(Debug, Clone)]
pub struct Cover {
    width_px: usize,
    is_covered: Vec<bool>,
    /// Frames in which they are left out; `None` for all of them.
    frames: Option<Range<usize>>,
    subsets: Vec<(usize, f64)>,
}

impl Cover {
    /// What stands still before subsets that were followed; `None` where that is nothing.
    ///
    /// Frames that cannot be read tell nothing.
    ///
    /// # Errors
    /// [`CorrelationError`] where the reference frames cannot be read.
    pub fn find(
        recording: &dyn Recording,
        subsets: &[Subset],
        reference: &ReferenceFrames,
        tracks: &[&Track],
    ) -> Result<Option<Self>, CorrelationError> {
        let mut cover = Self::nothing(recording.info(), None);
        for (index, (subset, track)) in subsets.iter().zip(tracks).enumerate() {
            let frames = telling_frames(subset, track, reference);
            if frames.len() < LEAST_FRAMES {
                continue;
            }
            let Some(pixels) = Pixels::of(recording, subset, reference, &frames)? else { continue };
            let covered = pixels.covered();
            let share = pixels.share_of_subset(&covered);
            if covered.is_empty() || share > MOST_COVERED {
                continue;
            }
            cover.add(index, covered, share);
        }
        Ok((!cover.subsets.is_empty()).then_some(cover))
    }

    /// Ground that the reference shows beside markers that were followed, in the subsets themselves; `None` where that is nothing. Positions stand
    /// in the order of the subsets, one for each frame.
    ///
    /// Frames that cannot be read tell nothing.
    ///
    /// # Errors
    /// [`CorrelationError`] where the reference frames cannot be read.
    pub fn ground(
        recording: &dyn Recording,
        subsets: &[Subset],
        reference: &ReferenceFrames,
        positions: &[&[Result<Position, Lost>]],
    ) -> Result<Option<Self>, CorrelationError> {
        let mut cover = Self::nothing(recording.info(), Some(reference.range()));
        for (index, (subset, positions)) in subsets.iter().zip(positions).enumerate() {
            let frames = first_frames(subset, positions);
            if frames.len() < LEAST_FRAMES {
                continue;
            }
            let staying = ground::staying(recording, subset, reference, &frames)?;
            if let Some(staying) = staying.filter(|staying| staying.share <= MOST_COVERED) {
                cover.add(index, staying.pixels, staying.share);
            }
        }
        Ok((!cover.subsets.is_empty()).then_some(cover))
    }

    fn nothing(info: &RecordingInfo, frames: Option<Range<usize>>) -> Self {
        let is_covered = vec![false; info.width_px * info.height_px];
        Self { width_px: info.width_px, is_covered, frames, subsets: Vec::new() }
    }

    /// Adds pixels of a subset, by columns and rows, which are a share of it.
    fn add(&mut self, subset: usize, pixels: Vec<[usize; 2]>, share: f64) {
        pixels.into_iter().for_each(|[x, y]| self.is_covered[y * self.width_px + x] = true);
        self.subsets.push((subset, share));
    }

    /// The subsets that show it, by their number, each with the share of its pixels that are covered in the reference.
    pub fn subsets(&self) -> &[(usize, f64)] {
        &self.subsets
    }

    /// Whether a track around the cover is to be taken for the one before it: of the frames that both see, where that left most, it leaves a third of
    /// it at most. What blurs or bends a texture leaves nearly as much in any part of it.
    pub fn explains(before: &Track, around: &Track) -> bool {
        let seen = before.positions.iter().zip(&around.positions);
        let by_both = seen.filter_map(|(before, around)| {
            Some([left_by(before.as_ref().ok()?), left_by(around.as_ref().ok()?)])
        });
        let worst = by_both.max_by(|[one, _], [other, _]| one.total_cmp(other));
        worst.is_some_and(|[before, around]| EXPLAINED_RATIO * around < before)
    }

    /// A recording without the pixels that are covered: they are no numbers there.
    pub fn taken_from<'a>(&'a self, recording: &'a dyn Recording) -> Uncovered<'a> {
        Uncovered { recording, cover: self }
    }
}

/// A recording of which some pixels are no numbers.
#[derive(Clone, Copy)]
pub struct Uncovered<'a> {
    recording: &'a dyn Recording,
    cover: &'a Cover,
}

impl Recording for Uncovered<'_> {
    fn path(&self) -> &Path {
        self.recording.path()
    }

    fn info(&self) -> &RecordingInfo {
        self.recording.info()
    }

    fn is_sequential(&self) -> bool {
        self.recording.is_sequential()
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        self.recording.will_read(frames, regions);
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.recording.read_region(frame, region, pixels)?;
        if self.cover.frames.as_ref().is_some_and(|frames| !frames.contains(&frame)) {
            return Ok(());
        }
        let rows = self.cover.is_covered.chunks_exact(self.cover.width_px.max(1)).skip(region.y);
        for (out, row) in pixels.chunks_exact_mut(region.width.max(1)).zip(rows) {
            let covered = out.iter_mut().zip(&row[region.x..region.x + region.width]);
            covered.filter(|(_, is_covered)| **is_covered).for_each(|(pixel, _)| *pixel = f32::NAN);
        }
        Ok(())
    }
}

/// Frames all along a track's way, in their order, with the readings; none where nothing of what the matches leave is more than noise.
fn telling_frames(subset: &Subset, track: &Track, reference: &ReferenceFrames) -> Vec<(usize, Position)> {
    let seen: Vec<(usize, Position)> = track
        .positions
        .iter()
        .enumerate()
        .filter_map(|(frame, found)| Some((frame, *found.as_ref().ok()?)))
        .collect();
    if !is_suspicious(track, reference) {
        return Vec::new();
    }
    let away_px =
        |position: &Position| (position.x_px.value - subset.x_px).hypot(position.y_px.value - subset.y_px);
    let farthest_px = seen.iter().map(|(_, position)| away_px(position)).fold(0.0, f64::max);
    let [n_parts, of_each] = WAY;
    let mut taken = vec![0; n_parts];
    let mut is_taken = |position: &Position| {
        let part = (n_parts as f64 * away_px(position) / farthest_px) as usize;
        let taken = &mut taken[part.min(n_parts - 1)];
        *taken += 1;
        *taken <= of_each
    };
    seen.into_iter().filter(|(_, position)| is_taken(position)).collect()
}

/// Frames on the first pixels of a track's way, in their order, with the readings.
fn first_frames(subset: &Subset, positions: &[Result<Position, Lost>]) -> Vec<(usize, Position)> {
    let [from_px, to_px] = FIRST_PX;
    let is_on_way = |position: &Position| {
        (from_px..to_px)
            .contains(&(position.x_px.value - subset.x_px).hypot(position.y_px.value - subset.y_px))
    };
    let seen = positions.iter().enumerate();
    let seen = seen.filter_map(|(frame, found)| Some((frame, *found.as_ref().ok()?)));
    let on_way: Vec<(usize, Position)> = seen.filter(|(_, position)| is_on_way(position)).collect();
    let step = on_way.len().div_ceil(GROUND_FRAMES).max(1);
    on_way.into_iter().step_by(step).collect()
}

/// What a match leaves of the variance that it explains.
fn left_by(position: &Position) -> f64 {
    position.zncc.powi(-2) - 1.0
}

/// Whether matches leave much more in any frame than in the tenth of them that leave least, or something hides the subset. The reference leaves
/// nothing of itself.
fn is_suspicious(track: &Track, reference: &ReferenceFrames) -> bool {
    let is_hidden = |lost: &Lost| matches!(lost, Lost::LowCorrelation | Lost::NotConverged | Lost::Ambiguous);
    if track.positions.iter().any(|found| found.as_ref().is_err_and(is_hidden)) {
        return true;
    }
    let others = track.positions.iter().enumerate().filter(|(frame, _)| !reference.range().contains(frame));
    let mut left: Vec<f64> = others.filter_map(|(_, found)| found.as_ref().ok()).map(left_by).collect();
    left.sort_by(f64::total_cmp);
    let least = left.get(left.len() / 10);
    least.zip(left.last()).is_some_and(|(least, most)| *most > SUSPICIOUS_RATIO * least)
}
