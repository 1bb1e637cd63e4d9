//! Subsets followed through all frames of a recording.

pub(crate) mod predict;
mod renewal;
pub(crate) mod tracker;

use chainwave_measurement::{Lost, Position, Recording, Region, Subset, Track};

use crate::evidence::ShapeTest;
use crate::icgn::outcome::{Match, Stop};
use crate::search::{chance_zncc, search, search_turned};
use crate::track::predict::History;
use crate::track::renewal::Decay;
use crate::track::tracker::{Found, Tracker, track_both_ways};
use crate::uncertainty::reference_sigma_px;
use crate::warp::Warp;
use crate::window::can_sample;
use crate::{
    CorrelationError, PreparedSubset, Reference, ReferenceFrames, Settings, Shape, ShapeEvidence, Window,
    Workspace,
};

/// Follows subsets through every frame of a recording: from the (first) reference frame to the end, and back to frame
/// 0.
///
/// A frame's start is predicted from the frames before it. Where the match from there fails, the subset is searched
/// for at whole pixels around the prediction; a lost subset is searched for in the next frames, and from the fifth on
/// in every fourth, in turn around where it would be by now and where it was seen last. `progress` receives 1 after
/// each frame of the recording. A frame that cannot be read is [`Lost::Unreadable`] in every track; the others go on.
///
/// Each subset is followed by itself, so nothing depends on the number of threads.
///
/// # Errors
/// [`CorrelationError`] when a setting has no meaning, the reference frames do not exist or cannot be read, or a
/// subset lies outside of them.
pub fn track(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Track>, CorrelationError> {
    let mut followers = followers(recording, subsets, reference, settings)?;
    Ok(follow(&mut followers, reference, subsets, settings, progress))
}

/// As [`track`], each subset with the simplest shape function that its matches cannot reject, and the evidence for it.
///
/// All are followed with the affine shape function first, and those that need another one a second time with it;
/// `progress` receives 1 for each frame of each time.
///
/// # Errors
/// As [`track`].
pub fn track_by_evidence(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<(Track, ShapeEvidence)>, CorrelationError> {
    let affine = Settings { shape: Shape::Affine, ..settings.clone() };
    let mut followers = followers(recording, subsets, reference, &affine)?;
    for (follower, subset) in followers.iter_mut().zip(subsets) {
        let reference = Reference::read(recording, subset, reference)?;
        follower.shape_test = Some(ShapeTest::new(&reference, subset, &affine));
    }
    let mut tracks = follow(&mut followers, reference, subsets, settings, progress);
    let evidence: Vec<ShapeEvidence> = followers
        .iter()
        .filter_map(|follower| follower.shape_test.as_ref())
        .map(ShapeTest::evidence)
        .collect();
    for shape in Shape::ALL.into_iter().filter(|&shape| shape != Shape::Affine) {
        let members: Vec<usize> = (0..subsets.len()).filter(|&i| evidence[i].shape == shape).collect();
        if members.is_empty() {
            continue;
        }
        let of_shape: Vec<Subset> = members.iter().map(|&i| subsets[i].clone()).collect();
        let settings = Settings { shape, ..settings.clone() };
        let again = track(recording, &of_shape, reference, &settings, progress)?;
        members.into_iter().zip(again).for_each(|(i, track)| tracks[i] = track);
    }
    Ok(tracks.into_iter().zip(evidence).collect())
}

fn followers<'a>(
    recording: &'a dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
) -> Result<Vec<Follower<'a>>, CorrelationError> {
    settings.check()?;
    subsets.iter().map(|subset| Follower::new(recording, subset, reference, settings)).collect()
}

/// Follows each subset on one of the threads; the first thread counts the frames.
fn follow(
    followers: &mut [Follower<'_>],
    reference: &ReferenceFrames,
    subsets: &[Subset],
    settings: &Settings,
    progress: &(dyn Fn(u64) + Sync),
) -> Vec<Track> {
    let Some(n_frames) = followers.first().map(|follower| follower.recording.info().n_frames) else {
        return Vec::new();
    };
    let first = reference.range().start;
    let share = subsets.len().div_ceil(settings.n_threads.get()).max(1);
    let ((own, others), (own_subsets, other_subsets)) =
        (followers.split_at_mut(share), subsets.split_at(share));
    std::thread::scope(|scope| {
        let threads: Vec<_> = others
            .chunks_mut(share)
            .zip(other_subsets.chunks(share))
            .map(|(part, subsets)| {
                scope.spawn(move || track_both_ways(part, first, n_frames, subsets, &|_| ()))
            })
            .collect();
        let mut tracks = track_both_ways(own, first, n_frames, own_subsets, progress);
        for thread in threads {
            tracks.extend(thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        tracks
    })
}

impl Tracker for [Follower<'_>] {
    fn locate(&mut self, frame: usize) -> Vec<Found> {
        self.iter_mut().map(|follower| follower.locate(frame)).collect()
    }

    fn restart(&mut self, found: &[Found]) {
        self.iter_mut().zip(found).for_each(|(follower, found)| follower.restart(found));
    }
}

/// One subset on its way through a recording.
struct Follower<'a> {
    recording: &'a dyn Recording,
    subset: Result<PreparedSubset, Lost>,
    /// The frame that is the whole reference, if one is.
    reference_frame: Option<usize>,
    history: History,
    window: Window,
    workspace: Workspace,
    /// Least correlation of a place found by search.
    acquisition_zncc: f64,
    decay: Decay,
    /// The subset as it was prepared first, once it has been prepared anew.
    original: Option<PreparedSubset>,
    /// Tests whether the affine shape function is needed, and enough.
    shape_test: Option<ShapeTest>,
}

impl<'a> Follower<'a> {
    fn new(
        recording: &'a dyn Recording,
        subset: &Subset,
        frames: &ReferenceFrames,
        settings: &Settings,
    ) -> Result<Self, CorrelationError> {
        let reference = Reference::read(recording, subset, frames)?;
        let prepared = PreparedSubset::new(&reference, subset, settings);
        let full_scale = recording.info().full_scale();
        let mut window = Window::empty_of(settings.interpolation, full_scale);
        window.level = prepared.as_ref().map_or(0.0, |prepared| prepared.mean as f32);
        Ok(Self {
            recording,
            reference_frame: (reference.n_averaged() == 1).then_some(frames.range().start),
            history: History::of(subset),
            window,
            workspace: Workspace::default(),
            acquisition_zncc: prepared.as_ref().map_or(1.0, chance_zncc).max(settings.min_zncc),
            subset: prepared,
            decay: Decay::default(),
            original: None,
            shape_test: None,
        })
    }

    /// Goes back to where the subset was at the start, to follow it the other way.
    fn restart(&mut self, found: &Found) {
        if let Some(original) = self.original.take() {
            self.subset = Ok(original);
        }
        self.decay = Decay::default();
        let position = match (found, &self.subset) {
            (Ok(position), _) => [position.x_px.value, position.y_px.value],
            (_, Ok(subset)) => subset.centre_px,
            _ => return,
        };
        self.history = History::starting_at(Warp::at(position));
    }

    /// The subset's position in the next frame of its way.
    fn locate(&mut self, frame: usize) -> Found {
        match self.find(frame) {
            Ok(found) => {
                self.history.found(found.warp());
                self.test_shape(frame, &found.warp());
                let position = self.decay.total(self.with_reference_sigma(frame, found.position));
                if self.reference_frame != Some(frame) {
                    self.renew(frame, &found, &position);
                }
                Ok(position)
            }
            Err(reason) => {
                self.history.lost();
                Err(reason)
            }
        }
    }

    /// Prepares the subset anew from a frame where its match has decayed.
    fn renew(&mut self, frame: usize, found: &Match, position: &Position) {
        let Ok(subset) = &self.subset else { return };
        if !self.decay.calls_for_renewal(found, subset.settings.renewal_share) {
            return;
        }
        let place = subset.at(position);
        let Ok(reference) = Reference::read(self.recording, &place, &ReferenceFrames::Single(frame)) else {
            return;
        };
        let Ok(renewed) = PreparedSubset::new(&reference, &place, &subset.settings) else { return };
        self.acquisition_zncc = chance_zncc(&renewed).max(renewed.settings.min_zncc);
        self.decay = Decay::renewed_at(position);
        let before = std::mem::replace(&mut self.subset, Ok(renewed));
        self.original = self.original.take().or(before.ok());
        self.history = History::starting_at(Warp::at([position.x_px.value, position.y_px.value]));
    }

    fn test_shape(&mut self, frame: usize, warp: &Warp) {
        // The reference frame agrees with itself in all digits, whatever its shape.
        let other_frame = self.reference_frame != Some(frame);
        if let (true, Some(test), Ok(subset)) = (other_frame, &mut self.shape_test, &self.subset) {
            test.add(subset, &self.window, warp, &mut self.workspace);
        }
    }

    fn find(&mut self, frame: usize) -> Result<Match, Lost> {
        let expected = self.history.predict();
        let reason = if self.history.n_lost == 0 {
            match self.match_from(frame, expected) {
                Ok(found) => return Ok(found),
                Err(reason @ (Lost::NoTexture | Lost::Unreadable)) => return Err(reason),
                Err(reason) => reason,
            }
        } else if self.in_frame(&expected)? {
            Lost::LowCorrelation
        } else {
            Lost::OutOfView
        };
        match self.search_place() {
            Some(place) => self.match_by_search(frame, place).map_err(|found| worse(reason, found)),
            None => Err(reason),
        }
    }

    /// Where a search would look for the subset in this frame; `None` when it is not this frame's turn.
    fn search_place(&self) -> Option<[f64; 2]> {
        self.history.search_place().map(|place| self.nearest_in_frame(place))
    }

    /// The nearest place where the undeformed subset lies in the frame.
    fn nearest_in_frame(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let info = self.recording.info();
        let [half_x, half_y] = self.subset.as_ref().map_or([0.0; 2], |subset| subset.half_px());
        let inside = |value: f64, half: f64, n: usize| value.min(n as f64 - 1.0 - half).max(half);
        [inside(x, half_x, info.width_px), inside(y, half_y, info.height_px)]
    }

    fn match_by_search(&mut self, frame: usize, around_px: [f64; 2]) -> Result<Match, Lost> {
        let subset = self.subset.as_ref().map_err(|reason| *reason)?;
        let place = search(self.recording, frame, subset, around_px).map_err(|_| Lost::Unreadable)?;
        let upright = self.match_certainly(frame, Warp::at(place.ok_or(Lost::OutOfView)?));
        let (Err(_), 1) = (upright, self.history.n_lost + 1) else { return upright };
        // Bodies rarely turn between two frames: that is looked for once, when they are lost.
        let subset = self.subset.as_ref().map_err(|reason| *reason)?;
        let turned = search_turned(self.recording, frame, subset, around_px).map_err(|_| Lost::Unreadable)?;
        turned.map_or(upright, |warp| self.match_certainly(frame, warp))
    }

    /// A match that is no coincidence.
    fn match_certainly(&mut self, frame: usize, start: Warp) -> Result<Match, Lost> {
        let found = self.match_from(frame, start)?;
        let certain = found.position.zncc >= self.acquisition_zncc;
        if certain { Ok(found) } else { Err(Lost::LowCorrelation) }
    }

    /// Matches from a start, moving the window after the subset while it leaves it.
    fn match_from(&mut self, frame: usize, start: Warp) -> Result<Match, Lost> {
        const WINDOWS: usize = 16; // half a pixel of slack each covers the largest drift that the iteration allows
        let mut start = start;
        for _ in 0..WINDOWS {
            if !self.in_frame(&start)? {
                return Err(Lost::OutOfView);
            }
            self.read_window(frame, &start)?;
            let subset = self.subset.as_ref().map_err(|reason| *reason)?;
            match subset.solve_visible(&self.window, start, &mut self.workspace) {
                Ok(found) => return Ok(found),
                Err(Stop::Lost(reason)) => return Err(reason),
                Err(Stop::Escaped(warp)) => start = warp,
            }
        }
        Err(Lost::NotConverged)
    }

    /// Whether the subset and what its interpolation needs lie in the frame.
    fn in_frame(&self, warp: &Warp) -> Result<bool, Lost> {
        let subset = self.subset.as_ref().map_err(|reason| *reason)?;
        let frame = Region::whole(self.recording.info().width_px, self.recording.info().height_px);
        let inside = |corner| can_sample(frame, subset.settings.interpolation, corner);
        Ok(subset.bounds(warp).into_iter().all(inside))
    }

    fn read_window(&mut self, frame: usize, warp: &Warp) -> Result<(), Lost> {
        let subset = self.subset.as_ref().map_err(|reason| *reason)?;
        let info = self.recording.info();
        let (region, margins) =
            window_around(subset, warp, info.width_px, info.height_px).ok_or(Lost::OutOfView)?;
        let pixels = self.window.start(region, margins);
        self.recording.read_region(frame, region, pixels).map_err(|_| Lost::Unreadable)?;
        self.window.finish();
        Ok(())
    }

    fn with_reference_sigma(&self, frame: usize, mut position: Position) -> Position {
        if let (true, Ok(subset)) = (self.reference_frame == Some(frame), &self.subset) {
            [position.x_px.sigma, position.y_px.sigma] = reference_sigma_px(subset);
        }
        position
    }
}

/// Of two reasons, the one that says more: a search that fails does not change that the body left the view.
fn worse(by_prediction: Lost, by_search: Lost) -> Lost {
    match (by_prediction, by_search) {
        (_, Lost::Unreadable) => Lost::Unreadable,
        (Lost::OutOfView, _) => Lost::OutOfView,
        (reason, Lost::OutOfView) => reason,
        (_, reason) => reason,
    }
}

/// Pixels that a match may move from its start before the window must be read again.
const SLACK_PX: f64 = 0.5;

/// The pixels around a warped subset that interpolation, its prefilter and the slack need, inside the frame, and how many
/// of the first and last columns only the prefilter does.
pub(crate) fn window_around(
    subset: &PreparedSubset,
    warp: &Warp,
    width: usize,
    height: usize,
) -> Option<(Region, [usize; 2])> {
    let interpolation = subset.settings.interpolation;
    let margin = interpolation.prefilter_margin_px() as i64;
    let before = SLACK_PX + interpolation.taps_before() as f64;
    let after = SLACK_PX + interpolation.taps_after() as f64 + 1.0;
    let [low, high] = subset.bounds(warp);
    let [x0, y0] = low.map(|value| (value - before).floor() as i64);
    let [x1, y1] = high.map(|value| (value + after).floor() as i64);
    let region = Region::clipped(x0 - margin, y0 - margin, x1 + margin, y1 + margin, width, height)?;
    let beyond = |distance: i64| usize::try_from(distance).unwrap_or(0);
    let margins = [beyond(x0 - region.x as i64), beyond((region.x + region.width) as i64 - x1)];
    Some((region, margins))
}
