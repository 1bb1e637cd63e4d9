//! The way to one subset in one frame, whatever matches it: from where it is expected, or by search, and never to what may be something
//! else.

use chainwave_measurement::{Lost, Recording, Region};

use crate::PreparedSubset;
use crate::acceptance::{Origin, Standard};
use crate::search::area_around;
use crate::search::patch::Deformations;
use crate::search::rivals::PlaceMatch;
use crate::search::template::Template;
use crate::track::predict::{History, Search};
use crate::warp::Warp;
use crate::window::can_sample;

/// What matches a subset in a frame.
pub(crate) trait Locate {
    /// What it gives.
    type Found: Copy;
    /// Whether it finds subsets that are turned or stretched.
    fn deforms(&self) -> bool;

    /// The match in a frame from a start.
    fn locate(&mut self, frame: usize, start: Warp) -> Result<Self::Found, Lost>;

    /// The match in a frame from where the subset is expected, which may then be seen in part alone.
    fn locate_expected(&mut self, frame: usize, start: Warp) -> Result<Self::Found, Lost> {
        self.locate(frame, start)
    }

    /// Where it is, and how well it resembles the reference.
    fn seen(found: &Self::Found) -> PlaceMatch;
}

/// What is looked for in a frame, and what is known of it.
pub(crate) struct FrameSearch<'a> {
    pub(crate) recording: &'a dyn Recording,
    pub(crate) subset: &'a PreparedSubset,
    pub(crate) standard: &'a Standard,
    pub(crate) history: &'a History,
    /// Why it was lost in the frame before.
    pub(crate) reason: Lost,
    /// Whether the frame is one of the reference's: where the subset was defined it is itself.
    pub(crate) is_certain: bool,
}

impl FrameSearch<'_> {
    /// The match in a frame.
    pub(crate) fn find<L: Locate>(&self, frame: usize, locate: &mut L) -> Result<L::Found, Lost> {
        let first = (self.history.n_lost == 0).then(|| locate.locate_expected(frame, self.history.predict()));
        self.find_after(frame, first, locate)
    }

    /// The match in a frame, after what was found where the subset was expected.
    pub(crate) fn find_after<L: Locate>(
        &self,
        frame: usize,
        first: Option<Result<L::Found, Lost>>,
        locate: &mut L,
    ) -> Result<L::Found, Lost> {
        // What repeats here does so elsewhere, and no search tells more; that it did so in an earlier frame says nothing of this one.
        let mut repeats = false;
        let mut reason = match first {
            Some(first) => match self.expected(frame, first, locate) {
                Ok(found) => return Ok(found),
                Err(reason @ (Lost::NoTexture | Lost::Unreadable)) => return Err(reason),
                Err(reason) => {
                    repeats = reason == Lost::Ambiguous;
                    reason
                }
            },
            None => match self.expected_again(frame, locate) {
                Some(found) => return Ok(found),
                None if !self.would_be_seen() => Lost::OutOfView,
                None if self.reason == Lost::Ambiguous => Lost::Ambiguous,
                None => Lost::LowCorrelation,
            },
        };
        for search in self.history.searches() {
            if search.deformations.is_some() && !locate.deforms() {
                continue;
            }
            match self.by_search(frame, search, locate) {
                Ok(found) => return Ok(found),
                Err(Lost::Unreadable) => return Err(Lost::Unreadable),
                Err(by_search) => {
                    repeats |= by_search == Lost::Ambiguous;
                    reason = worse(reason, by_search);
                }
            }
            if repeats {
                break;
            }
        }
        Err(self.standard.reason(reason))
    }

    /// A match where the subset was expected, of a pattern that repeats itself: it may be believed for what was seen before.
    pub(crate) fn find_again<L: Locate>(&self, frame: usize, locate: &mut L) -> Option<L::Found> {
        let found = locate.locate(frame, self.history.predict()).ok()?;
        self.standard.is_no_chance(self.subset, L::seen(&found).zncc).then_some(found)
    }

    /// A match from where the subset was expected to go, or to turn, unless it may be something else.
    fn expected<L: Locate>(
        &self,
        frame: usize,
        first: Result<L::Found, Lost>,
        locate: &mut L,
    ) -> Result<L::Found, Lost> {
        let believed = |found: Result<L::Found, Lost>, start: Warp, locate: &mut L| {
            let found = found?;
            let clear = self.is_certain || self.standard.is_clear(self.subset, &L::seen(&found));
            if clear { Ok(found) } else { self.verified(frame, found, Origin::Expected(start), locate) }
        };
        let turning = self.history.predict_turning().filter(|_| locate.deforms());
        let found = believed(first, self.history.predict(), locate);
        let found = match (&found, turning) {
            (Err(Lost::NotConverged | Lost::LowCorrelation), Some(turning)) => {
                let again = locate.locate_expected(frame, turning);
                believed(again, turning, locate).or(found)
            }
            _ => found,
        }?;
        match self.standard.has_fallen(L::seen(&found).zncc) {
            true => Ok(self.beside_a_side_maximum(frame, turning, locate).unwrap_or(found)),
            false => Ok(found),
        }
    }

    /// A clear match of a subset that resembles its reference far less all at once where the iteration ended: it was held by a side maximum rather
    /// than hidden, if the subset is where it would have turned to, or a search around where it is expected finds it.
    fn beside_a_side_maximum<L: Locate>(
        &self,
        frame: usize,
        turning: Option<Warp>,
        locate: &mut L,
    ) -> Option<L::Found> {
        let is_clear = |found: &L::Found| self.standard.is_clear(self.subset, &L::seen(found));
        let turned = turning.and_then(|start| locate.locate_expected(frame, start).ok()).filter(is_clear);
        let (searches, deforms) = (self.history.searches_near().into_iter(), locate.deforms());
        turned.or_else(|| {
            let searches = searches.filter(|search| deforms || search.deformations.is_none());
            let mut found = searches.filter_map(|search| self.by_search(frame, search, locate).ok());
            found.find(is_clear)
        })
    }

    /// A match of a subset that is lost since a few frames, where it would be had it gone on as it did: no search is needed that has so many places
    /// to be wrong in.
    fn expected_again<L: Locate>(&self, frame: usize, locate: &mut L) -> Option<L::Found> {
        let start = self.history.predict_after_loss()?;
        let found = locate.locate(frame, start).ok()?;
        let is_there = self.standard.is_as_expected(self.subset, &start, &L::seen(&found).warp);
        is_there.then(|| self.verified(frame, found, Origin::Expected(start), locate).ok())?
    }

    fn verified<L: Locate>(
        &self,
        frame: usize,
        found: L::Found,
        origin: Origin,
        locate: &mut L,
    ) -> Result<L::Found, Lost> {
        let again = |start| locate.locate(frame, start).ok().map(|found| L::seen(&found));
        self.standard.verify(self.recording, frame, self.subset, L::seen(&found), origin, again)?;
        Ok(found)
    }

    /// A match where a search finds the subset in a frame.
    fn by_search<L: Locate>(&self, frame: usize, search: Search, locate: &mut L) -> Result<L::Found, Lost> {
        let info = self.recording.info();
        let frame_px = info.width_px.max(info.height_px);
        let reach_px = search.reach.px(self.subset.settings.search_radius_px, frame_px);
        let around_px = self.nearest_in_frame(search.around_px);
        let area = area_around(self.recording, frame, self.subset, around_px, reach_px);
        let area = area.map_err(|_| Lost::Unreadable)?.ok_or(Lost::OutOfView)?;
        let n_trials = area.n_pixels() * search.deformations.map_or(1, Deformations::count);
        let may_be = [self.history.last(), self.history.predict()];
        let origin = Origin::Searched { n_trials, reach_px, may_be };
        let mut certainly = |start: Warp| {
            let found = locate.locate(frame, start)?;
            self.verified(frame, found, origin, locate)
        };
        match search.deformations {
            None => {
                let best = area.find(&Template::upright(self.subset)).ok_or(Lost::LowCorrelation)?;
                certainly(Warp::at(best.place_px))
            }
            Some(deformations) => {
                let found = self.standard.patch().find(&area, deformations, |start| certainly(start).ok());
                found.ok_or(Lost::LowCorrelation)
            }
        }
    }

    /// Whether the frame holds the subset, and what its interpolation needs, where it is expected.
    fn would_be_seen(&self) -> bool {
        let frame = Region::whole(self.recording.info().width_px, self.recording.info().height_px);
        let interpolation = self.subset.settings.interpolation;
        let corners = self.subset.bounds(&self.history.predict());
        corners.into_iter().all(|corner| can_sample(frame, interpolation, corner))
    }

    /// The nearest place where the undeformed subset lies in the frame.
    fn nearest_in_frame(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let info = self.recording.info();
        let [half_x, half_y] = self.subset.half_px();
        let inside = |value: f64, half: f64, n: usize| value.min(n as f64 - 1.0 - half).max(half);
        [inside(x, half_x, info.width_px), inside(y, half_y, info.height_px)]
    }
}

/// Of two reasons, the one that says more: a search that fails does not change that the body left the view, or that its pattern repeats.
fn worse(before: Lost, by_search: Lost) -> Lost {
    match (before, by_search) {
        (Lost::OutOfView | Lost::Ambiguous, _) => before,
        (reason, Lost::OutOfView) => reason,
        (_, reason) => reason,
    }
}
