//! Bodies at rest as two recordings show them: the marker of one is looked for in the other's picture.

use std::borrow::Cow;
use std::ops::Range;

use chainwave_camera::{Calibration, MapError};
use chainwave_correlation::{Method, PreparedSubset, Reference, ReferenceFrames, Settings, mean_of_frames};
use chainwave_measurement::{Estimate, MemoryRecording, Position, Recording, Region, Subset};
use chainwave_stitching::StageStep;

use crate::camera::calibration::ChainMap;
use crate::configuration::Trial;
use crate::error::Error;
use crate::geometry::even_light::evenly_lit;
use crate::recordings::view::{bodies_in_view, frames_at_rest};
use crate::setup::Setup;

/// Correlation of a marker with itself in another recording, both means of frames. The best of the thousand places that are searched of
/// another marker's speckle, a few dozen dots, reaches 0.7.
const SAME_MARKER_ZNCC: f64 = 0.8;

/// Share of what a match leaves over that is left at most where light that grades is behind it.
const MOST_LEFT: f64 = 0.8;

/// Frames whose mean has a third of one's noise.
const FEW_FRAMES: usize = 8;

/// A recording and where its bodies should be at rest.
pub(crate) struct AtRest {
    recording: Box<dyn Recording>,
    bodies: Vec<(usize, Subset)>,
    frames: ReferenceFrames,
    /// From its pictures to the chain.
    map: ChainMap,
}

impl AtRest {
    /// With its bodies where the row of a trial places them.
    ///
    /// # Errors
    /// The recording cannot be read.
    pub(crate) fn of(setup: &Setup, trial: &Trial) -> Result<Self, Error> {
        let recording = setup.open(trial)?;
        let bodies = bodies_in_view(setup, trial, recording.info());
        let frames = frames_at_rest(setup, recording.as_ref())?;
        let map = setup.map_of(trial, recording.info());
        Ok(Self { recording, bodies, frames, map })
    }

    /// The same by the last few frames at rest alone, which is little to read of many recordings, and enough to know markers by.
    ///
    /// # Errors
    /// As [`AtRest::of`].
    pub(crate) fn of_few_frames(setup: &Setup, trial: &Trial) -> Result<Self, Error> {
        let mut found = Self::of(setup, trial)?;
        let all = found.frames.range();
        found.frames = ReferenceFrames::Mean(all.start.max(all.end.saturating_sub(FEW_FRAMES))..all.end);
        Ok(found)
    }

    /// The bodies that both should show.
    pub(crate) fn shared_with<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = MarkerPair> + 'a {
        self.bodies.iter().filter_map(move |(body, subset)| {
            let (_, same) = other.bodies.iter().find(|(number, _)| number == body)?;
            MarkerPair::of(
                *body,
                [(self, subset), (other, same)],
                [self, other].map(|one| one.frames.range()),
            )
        })
    }
}

impl AtRest {
    /// How many of its bodies it shows.
    pub(crate) fn n_bodies(&self) -> usize {
        self.bodies.len()
    }

    /// Whether two neighbours look the same, so that one may be taken for the other.
    pub(crate) fn has_twins(&self, method: Method) -> bool {
        let frames = || [self.frames.range(), self.frames.range()];
        let look_alike = |pair: &[(usize, Subset)]| {
            let (one, other) = (&pair[0], &pair[1].1);
            MarkerPair::of(one.0, [(self, &one.1), (self, other)], frames())
                .is_some_and(|pair| pair.is_same(method))
        };
        self.bodies.windows(2).any(look_alike)
    }

    /// Whether a body's marker is found again in one frame of the recording itself: where it is not, as of a few coarse speckles, that it is not found
    /// in another recording says nothing.
    pub(crate) fn finds_again(&self, body: usize, method: Method) -> bool {
        let (all, subset) = (self.frames.range(), self.bodies.iter().find(|(number, _)| *number == body));
        let last = all.end.saturating_sub(1)..all.end;
        let pair = subset.and_then(|(_, subset)| MarkerPair::of(body, [(self, subset); 2], [all, last]));
        pair.is_some_and(|pair| pair.is_same(method))
    }
}

/// Columns and rows around a subset that the pictures of a pair hold: a stage that is off by less is found.
const REACH_PX: usize = 32;

/// One body at rest as two recordings show it: two frames whose noise is the same, both being means.
pub(crate) struct MarkerPair {
    /// The body's number.
    pub(crate) body: usize,
    frames: MemoryRecording,
    /// Column and row of each frame's first pixel in its recording.
    corners_px: [[f64; 2]; 2],
    /// In the first frame.
    subset: Subset,
    /// Column of the middle of the first recording's pictures.
    middle_px: f64,
    /// Metres along the chain for a pixel to the right there.
    m_per_px_along: f64,
    /// From the pictures of each recording to the chain.
    maps: [Calibration; 2],
}

impl MarkerPair {
    /// `None` where a recording cannot be read.
    fn of(body: usize, shown: [(&AtRest, &Subset); 2], frames: [Range<usize>; 2]) -> Option<Self> {
        let regions = regions(shown)?;
        let mut frames = shown.iter().zip(regions).zip(frames).map(|(((at_rest, _), region), frames)| {
            mean_of_frames(at_rest.recording.as_ref(), region, frames).ok()
        });
        let frames = vec![frames.next()??, frames.next()??];
        let (at_rest, subset) = shown[0];
        let corners_px = regions.map(|region| [region.x as f64, region.y as f64]);
        Some(Self {
            body,
            frames: MemoryRecording::cut_from(at_rest.recording.as_ref(), regions[0].width, frames),
            corners_px,
            maps: shown.map(|(at_rest, _)| at_rest.map.of_chain.clone()),
            middle_px: 0.5 * (at_rest.recording.info().width_px as f64 - 1.0),
            m_per_px_along: at_rest.map.side() * at_rest.map.m_per_px().value,
            subset: Subset {
                x_px: subset.x_px - corners_px[0][0],
                y_px: subset.y_px - corners_px[0][1],
                ..subset.clone()
            },
        })
    }

    /// How much larger the marker is in the second frame, by the calibration and by the places of its left and its right half there; `None` where it is too
    /// small for halves, or one is not found again.
    pub(crate) fn magnified(&self, method: Method) -> Option<Estimate> {
        let half_width_px = self.subset.half_width_px.checked_sub(1)? / 2;
        let apart_px = (self.subset.half_width_px - half_width_px) as f64;
        let half_height_px = self.subset.half_height_px;
        let half = |side: f64| self.subset.part_at([side * apart_px, 0.0], half_width_px, half_height_px);
        let halves = [half(-1.0), half(1.0)];
        let frames = self.evenly_lit(method);
        let (reference, settings) = (ReferenceFrames::Single(0), Settings::default());
        let tracks = method.track(frames.as_ref(), &halves, &reference, &settings, &|_| ());
        let mut found = tracks.ok()?.into_iter().map(|mut track| track.positions.pop()?.ok());
        let (left, right) = (found.next()??, found.next()??);
        let place_m = |frame: usize, [x_px, y_px]: [f64; 2]| {
            let [x0_px, y0_px] = self.corners_px[frame];
            self.maps[frame].map.position_m([x_px + x0_px, y_px + y0_px])[0]
        };
        let [before_left_m, before_right_m] =
            halves.each_ref().map(|half| place_m(0, [half.x_px, half.y_px]));
        let [after_left_m, after_right_m] =
            [left, right].map(|half| place_m(1, [half.x_px.value, half.y_px.value]));
        let size = (after_right_m - after_left_m) / (before_right_m - before_left_m);
        Some(Estimate::new(size - 1.0, right.x_px.sigma.hypot(left.x_px.sigma) / (2.0 * apart_px)))
    }

    /// Whether the first recording has something to find again.
    pub(crate) fn has_texture(&self) -> bool {
        let reference = Reference::read(&self.frames, &self.subset, &ReferenceFrames::Single(0));
        reference.is_ok_and(|reference| {
            PreparedSubset::new(&reference, &self.subset, &Settings::default()).is_ok()
        })
    }

    /// How far the body stands from the middle of the first recording's pictures, in metres along the chain.
    pub(crate) fn offset_from_middle_m(&self) -> f64 {
        self.m_per_px_along * (self.subset.x_px + self.corners_px[0][0] - self.middle_px)
    }

    /// Whether both recordings show the same marker.
    pub(crate) fn is_same(&self, method: Method) -> bool {
        self.found_the_same(method).is_some()
    }

    /// Where the second recording shows the same marker, in its part of the picture.
    pub(crate) fn found_the_same(&self, method: Method) -> Option<Position> {
        self.matched(method).filter(|found| found.zncc >= SAME_MARKER_ZNCC)
    }

    /// Where the first recording's marker is found in the second one's picture.
    fn matched(&self, method: Method) -> Option<Position> {
        self.matched_in(self.evenly_lit(method).as_ref(), method)
    }

    fn matched_in(&self, frames: &MemoryRecording, method: Method) -> Option<Position> {
        let subsets = std::slice::from_ref(&self.subset);
        let (reference, settings) = (ReferenceFrames::Single(0), Settings::default());
        let tracks = method.track(frames, subsets, &reference, &settings, &|_| ());
        tracks.ok()?.pop()?.positions.pop()?.ok()
    }

    /// Both frames, with the marker lit alike where the second one shows it.
    fn evenly_lit(&self, method: Method) -> Cow<'_, MemoryRecording> {
        let found = self.matched_in(&self.frames, method);
        let even = found.and_then(|found| {
            let even = evenly_lit(&self.frames, &self.subset, &found)?;
            let again = self.matched_in(&even, method)?;
            // What a match leaves for another reason may look like light, and stays.
            (1.0 - again.zncc < MOST_LEFT * (1.0 - found.zncc)).then_some(even)
        });
        even.map_or(Cow::Borrowed(&self.frames), Cow::Owned)
    }

    /// The step of the stage, with what the errors of the calibration add to it; `None` where the marker is not found again.
    pub(crate) fn step(&self, of: [usize; 2], method: Method) -> Option<StageStep> {
        Some(self.step_to(&self.matched(method)?, of))
    }

    /// The same to where the marker was found.
    pub(crate) fn step_to(&self, found: &Position, [from, to]: [usize; 2]) -> StageStep {
        let [[x0_px, y0_px], [x1_px, y1_px]] = self.corners_px;
        let before = [self.subset.x_px + x0_px, self.subset.y_px + y0_px];
        let after = [found.x_px, found.y_px];
        let after = [(after[0], x1_px), (after[1], y1_px)]
            .map(|(place, corner)| Estimate::new(place.value + corner, place.sigma));
        let [first, second] = &self.maps;
        let place_m = second.map.position_of(after[0], after[1]);
        let at_px = after.map(|place| place.value);
        let step_m = first.map.position_m(before)[0] - place_m.value;
        let with_error = |(first, second): (&MapError, &MapError)| {
            first.map.position_m(before)[0] - second.map.position_m(at_px)[0] - step_m
        };
        StageStep {
            from,
            to,
            step_m: Estimate::new(step_m, place_m.sigma),
            shared_m: first.errors.iter().zip(&second.errors).map(with_error).collect(),
        }
    }
}

/// Equal parts of two recordings about one body, as large as both allow.
fn regions(shown: [(&AtRest, &Subset); 2]) -> Option<[Region; 2]> {
    let centres = shown.map(|(_, subset)| [subset.x_px.round() as i64, subset.y_px.round() as i64]);
    let sizes = shown.map(|(at_rest, _)| {
        let info = at_rest.recording.info();
        [info.width_px as i64, info.height_px as i64]
    });
    let half_px = [shown[0].1.half_width_px, shown[0].1.half_height_px];
    let reach = |axis: usize| {
        let wanted = (half_px[axis] + REACH_PX) as i64;
        let before = wanted.min(centres[0][axis]).min(centres[1][axis]);
        let room = |side: usize| sizes[side][axis] - 1 - centres[side][axis];
        (before, wanted.min(room(0)).min(room(1)))
    };
    let ((left, right), (above, below)) = (reach(0), reach(1));
    let region = |side: usize| {
        let ([x, y], [width, height]) = (centres[side], sizes[side]);
        let (x, y) = ((x - left, x + right + 1), (y - above, y + below + 1));
        Region::clipped(x.0, y.0, x.1, y.1, width as usize, height as usize)
    };
    Some([region(0)?, region(1)?])
}
