//! The size of a subset by the pictures themselves: the smallest that tells a place as well as is asked, and cannot be taken for another.
//!
//! Two things bound a size from below. The noise floor, `sigma sqrt(1 + 1/m) / sqrt(sum of squared gradients)` and what the shape function
//! adds, with the noise of a pixel measured in the reference, a mean of m frames. And chance: a match must be beyond doubt by itself
//! even if its correlation fell as far as is still not called sudden ([`crate::acceptance`]). The smallest size above both is taken, since what
//! a field's bending leaves in a subset grows with its size. From above it is bounded by the frame, by the edges of a marker on even ground, and by
//! neighbours: subsets of other points
//! do not overlap, unless what lies between the points tells no place at all and they lie on one surface, whose texture has no gap between them.

use std::fmt;

use chainwave_measurement::{Recording, Subset, median};

use crate::acceptance::is_beyond_doubt;
use crate::middle::shows_its_middle;
use crate::reference::edge;
use crate::{CorrelationError, PreparedSubset, Reference, ReferenceFrames, Settings};

/// Least and most pixels on each side of the centre that are considered.
pub(crate) const LEAST_HALF_PX: usize = 5;
pub(crate) const MOST_HALF_PX: usize = 60;
/// Pixels between a subset and the edge of the frame: three that interpolation needs, and two by which it may move towards the edge, as
/// strips do across their length, before it has left the view.
pub(crate) const BORDER_PX: usize = 5;

/// Pixels on each side of the way to a neighbour that lines across it reach, at most.
const ACROSS_PX: usize = 10;
/// A size of subsets, and why it was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SubsetSize {
    /// Columns on each side of the centre.
    pub half_width_px: usize,
    /// Rows above and below the centre.
    pub half_height_px: usize,
    /// The noise floor along the worse axis, in pixels; none without texture.
    pub floor_px: Option<f64>,
    /// What settled it.
    pub reason: SizeReason,
}

/// What settled the size of a subset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SizeReason {
    /// The smallest with the accuracy that was asked for.
    Accuracy,
    /// The smallest that chance does not resemble, which is more accurate than was asked for.
    Unambiguous,
    /// The largest that the frame, the marker and the neighbours allow, which is not as accurate as was asked for.
    Bounded,
    /// Smaller than noise asks for, as the field bends.
    Bending,
    /// There is no texture, whatever the size.
    NoTexture,
}

impl fmt::Display for SizeReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Accuracy => "the smallest of that accuracy",
            Self::Unambiguous => "the smallest that chance does not resemble",
            Self::Bounded => "the largest that frame, marker and neighbours allow",
            Self::Bending => "less than noise asks for, as the field bends",
            Self::NoTexture => "there is no texture",
        })
    }
}

/// The smallest subset around a place whose noise floor is at most `error_px` along both axes and that chance does not resemble; where the
/// frame, the marker or the places of `others` allow none, the largest that they do, up to 60 px. It is square, but where a side is bounded.
///
/// # Errors
/// [`CorrelationError::SubsetOutside`] when not even the smallest subset lies in the frame, and as [`Reference::read`].
pub fn subset_size(
    recording: &dyn Recording,
    place_px: [f64; 2],
    others: &[[f64; 2]],
    reference: &ReferenceFrames,
    error_px: f64,
) -> Result<SubsetSize, CorrelationError> {
    let info = recording.info();
    let room = |axis: usize, n: usize| {
        let centre = place_px[axis].round().max(0.0) as usize;
        centre
            .min((n - 1).saturating_sub(centre))
            .saturating_sub(BORDER_PX)
            .clamp(LEAST_HALF_PX, MOST_HALF_PX)
    };
    let in_frame = [room(0, info.width_px), room(1, info.height_px)];
    let reference = Reference::read(recording, &subset_at(place_px, in_frame), reference)?;
    let in_frame = on_marker(&reference, place_px, in_frame);
    let alone = between(place_px, others, in_frame);
    let best = best_within(&reference, place_px, alone, error_px);
    let size = match best.reason {
        // Points so close together that nothing between them tells one from the other lie on one surface, where no ground parts them.
        SizeReason::NoTexture | SizeReason::Bounded
            if alone != in_frame
                && !best.is_told
                && !has_ground_beside(&reference, place_px, others, alone) =>
        {
            best_within(&reference, place_px, in_frame, error_px)
        }
        _ => best,
    };
    Ok(size.into_size())
}

/// What is left of the room around a place for subsets that stay within the edges of the marker that it lies on: beyond its ground lie other things, which
/// move otherwise.
fn on_marker(reference: &Reference, place_px: [f64; 2], in_frame: [usize; 2]) -> [usize; 2] {
    let mut room = in_frame;
    for half in sizes(in_frame[0].max(in_frame[1])) {
        let clear = edge::clear_of_ground(reference, &subset_at(place_px, room.map(|room| room.min(half))));
        for (room, clear) in room.iter_mut().zip(clear) {
            *room = clear.map_or(*room, |clear| clear.max(LEAST_HALF_PX)).min(*room);
        }
    }
    room
}

/// The largest subset, within one that the frame holds, that reaches no more than half the way to any other place.
fn between([x, y]: [f64; 2], others: &[[f64; 2]], in_frame: [usize; 2]) -> [usize; 2] {
    let mut room = in_frame;
    for &[u, v] in others {
        let apart = [(u - x).abs(), (v - y).abs()];
        let axis = usize::from(apart[1] > apart[0]);
        let half = (0.5 * (apart[axis] - 1.0)).floor();
        if half >= 0.0 && apart[axis] > 0.0 {
            room[axis] = room[axis].min(half as usize);
        }
    }
    room
}

/// Whether ground lies between a place and the nearest of the others, as between markers: a line across the way that has next to no contrast.
fn has_ground_beside(
    reference: &Reference,
    place_px: [f64; 2],
    others: &[[f64; 2]],
    room: [usize; 2],
) -> bool {
    let way_px = |other: &[f64; 2]| [other[0] - place_px[0], other[1] - place_px[1]];
    let ways_px = others.iter().map(way_px).filter(|way| way[0].hypot(way[1]) > 0.0);
    let Some(way_px) = ways_px.min_by(|one, other| one[0].hypot(one[1]).total_cmp(&other[0].hypot(other[1])))
    else {
        return false;
    };
    let axis = usize::from(way_px[1].abs() > way_px[0].abs());
    let half = room[1 - axis].clamp(LEAST_HALF_PX, ACROSS_PX) as i64;
    // The variance of a line, none where ground is left out of it.
    let variance = |away: i64| -> Option<f64> {
        let pixel = |across: i64| {
            let mut at = place_px.map(|place| place.round() as i64);
            at[axis] += away * way_px[axis].signum() as i64;
            at[1 - axis] += across;
            reference.usable_pixel(at)
        };
        let values: Vec<f64> = (-half..=half).map(pixel).collect::<Option<_>>()?;
        Some(edge::variance(&values))
    };
    let lines: Option<Vec<f64>> = (0..way_px[axis].abs() as i64).map(variance).collect();
    let Some(lines) = lines else { return true };
    let least = lines.iter().copied().fold(f64::INFINITY, f64::min);
    median(lines).is_some_and(|usual| least < edge::GROUND_SHARE * usual)
}

fn subset_at([x_px, y_px]: [f64; 2], [half_width_px, half_height_px]: [usize; 2]) -> Subset {
    Subset::new(format!("{x_px} {y_px}"), x_px, y_px, half_width_px, half_height_px)
}

/// The sizes that are tried: each by an eighth larger than the one before, as a floor that falls with the side is then met to an eighth.
pub(crate) fn sizes(most: usize) -> impl Iterator<Item = usize> {
    let next = move |half: &usize| (*half < most).then(|| (half + (half / 8).max(1)).min(most));
    std::iter::successors(Some(LEAST_HALF_PX.min(most)), next)
}

/// A size on trial.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tried {
    pub(crate) half_px: [usize; 2],
    pub(crate) floor_px: Option<f64>,
    pub(crate) reason: SizeReason,
    /// Whether a match of it is beyond doubt.
    pub(crate) is_told: bool,
}

impl Tried {
    fn into_size(self) -> SubsetSize {
        let [half_width_px, half_height_px] = self.half_px;
        SubsetSize { half_width_px, half_height_px, floor_px: self.floor_px, reason: self.reason }
    }
}

/// The best size around a place of a reference, within a room.
pub(crate) fn best_within(
    reference: &Reference,
    place_px: [f64; 2],
    room: [usize; 2],
    error_px: f64,
) -> Tried {
    let least = room.map(|room| room.min(LEAST_HALF_PX));
    let none = Tried { half_px: least, floor_px: None, reason: SizeReason::NoTexture, is_told: false };
    let (mut largest, mut accurate_before) = (none, false);
    for half in sizes(room[0].max(room[1])) {
        let half_px = room.map(|room| room.min(half));
        let prepared = PreparedSubset::new(reference, &subset_at(place_px, half_px), &Settings::default());
        let Ok(prepared) = prepared else { continue };
        if !shows_its_middle(&prepared) {
            continue;
        }
        let (floor, is_told) = (floor_px(&prepared), is_beyond_doubt(&prepared));
        let is_accurate = floor <= error_px;
        let reason = match (is_told, is_accurate) {
            (true, true) if accurate_before => SizeReason::Unambiguous,
            (true, true) => SizeReason::Accuracy,
            _ => SizeReason::Bounded,
        };
        largest = Tried { half_px, floor_px: Some(floor), reason, is_told };
        if reason != SizeReason::Bounded {
            return largest;
        }
        accurate_before |= is_accurate;
    }
    // noise looks like a texture now and then, but not where there is most of it
    if largest.half_px == room { largest } else { none }
}

/// The noise of the reference and that of a frame, through the subset's gradients.
fn floor_px(subset: &PreparedSubset) -> f64 {
    let frames = subset.n_averaged + 1.0;
    (subset.noise_variance * frames * subset.covariance.largest_signal()).sqrt()
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Region;

    use super::*;

    #[test]
    fn sizes_grow_by_an_eighth_up_to_the_most() {
        let all: Vec<usize> = sizes(20).collect();
        assert_eq!(all, [5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 18, 20]);
        assert_eq!(sizes(3).collect::<Vec<_>>(), [3]);
    }

    #[test]
    fn ground_parts_markers_and_not_points_of_one_surface() {
        // A smooth texture, everywhere or on markers of 18 px with 12 px of grey between them.
        let image = |is_marked: fn(usize) -> bool| {
            let value = |i: usize| {
                let (x, y) = ((i % 120) as f32, (i / 120) as f32);
                let texture =
                    (1.3 * x + 0.4 * y).sin() + (0.5 * x - 1.1 * y).cos() + (0.7 * x + 0.9 * y).cos();
                if is_marked(i % 120) { 1000.0 + 200.0 * texture } else { 400.0 }
            };
            Reference::new(Region::whole(120, 24), (0..120 * 24).map(value).collect(), 1).unwrap()
        };
        let has_ground = |reference: &Reference, other: [f64; 2]| {
            has_ground_beside(reference, [60.0, 12.0], &[other], [14, 6])
        };
        let markers = image(|column| (column + 9) % 30 < 18);
        assert!(has_ground(&markers, [90.0, 12.0]) && has_ground(&markers, [30.0, 12.0]));
        let surface = image(|_| true);
        assert!(!has_ground(&surface, [90.0, 12.0]) && !has_ground(&surface, [60.0, 20.0]));
        assert!(
            !has_ground_beside(&surface, [60.0, 12.0], &[], [14, 6]),
            "no neighbour, no ground beside it"
        );
    }

    #[test]
    fn subsets_stay_on_their_marker() {
        // Texture on columns 40 to 79 and rows 20 to 59, on grey.
        let image = |is_marked: fn([usize; 2]) -> bool| {
            let value = |i: usize| {
                let (x, y) = ((i % 120) as f32, (i / 120) as f32);
                let texture =
                    (1.3 * x + 0.4 * y).sin() + (0.5 * x - 1.1 * y).cos() + (0.7 * x + 0.9 * y).cos();
                if is_marked([i % 120, i / 120]) { 1000.0 + 200.0 * texture } else { 400.0 }
            };
            Reference::new(Region::whole(120, 80), (0..120 * 80).map(value).collect(), 1).unwrap()
        };
        let marker = image(|[x, y]| (40..80).contains(&x) && (20..60).contains(&y));
        // Two columns within the marker's last, on the nearer side: 57 - 40 - 2.
        assert_eq!(on_marker(&marker, [57.0, 40.0], [50, 34]), [15, 17]);
        let strip = image(|[_, y]| (20..60).contains(&y));
        assert_eq!(on_marker(&strip, [57.0, 40.0], [50, 34]), [50, 17]);
        assert_eq!(on_marker(&image(|_| true), [57.0, 40.0], [50, 34]), [50, 34]);
    }

    #[test]
    fn subsets_of_neighbours_do_not_overlap() {
        let room = between([50.0, 19.0], &[[80.0, 19.0], [50.0, 60.0]], [40, 16]);
        assert_eq!(room, [14, 16], "2 * 14 + 1 columns from one to the next of 30, and the frame's rows");
    }
}
