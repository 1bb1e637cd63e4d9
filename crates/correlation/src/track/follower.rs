//! One subset on its way through a recording, by Gauss-Newton from where the frames before lead to expect it, or by search.

use std::ops::Range;

use chainwave_measurement::{Estimate, Lost, Position, Recording, Region, Subset};

use crate::acceptance::Standard;
use crate::evidence::ShapeTest;
use crate::icgn::outcome::Match;
use crate::icgn::visible::noise_ratio;
use crate::reference::edge::clear_of_edges;
use crate::search::rivals::PlaceMatch;
use crate::structure::Structure;
use crate::track::alike::{self, Alike, Left};
use crate::track::bending::Bend;
use crate::track::cells::Cells;
use crate::track::continuity::Continuity;
use crate::track::find::{FrameSearch, Locate};
use crate::track::matcher::{Matcher, window_around};
use crate::track::partly_hidden::Parts;
use crate::track::predict::History;
use crate::track::renewal::Decay;
use crate::track::still::Still;
use crate::track::tracker::Found;
use crate::uncertainty::{angle_rad, reference_sigma_px, sigma_px};
use crate::warp::Warp;
use crate::{CorrelationError, PreparedSubset, Reference, ReferenceFrames, Settings, Shape, Window};

/// One subset on its way through a recording.
pub(crate) struct Follower<'a> {
    matcher: Matcher<'a>,
    /// What its parts were asked where it was seen in part.
    parts: Parts,
    target: Result<Target, Lost>,
    reference_frames: Range<usize>,
    history: History,
    continuity: Continuity,
    decay: Decay,
    /// The target as it was prepared first, once it has been prepared anew.
    original: Option<Original>,
    /// Why the subset was lost in the last frame that it was searched in.
    reason: Lost,
    /// Tests whether the affine shape function is needed, and enough.
    pub(crate) shape_test: Option<ShapeTest>,
    /// What the next shape function finds otherwise, frame by frame.
    pub(crate) bends: Vec<Option<Bend>>,
    /// How alike the residuals of neighbouring pixels are, by what that makes of the place and of its bends.
    pub(crate) alike: Alike,
    pub(crate) bends_alike: Alike,
    /// What tells that a part of the texture stands still.
    still: Still,
    /// Whether it was expected elsewhere than in the reference from the beginning.
    starts_elsewhere: bool,
    /// The times that the subset was prepared anew.
    pub(crate) renewals: Vec<Renewal>,
}

/// A time that a subset was prepared anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Renewal {
    /// The frame that it was prepared from.
    pub(crate) frame: usize,
    /// The frame in which the subset was found again as it was at first.
    pub(crate) until: Option<usize>,
}

/// What a subset was before it was prepared anew: found again, its places owe nothing to those since.
struct Original {
    target: Target,
    decay: Decay,
    /// How it was deformed where it was prepared anew last.
    gradient: [f64; 4],
    /// The frame of that.
    frame: usize,
}

/// A place that is nearer to a subset's own than this is that.
const OWN_PLACE_PX: f64 = 1.0;
/// Share of the residual's square that the next shape function takes from it, from which on that is no noise alone.
const BENT: f64 = 0.05;
/// What the whole subset leaves over what its match left, beyond which a part of it was hidden then.
const HIDDEN: f64 = 2.0;

/// Frames from one to the next in which a subset that was prepared anew is looked for as it was at first.
const RETURNING: usize = 16;

/// What is looked for, and what its matches are held against.
struct Target {
    subset: PreparedSubset,
    /// The same with the next shape function, where it is asked what the subset's own one leaves.
    richer: Option<PreparedSubset>,
    /// The subset's variance by residuals that are alike.
    structure: Structure,
    /// The same where bends are asked for.
    bent: Option<StructureOfBent>,
    standard: Standard,
}

/// What residuals that are alike make of a subset on a surface that bends, by those that the next shape function leaves.
struct StructureOfBent {
    of_place: Structure,
    of_bend: Structure,
}

impl Target {
    fn new(
        recording: &dyn Recording,
        subset: &Subset,
        frames: &ReferenceFrames,
        settings: &Settings,
    ) -> Result<Result<Self, Lost>, CorrelationError> {
        let reference = Reference::read(recording, subset, frames)?;
        let subset = &clear_of_edges(&reference, subset);
        let asked = if settings.surfaces_bend { settings.shape.richer() } else { &[] };
        let richer = PreparedSubset::of_first(asked, &reference, subset, settings);
        Ok(PreparedSubset::new(&reference, subset, settings).map(|subset| {
            let standard = Standard::new(recording, frames, &subset);
            let structure = Structure::of(&subset, &subset);
            let bent = richer.as_ref().map(|richer| StructureOfBent {
                of_place: Structure::of(&subset, richer),
                of_bend: Structure::of_difference(&subset, richer),
            });
            Self { subset, richer, structure, bent, standard }
        }))
    }
}

impl<'a> Follower<'a> {
    pub(crate) fn new(
        recording: &'a dyn Recording,
        subset: &Subset,
        frames: &ReferenceFrames,
        settings: &Settings,
    ) -> Result<Self, CorrelationError> {
        let target = Target::new(recording, subset, frames, settings)?;
        let mut window = Window::empty_of(settings.interpolation, recording.info().full_scale());
        window.level = target.as_ref().map_or(0.0, |target| target.subset.mean as f32);
        Ok(Self {
            reference_frames: frames.range(),
            history: History::of(subset),
            continuity: Continuity::from_rest(period_px(&target)),
            matcher: Matcher::new(recording, window),
            parts: Parts::default(),
            target,
            decay: Decay::default(),
            alike: Alike::default(),
            bends_alike: Alike::default(),
            still: Still::default(),
            starts_elsewhere: false,
            renewals: Vec::new(),
            original: None,
            reason: Lost::LowCorrelation,
            shape_test: None,
            bends: if settings.surfaces_bend { vec![None; recording.info().n_frames] } else { Vec::new() },
        })
    }

    /// Goes back to where the subset was at the start, to follow it the other way.
    pub(crate) fn restart(&mut self, found: &Found) {
        if let Some(original) = self.original.take() {
            self.target = Ok(original.target);
        }
        self.decay = Decay::default();
        self.parts = Parts::default();
        let end = self.n_frames();
        for renewal in self.renewals.iter_mut().filter(|renewal| renewal.until.is_none()) {
            renewal.until = Some(end);
        }
        let position = match (found, &mut self.target) {
            (Ok(position), _) => [position.x_px.value, position.y_px.value],
            (_, Ok(target)) => target.subset.centre_px,
            _ => return,
        };
        if let Ok(target) = &mut self.target {
            target.standard.restart(&target.subset);
        }
        self.history = History::starting_at(Warp::at(position));
        self.continuity.restart(period_px(&self.target));
    }

    /// Expects the subset at a place, before anything was followed. Where that is not its own, nothing is believed for being the reference.
    pub(crate) fn start_at(&mut self, place_px: [f64; 2]) {
        self.history = History::starting_at(Warp::at(place_px));
        let is_own = |target: &Target| {
            let away = [0, 1].map(|axis| place_px[axis] - target.subset.centre_px[axis]);
            away[0].hypot(away[1]) < OWN_PLACE_PX
        };
        self.starts_elsewhere = !self.target.as_ref().is_ok_and(is_own);
    }

    /// Readings of earlier frames that were told by later ones, with their frames.
    pub(crate) fn settled_late(&mut self) -> Vec<(usize, Position)> {
        self.continuity.take_settled()
    }

    /// The subset's position in the next frame of its way.
    pub(crate) fn locate(&mut self, frame: usize) -> Found {
        let found = match self.find_as_at_first(frame) {
            Some(found) => Ok((found, true)),
            None => self.find(frame).or_else(|reason| self.find_lost_as_at_first(frame).ok_or(reason)),
        };
        match found {
            Ok((found, is_evident)) => {
                let goes_on = self.continuity.goes_on_at(&self.history, found.warp().position_px);
                self.history.found(found.warp());
                self.test_shape(frame, &found);
                self.note_bend(frame, &found);
                self.note_alike(frame, &found);
                let position = self.decay.total(self.with_reference_sigma(frame, found.position));
                if !self.is_sole_reference(frame) {
                    if let Ok(target) = &mut self.target {
                        target.standard.note(&found.place());
                    }
                    self.note_still(frame, &found);
                    self.renew(frame, &found, &position);
                }
                self.continuity.note(frame, position, goes_on, is_evident)
            }
            Err(reason) => {
                self.continuity.end();
                self.history.lost();
                self.reason = reason;
                Err(reason)
            }
        }
    }

    /// Whether a frame is the whole reference.
    fn is_sole_reference(&self, frame: usize) -> bool {
        self.reference_frames == (frame..frame + 1)
    }

    /// The recording that the subset is followed through.
    pub(crate) fn recording(&self) -> &'a dyn Recording {
        self.matcher.recording
    }

    /// What its matches will look at in the frames that follow, twice as many as given: from where it is to where it would be then; where
    /// that is beyond its own size, nothing so far ahead is foretold but where it is. `None` where nothing is looked for.
    pub(crate) fn expected_in(&self, n_frames: usize) -> Option<Region> {
        let Ok(Target { subset, .. }) = &self.target else { return None };
        let info = self.recording().info();
        let seen = |warp: Warp| Some(window_around(subset, &warp, info.width_px, info.height_px)?.0);
        match (seen(self.history.last()), seen(self.history.after(2 * n_frames))) {
            (Some(now), Some(then)) => Some(now.joined_with(then).unwrap_or(now)),
            (now, then) => now.or(then),
        }
    }

    /// Frames of the recording.
    pub(crate) fn n_frames(&self) -> usize {
        self.matcher.recording.info().n_frames
    }

    /// Prepares the subset anew from a frame where its match has decayed.
    fn renew(&mut self, frame: usize, found: &Match, position: &Position) {
        let Ok(Target { subset, .. }) = &self.target else { return };
        let (matcher, warp) = (&mut self.matcher, found.warp());
        let cells = || {
            matcher.have_window(subset, frame, &warp).ok()?;
            Cells::of(subset, &matcher.window, &warp, &mut matcher.workspace)
        };
        let before = self.decay;
        if !self.decay.calls_for_renewal(found, subset.settings.renewal_share, cells) {
            return;
        }
        let (place, settings) = (subset.at(position), subset.settings.clone());
        let renewed = Target::new(self.matcher.recording, &place, &ReferenceFrames::Single(frame), &settings);
        let Ok(Ok(renewed)) = renewed else { return };
        self.decay = Decay::renewed_at(position);
        self.renewals.push(Renewal { frame, until: None });
        let target = std::mem::replace(&mut self.target, Ok(renewed));
        self.original = match self.original.take() {
            Some(original) => {
                let gradient = found.warp().after_gradient(&original.gradient).gradient;
                Some(Original { gradient, frame, ..original })
            }
            None => {
                target.ok().map(|target| Original { target, decay: before, gradient: found.gradient, frame })
            }
        };
        self.history = History::starting_at(Warp::at([position.x_px.value, position.y_px.value]));
        self.continuity.end();
    }

    /// Finds a subset that was prepared anew where it is expected, as it was at first: now and then, and where its match decays once more.
    fn find_as_at_first(&mut self, frame: usize) -> Option<Match> {
        let Original { target, decay, gradient, frame: renewed } = self.original.as_ref()?;
        let is_due = self.decay.is_decayed() || frame.abs_diff(*renewed).is_multiple_of(RETURNING);
        if !is_due || self.history.n_lost > 0 {
            return None;
        }
        let start = self.history.after_gradient(gradient).predict();
        let found = self.matcher.match_from(&target.subset, frame, start).ok()?;
        let share = target.subset.settings.renewal_share;
        let is_it = decay.is_fresh(&found, share) && target.standard.is_clear(&target.subset, &found.place());
        if !is_it {
            return None;
        }
        self.return_to_first(frame, &found);
        Some(found)
    }

    /// As [`Self::find`], of a subset that was prepared anew and is lost so, as it was at first.
    fn find_lost_as_at_first(&mut self, frame: usize) -> Option<(Match, bool)> {
        let Original { target, decay, gradient, frame: renewed } = self.original.take()?;
        let share = target.subset.settings.renewal_share;
        let history = self.history.after_gradient(&gradient);
        let (target_since, history_since) =
            (std::mem::replace(&mut self.target, Ok(target)), std::mem::replace(&mut self.history, history));
        let found = self.find(frame).ok().filter(|(found, _)| decay.is_fresh(found, share));
        let target = std::mem::replace(&mut self.target, target_since);
        self.history = history_since;
        self.original = target.ok().map(|target| Original { target, decay, gradient, frame: renewed });
        let (found, is_evident) = found?;
        self.return_to_first(frame, &found);
        Some((found, is_evident))
    }

    /// Goes on with the subset as it was prepared first, which was found in a frame.
    fn return_to_first(&mut self, frame: usize, found: &Match) {
        let Some(Original { target, decay, gradient, .. }) = self.original.take() else { return };
        self.target = Ok(target);
        self.decay = decay.returned(found);
        self.history = self.history.after_gradient(&gradient);
        for renewal in self.renewals.iter_mut().filter(|renewal| renewal.until.is_none()) {
            renewal.until = Some(frame);
        }
    }

    fn test_shape(&mut self, frame: usize, found: &Match) {
        // The reference frame agrees with itself in all digits, whatever its shape; and once it was prepared anew the subset is another than
        // the one that is tested.
        let is_tested = !self.is_sole_reference(frame) && self.original.is_none();
        if let (true, Some(test), Ok(target)) = (is_tested, &mut self.shape_test, &self.target) {
            test.add(&target.subset, &self.matcher.window, found, &mut self.matcher.workspace);
        }
    }

    /// Notes what a match of the subset as it was at first leaves, where single tracks are asked for: those of an experiment are held against each other.
    fn note_still(&mut self, frame: usize, found: &Match) {
        let Ok(Target { subset, .. }) = &self.target else { return };
        if subset.settings.surfaces_bend && self.original.is_none() {
            self.still.note(frame, subset, found);
        }
    }

    /// Adds to the places of its track what a part of the texture that stands still keeps back; returns the share of that.
    pub(crate) fn without_still(&self, positions: &mut [Found]) -> Option<Estimate> {
        let target = self.original.as_ref().map(|one| &one.target).or(self.target.as_ref().ok())?;
        let is_renewed = |frame: usize| {
            let is_behind = |one: &Renewal| match one.until {
                Some(until) => (one.frame.min(until)..=one.frame.max(until)).contains(&frame),
                None => frame >= one.frame,
            };
            self.renewals.iter().any(is_behind)
        };
        self.still.correct(&target.subset, positions, is_renewed)
    }

    /// Keeps what the next shape function finds otherwise. The reference shows no bend of itself.
    fn note_bend(&mut self, frame: usize, found: &Match) {
        let Ok(Target { subset, richer: Some(richer), .. }) = &self.target else { return };
        if self.reference_frames.contains(&frame) {
            return;
        }
        let bend = Bend::of([subset, richer], &mut self.matcher, frame, found);
        if let Some(kept) = self.bends.get_mut(frame) {
            *kept = Some(bend);
        }
    }

    /// Notes how alike the residuals of neighbouring pixels are, of a subset that is seen whole.
    fn note_alike(&mut self, frame: usize, found: &Match) {
        let Ok(Target { subset, richer, structure, bent, .. }) = &self.target else { return };
        let is_asked = !self.is_sole_reference(frame) && Alike::looks_at(frame, self.n_frames());
        let warp = found.warp();
        if !is_asked || self.matcher.have_window(subset, frame, &warp).is_err() {
            return;
        }
        let Matcher { window, workspace, .. } = &mut self.matcher;
        let Some(left) = Left::of(subset, window, &warp, workspace) else { return };
        // What interpolation leaves is as smooth as the texture, and stated elsewhere; and what an obstacle hides was left out of the match.
        if left.is_interpolated() || noise_ratio(subset, &left.residual) > HIDDEN * found.noise_ratio {
            return;
        }
        let of_reference = 1.0 / (1.0 + subset.n_averaged);
        let reading = |structure: &Structure, left: &Left, sigma_px: [f64; 2]| alike::Reading {
            variance_px2: structure.variance_px2(&warp, &left.residuals, left.residual.gain),
            sigma_px,
            scatter: structure.scatter,
            of_reference,
        };
        // The next one's match is a step from the subset's own.
        let bent = richer.as_ref().zip(bent.as_ref()).and_then(|(richer, bent)| {
            let (here, _) = richer.compare(window, &warp, workspace)?;
            let left = Left::of(richer, window, &warp.compose_inverse(&here.step)?, workspace)?;
            Some((richer, bent, left))
        });
        let Position { x_px, y_px, .. } = found.position;
        let as_stated = [x_px.sigma, y_px.sigma];
        let Some((richer, bent, by_richer)) = bent else {
            self.alike.note(frame, reading(structure, &left, as_stated));
            return;
        };
        let [of_own, of_richer] = [subset, richer].map(|subset| sigma_px(subset, &warp, &by_richer.residual));
        let of_bend = [0, 1].map(|axis| (of_richer[axis].powi(2) - of_own[axis].powi(2)).max(0.0).sqrt());
        let is_bent = left.residual.sum_of_squares > (1.0 + BENT) * by_richer.residual.sum_of_squares;
        let of_place = match is_bent {
            true => reading(&bent.of_place, &by_richer, of_own),
            false => reading(structure, &left, as_stated),
        };
        self.alike.note(frame, of_place);
        self.bends_alike.note(frame, reading(&bent.of_bend, &by_richer, of_bend));
    }

    /// The match in a frame, and whether the frame by itself tells that it is right.
    fn find(&mut self, frame: usize) -> Result<(Match, bool), Lost> {
        let Target { subset, standard, richer, .. } = self.target.as_ref().map_err(|reason| *reason)?;
        let search = FrameSearch {
            recording: self.matcher.recording,
            subset,
            standard,
            history: &self.history,
            reason: self.reason,
            is_certain: self.reference_frames.contains(&frame) && !self.starts_elsewhere,
        };
        // Of a texture too weak for it, nothing would tell how far the search's turn and stretch are from its own.
        let asks_affine = subset.settings.surfaces_bend && subset.settings.shape == Shape::Translation;
        let is_affine = |richer: &PreparedSubset| richer.settings.shape == Shape::Affine;
        let deforms = !asks_affine || richer.as_ref().is_some_and(is_affine);
        let mut matched = Matched { matcher: &mut self.matcher, parts: &mut self.parts, subset, deforms };
        let by_frame = search.find(frame, &mut matched);
        let goes_on = |found: &Match| self.continuity.goes_on_at(&self.history, found.warp().position_px);
        let (found, is_evident) = match by_frame {
            Ok(found) => (found, true),
            Err(Lost::Ambiguous) if self.continuity.lasts() => {
                (search.find_again(frame, &mut matched).filter(goes_on).ok_or(Lost::Ambiguous)?, false)
            }
            Err(reason) => return Err(reason),
        };
        if self.shape_test.is_some() || richer.is_some() {
            self.matcher.have_window(subset, frame, &found.warp())?;
        }
        Ok((found, is_evident))
    }

    fn with_reference_sigma(&self, frame: usize, mut position: Position) -> Position {
        if let (true, Ok(target)) = (self.is_sole_reference(frame), &self.target) {
            let sigma_px = reference_sigma_px(&target.subset);
            [position.x_px.sigma, position.y_px.sigma] = sigma_px;
            let at_rest = Warp::at(target.subset.centre_px);
            position.theta_rad = angle_rad(&target.subset, &at_rest, sigma_px);
        }
        position
    }
}

/// The period of a pattern that repeats itself.
fn period_px(target: &Result<Target, Lost>) -> Option<f64> {
    target.as_ref().ok().and_then(|target| target.standard.period_px())
}

/// A subset that is matched by Gauss and Newton's iteration.
struct Matched<'a, 'b> {
    matcher: &'a mut Matcher<'b>,
    parts: &'a mut Parts,
    subset: &'a PreparedSubset,
    /// Whether it is searched for turned and stretched.
    deforms: bool,
}

impl Locate for Matched<'_, '_> {
    type Found = Match;

    fn deforms(&self) -> bool {
        self.deforms
    }

    fn locate(&mut self, frame: usize, start: Warp) -> Result<Match, Lost> {
        self.matcher.match_from(self.subset, frame, start)
    }

    fn locate_expected(&mut self, frame: usize, start: Warp) -> Result<Match, Lost> {
        let found = self.matcher.match_from(self.subset, frame, start);
        if !self.parts.are_asked(self.subset, &found) {
            return found;
        }
        self.matcher.have_window(self.subset, frame, &start)?;
        let Matcher { window, workspace, .. } = &mut *self.matcher;
        self.parts.seen(self.subset, window, start, found, workspace)
    }

    fn seen(found: &Match) -> PlaceMatch {
        found.place()
    }
}
