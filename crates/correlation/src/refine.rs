//! Tracking by methods that give a place and no covariance: each of their places has the uncertainty that the method
//! showed on shifted pictures of the very subset.

mod calibration;
pub(crate) mod enhanced;
pub(crate) mod lucas_kanade;
pub(crate) mod phase;
pub(crate) mod template;

use std::ops::Range;

use chainwave_measurement::{Lost, Position, Recording, Region, Subset, Track};

use crate::acceptance::Standard;
use crate::refine::calibration::{Calibration, Judgement, judge};
use crate::search::area::SearchArea;
use crate::search::rivals::PlaceMatch;
use crate::track::find::{FrameSearch, Locate};
use crate::track::matcher::Matcher;
use crate::track::predict::History;
use crate::track::together::without_collisions;
use crate::track::tracker::{Found, Tracker, track_both_ways};
use crate::warp::Warp;
use crate::{CorrelationError, PreparedSubset, Reference, ReferenceFrames, Settings, Shape, Window};

/// A method that finds the place of a subset between pixels, by translation alone.
pub(crate) trait Refine: Sized {
    /// What is prepared once for each subset.
    fn prepare(subset: &PreparedSubset) -> Self;

    /// Where the subset's centre lies in a scene around it, from a start that is less than [`REACH_PX`] away. `None`
    /// where there is no such place.
    fn refine(&self, subset: &PreparedSubset, scene: &SearchArea, start_px: [f64; 2]) -> Option<[f64; 2]>;
}

/// Columns and rows around a subset that its scene holds.
pub(crate) const REACH_PX: i64 = 4;

/// Follows subsets as [`crate::track`] does, by a method of translation that compares each frame directly with the
/// reference. Of `settings`, the search and what counts as a match are taken.
///
/// The method's bias is taken off and sigma stated as [`crate::refine::calibration`] finds them on shifted pictures of each subset.
///
/// # Errors
/// As [`crate::track`].
pub(crate) fn track_by<R: Refine>(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Track>, CorrelationError> {
    settings.check()?;
    let settings = Settings { shape: Shape::Translation, ..settings.clone() };
    let point = |subset: &Subset| {
        let matcher = Matcher::new(recording, Window::empty(settings.interpolation));
        let target = Target::<R>::new(recording, reference, subset, &settings)?;
        Ok(RefinedSubset { target, history: History::of(subset), reason: Lost::LowCorrelation, matcher })
    };
    let points = subsets.iter().map(point).collect::<Result<_, CorrelationError>>()?;
    let mut points = Points { reference: reference.range(), points };
    let first = reference.range().start;
    let tracks = track_both_ways(&mut points, first, recording.info().n_frames, subsets, progress);
    Ok(without_collisions(tracks, subsets, first, &settings))
}

/// What is looked for.
struct Target<R> {
    subset: PreparedSubset,
    method: R,
    calibration: Calibration,
    standard: Standard,
}

impl<R: Refine> Target<R> {
    fn new(
        recording: &dyn Recording,
        frames: &ReferenceFrames,
        subset: &Subset,
        settings: &Settings,
    ) -> Result<Result<Self, Lost>, CorrelationError> {
        let reference = Reference::read(recording, subset, frames)?;
        let calibrated = || {
            let prepared = PreparedSubset::new(&reference, subset, settings)?;
            let calibration = Self::calibrate(&reference, &prepared)?;
            let standard = Standard::new(recording, frames, &prepared);
            Ok(Self { method: R::prepare(&prepared), subset: prepared, calibration, standard })
        };
        Ok(calibrated())
    }

    fn calibrate(reference: &Reference, prepared: &PreparedSubset) -> Result<Calibration, Lost> {
        let region = reference.region();
        let scene = |pixels: &[f32]| SearchArea::new(region, pixels.to_vec(), prepared.mean as f32);
        Calibration::new(reference, prepared, 0.0, |still, picture| {
            let [left, top] = [0, 1].map(|axis| (prepared.centre_px[axis] + prepared.first_px[axis]).round());
            let template = scene(still).part([left as i64, top as i64], prepared.width, prepared.height)?;
            let mut subset = prepared.clone();
            subset.linearised.template = Some(template);
            R::prepare(&subset).refine(&subset, &scene(picture), subset.centre_px)
        })
    }
}

/// One subset on its way.
struct RefinedSubset<'a, R> {
    target: Result<Target<R>, Lost>,
    history: History,
    /// Why it was lost in the last frame that it was searched in.
    reason: Lost,
    matcher: Matcher<'a>,
}

impl<R: Refine> RefinedSubset<'_, R> {
    fn find(&mut self, reference: &Range<usize>, frame: usize) -> Found {
        let target = self.target.as_mut().map_err(|reason| *reason)?;
        let Target { subset, method, calibration, standard } = target;
        let recording = self.matcher.recording;
        let (history, is_certain) = (&self.history, reference.contains(&frame));
        let search = FrameSearch { recording, subset, standard, history, reason: self.reason, is_certain };
        let mut refined = Refined { matcher: &mut self.matcher, subset, method };
        let (place, found) = search.find(frame, &mut refined)?;
        // The whole reference resembles itself more than any frame does.
        if *reference != (frame..frame + 1) {
            standard.note(&Refined::<R>::seen(&(place, found)));
        }
        let follow = |following: &PreparedSubset| {
            self.matcher.match_whole_from(following, frame, Warp::at(place)).ok()
        };
        let [x_px, y_px] = calibration.correct(place, &found, follow);
        Ok(Position { x_px, y_px, theta_rad: None, zncc: found.zncc, iterations: 0 })
    }
}

/// A subset that is located by a method.
struct Refined<'a, 'b, R> {
    matcher: &'a mut Matcher<'b>,
    subset: &'a PreparedSubset,
    method: &'a R,
}

impl<R: Refine> Locate for Refined<'_, '_, R> {
    type Found = ([f64; 2], Judgement);

    fn deforms(&self) -> bool {
        false
    }

    fn locate(&mut self, frame: usize, start: Warp) -> Result<Self::Found, Lost> {
        let (subset, start_px) = (self.subset, start.position_px);
        let Matcher { recording, .. } = *self.matcher;
        let (width, height) = (recording.info().width_px, recording.info().height_px);
        let region = region_around(subset, start_px, width, height).ok_or(Lost::OutOfView)?;
        let mut pixels = vec![0.0; region.n_pixels()];
        recording.read_region(frame, region, &mut pixels).map_err(|_| Lost::Unreadable)?;
        let scene = SearchArea::new(region, pixels, subset.mean as f32);
        let place = self.method.refine(subset, &scene, start_px).ok_or(Lost::NotConverged)?;
        self.matcher.read_window(subset, frame, &Warp::at(place))?;
        let Matcher { window, workspace, .. } = &mut *self.matcher;
        let found = judge(subset, window, place, workspace).ok_or(Lost::OutOfView)?;
        if found.zncc.is_nan() || found.zncc < subset.settings.acceptance.least_zncc() {
            return Err(Lost::LowCorrelation);
        }
        Ok((place, found))
    }

    fn seen((place, found): &Self::Found) -> PlaceMatch {
        PlaceMatch { warp: Warp::at(*place), zncc: found.zncc, share_seen: 1.0, light: None }
    }
}

/// The subset at a place with what lies within reach around it; `None` where the frame does not hold the subset.
fn region_around(subset: &PreparedSubset, [x, y]: [f64; 2], width: usize, height: usize) -> Option<Region> {
    let first = |centre: f64, offset: f64| (centre + offset).round() as i64;
    let (left, top) = (first(x, subset.first_px[0]), first(y, subset.first_px[1]));
    let (right, bottom) = (left + subset.width as i64, top + subset.height as i64);
    let inside = left >= 0 && top >= 0 && right <= width as i64 && bottom <= height as i64;
    let reach = REACH_PX;
    let region = Region::clipped(left - reach, top - reach, right + reach, bottom + reach, width, height);
    region.filter(|_| inside)
}

struct Points<'a, R> {
    reference: Range<usize>,
    points: Vec<RefinedSubset<'a, R>>,
}

impl<R: Refine> Tracker for Points<'_, R> {
    fn locate(&mut self, frame: usize) -> Vec<Found> {
        let locate = |point: &mut RefinedSubset<'_, R>| {
            let found = point.find(&self.reference, frame);
            point.history.note(&found);
            point.reason = found.err().unwrap_or(point.reason);
            found
        };
        self.points.iter_mut().map(locate).collect()
    }

    fn restart(&mut self, found: &[Found]) {
        for (point, found) in self.points.iter_mut().zip(found) {
            if let Ok(target) = &mut point.target {
                point.history = History::restarted(found, target.subset.centre_px);
                target.standard.restart(&target.subset);
            }
        }
    }
}
