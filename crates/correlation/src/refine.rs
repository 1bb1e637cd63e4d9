//! Tracking by methods that give a place and no covariance: each of their places has the uncertainty that the method
//! showed on shifted pictures of the very subset.

use chainwave_measurement::{Estimate, Lost, Position, Recording, Region, Subset, Track};

use crate::predict::History;
use crate::search::{Scene, search};
use crate::shift::{Normal, shifted};
use crate::track::{Found, Tracker, track_both_ways, window_around};
use crate::uncertainty::scales;
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
    fn refine(&self, subset: &PreparedSubset, scene: &Scene, start_px: [f64; 2]) -> Option<[f64; 2]>;
}

/// Columns and rows around a subset that its scene holds.
pub(crate) const REACH_PX: i64 = 4;
/// Shifted pictures behind a sigma: it is known to a seventh.
const N_PICTURES: u32 = 24;

/// Follows subsets as [`crate::track`] does, by a method of translation that compares each frame directly with the
/// reference. Of `settings`, the search and `min_zncc` count.
///
/// Sigma is the root mean square error of the method on 24 pictures of the subset, shifted by known amounts under the
/// reference's own noise, so its bias is in it; where a frame's residual is larger than theirs, it grows with it.
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
        Ok(Point { target, history, window, workspace: Workspace::default() })
    };
    let points = subsets.iter().map(point).collect::<Result<_, CorrelationError>>()?;
    let mut points = Points { recording, points };
    Ok(track_both_ways(&mut points, reference.range().start, recording.info().n_frames, subsets, progress))
}

/// What is looked for.
struct Target<R> {
    subset: PreparedSubset,
    method: R,
    /// Root mean square error along x and y on shifted pictures, and the mean variance of their noise over the gain.
    sigma_px: [f64; 2],
    variance: f64,
}

impl<R: Refine> Target<R> {
    fn new(reference: &Reference, subset: &Subset, settings: &Settings) -> Result<Self, Lost> {
        let prepared = PreparedSubset::new(reference, subset, settings)?;
        let method = R::prepare(&prepared);
        let (sigma_px, variance) = calibrate::<R>(reference, subset, &prepared)?;
        Ok(Self { subset: prepared, method, sigma_px, variance })
    }
}

/// Root mean square errors along x and y on pictures of the subset, and the mean variance of their noise.
///
/// The scene is the reference without the frequencies where noise is; the subset and the pictures have noise of their own.
fn calibrate<R: Refine>(
    reference: &Reference,
    subset: &Subset,
    prepared: &PreparedSubset,
) -> Result<([f64; 2], f64), Lost> {
    let region = reference.region();
    let scene: Vec<f64> = reference.without_noise().into_iter().map(f64::from).collect();
    let mut random = Normal(1);
    let mut noisy = |scene: &[f64], variance: f64| -> Vec<f32> {
        scene.iter().map(|value| (value + variance.sqrt() * random.next()) as f32).collect()
    };
    let still = noisy(&scene, prepared.noise_variance);
    let still = Reference::new(region, still, reference.n_averaged()).map_err(|_| Lost::NoTexture)?;
    let target = PreparedSubset::new(&still, subset, &prepared.settings)?;
    let method = R::prepare(&target);
    let of_frame = prepared.noise_variance * prepared.n_averaged;
    let (mut squares, mut variance, mut n) = ([0.0; 2], 0.0, 0.0);
    let mut workspace = Workspace::default();
    for picture in 0..N_PICTURES {
        // multiples of two irrational numbers fill the square of all phases evenly
        let shift = [0.618_034, 0.754_878].map(|step| (f64::from(picture) * step).fract() - 0.5);
        let pixels = noisy(&shifted(&scene, region, shift), of_frame);
        let window = Window::new(region, &pixels, target.settings.interpolation);
        let start = target.centre_px;
        let place = method.refine(&target, &Scene::new(region, pixels, target.mean as f32), start);
        let (Some(place), Ok(window)) = (place, window) else { continue };
        let Some(found) = judge(&target, &window, place, &mut workspace) else { continue };
        for axis in 0..2 {
            squares[axis] += (place[axis] - start[axis] - shift[axis]).powi(2);
        }
        variance += found.variance;
        n += 1.0;
    }
    let enough = 2.0 * n > f64::from(N_PICTURES);
    enough.then(|| (squares.map(|square| (square / n).sqrt()), variance / n)).ok_or(Lost::NotConverged)
}

/// How the frame resembles the reference at a place; `None` where it cannot be compared.
fn judge(
    subset: &PreparedSubset,
    window: &Window,
    place: [f64; 2],
    workspace: &mut Workspace,
) -> Option<Judgement> {
    let warp = Warp::at(place);
    let (found, residual) = subset.compare(window, &warp, workspace)?;
    let [variance, _] = scales(subset, &warp, &residual);
    Some(Judgement { zncc: found.zncc, variance })
}

struct Judgement {
    zncc: f64,
    /// Of the noise, over the squared gain.
    variance: f64,
}

/// One subset on its way.
struct Point<R> {
    target: Result<Target<R>, Lost>,
    history: History,
    window: Window,
    workspace: Workspace,
}

impl<R: Refine> Point<R> {
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
        let scene = Scene::new(region, pixels, subset.mean as f32);
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
        let noisier = (found.variance / target.variance).max(1.0).sqrt();
        let [x_px, y_px] = [0, 1].map(|axis| Estimate::new(place[axis], noisier * target.sigma_px[axis]));
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
    points: Vec<Point<R>>,
}

impl<R: Refine> Tracker for Points<'_, R> {
    fn locate(&mut self, frame: usize) -> Vec<Found> {
        let locate = |point: &mut Point<R>| {
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
