//! Tracking by methods that give a place and no covariance: each of their places has the uncertainty that the method
//! showed on shifted pictures of the very subset.

mod calibration;
#[cfg(feature = "opencv")]
pub(crate) mod lucas_kanade;
#[cfg(feature = "opencv")]
pub(crate) mod opencv;
pub(crate) mod template;

use chainwave_measurement::{Estimate, Lost, Position, Recording, Region, Subset, Track};

use crate::refine::calibration::{Calibration, judge};
use crate::search::{SearchArea, search};
use crate::track::predict::History;
use crate::track::tracker::{Found, Tracker, track_both_ways};
use crate::track::window_around;
use crate::warp::Warp;
use crate::{
    CorrelationError, PreparedSubset, Reference, ReferenceFrames, Settings, Shape, Window, Workspace,
};

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
/// reference. Of `settings`, the search and `min_zncc` count.
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
        let of_subset = Reference::read(recording, subset, reference)?;
        let window = Window::empty(settings.interpolation);
        let target = Target::<R>::new(&of_subset, subset, &settings);
        let history = History::of(subset);
        Ok(RefinedSubset { target, history, window, workspace: Workspace::default() })
    };
    let points = subsets.iter().map(point).collect::<Result<_, CorrelationError>>()?;
    let mut points = Points { recording, points };
    Ok(track_both_ways(&mut points, reference.range().start, recording.info().n_frames, subsets, progress))
}

/// What is looked for.
struct Target<R> {
    subset: PreparedSubset,
    method: R,
    calibration: Calibration,
}

impl<R: Refine> Target<R> {
    fn new(reference: &Reference, subset: &Subset, settings: &Settings) -> Result<Self, Lost> {
        let prepared = PreparedSubset::new(reference, subset, settings)?;
        let region = reference.region();
        let scene = |pixels: &[f32]| SearchArea::new(region, pixels.to_vec(), prepared.mean as f32);
        let calibration = Calibration::new(reference, &prepared, 0.0, |still, picture| {
            let [left, top] = [0, 1].map(|axis| (prepared.centre_px[axis] + prepared.first_px[axis]).round());
            let template = scene(still).part([left as i64, top as i64], prepared.width, prepared.height)?;
            let mut subset = prepared.clone();
            subset.linearised.template = template;
            R::prepare(&subset).refine(&subset, &scene(picture), subset.centre_px)
        })?;
        Ok(Self { method: R::prepare(&prepared), subset: prepared, calibration })
    }
}

/// One subset on its way.
struct RefinedSubset<R> {
    target: Result<Target<R>, Lost>,
    history: History,
    window: Window,
    workspace: Workspace,
}

impl<R: Refine> RefinedSubset<R> {
    fn find(&mut self, recording: &dyn Recording, frame: usize) -> Found {
        let expected = self.history.predict().position_px;
        if self.history.n_lost == 0 {
            match self.find_near(recording, frame, expected) {
                Err(Lost::NotConverged | Lost::LowCorrelation) => (),
                settled => return settled,
            }
        }
        let target = self.target.as_ref().map_err(|reason| *reason)?;
        let around = self.history.search_place().ok_or(Lost::LowCorrelation)?;
        let place = search(recording, frame, &target.subset, around).map_err(|_| Lost::Unreadable)?;
        self.find_near(recording, frame, place.ok_or(Lost::OutOfView)?)
    }

    fn find_near(&mut self, recording: &dyn Recording, frame: usize, start: [f64; 2]) -> Found {
        let target = self.target.as_ref().map_err(|reason| *reason)?;
        let subset = &target.subset;
        let info = recording.info();
        let (width, height) = (info.width_px, info.height_px);
        let region = region_around(subset, start, width, height).ok_or(Lost::OutOfView)?;
        let mut pixels = vec![0.0; region.n_pixels()];
        recording.read_region(frame, region, &mut pixels).map_err(|_| Lost::Unreadable)?;
        let scene = SearchArea::new(region, pixels, subset.mean as f32);
        let place = target.method.refine(subset, &scene, start).ok_or(Lost::NotConverged)?;
        let (region, margins) =
            window_around(subset, &Warp::at(place), width, height).ok_or(Lost::OutOfView)?;
        let pixels = self.window.start(region, margins);
        recording.read_region(frame, region, pixels).map_err(|_| Lost::Unreadable)?;
        self.window.finish();
        let found = judge(subset, &self.window, place, &mut self.workspace).ok_or(Lost::OutOfView)?;
        if found.zncc.is_nan() || found.zncc < subset.settings.min_zncc {
            return Err(Lost::LowCorrelation);
        }
        let [x_px, y_px] =
            target.calibration.correct(place, &found).map(|(value, sigma)| Estimate::new(value, sigma));
        Ok(Position { x_px, y_px, zncc: found.zncc, iterations: 0 })
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
    recording: &'a dyn Recording,
    points: Vec<RefinedSubset<R>>,
}

impl<R: Refine> Tracker for Points<'_, R> {
    fn locate(&mut self, frame: usize) -> Vec<Found> {
        let locate = |point: &mut RefinedSubset<R>| {
            let found = point.find(self.recording, frame);
            point.history.note(&found);
            found
        };
        self.points.iter_mut().map(locate).collect()
    }

    fn restart(&mut self, found: &[Found]) {
        for (point, found) in self.points.iter_mut().zip(found) {
            point.history = point.history.restarted(found);
        }
    }
}
