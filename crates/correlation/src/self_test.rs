//! What each rung of the ladder does on the user's own scene: patches of the reference, shifted by known amounts, under
//! the recording's own noise.
//!
//! Subsets without texture take no part: they are lost by every method.
//!
//! What the film itself shows beyond shifts (turns, stretches, speed) is tried on its own frames ([`trial`]).
//!
//! Patches are shifted as in [`crate::reference::shift`]. The patch counts as the scene, with the little noise
//! that the reference has, and fresh noise of the variance measured in one frame is added to each picture, less to a reference of several. So the error
//! comes out on the safe side where the reference is a single noisy frame. Noise comes in pairs of opposite signs: what is linear in it, nearly
//! all of the scatter, cancels in the mean, which so shows errors far below the noise.

mod trial;

use chainwave_measurement::{MemoryRecording, Recording, Region, Subset};

use crate::middle::is_bare_in_middle;
use crate::reference::gradient::noise_variance;
use crate::reference::shift::{Normal, shifted};
use crate::self_test::trial::{OnFilm, Trial};
use crate::subset_size::BORDER_PX;
use crate::{CorrelationError, Method, PreparedSubset, Reference, ReferenceFrames, Settings};

/// What a rung did in a self-test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RungError {
    /// The rung.
    pub method: Method,
    /// Root mean square error along one axis of the positions found, in pixels; `None` where none was found.
    pub error_px: Option<f64>,
    /// Share of the error that stays the same when the noise changes its sign, peak to peak over sub-pixel shifts, in pixels.
    pub bias_px: f64,
    /// Positions that were found.
    pub n_found: usize,
    /// Positions that were lost.
    pub n_lost: usize,
    /// Multiplications that one position takes, by counting; no clock is read.
    pub effort: f64,
}

/// Subsets that are tested at most, spread over those given.
const MAX_SUBSETS: usize = 6;
/// Sub-pixel shifts of each.
const N_SHIFTS: usize = 10;
/// Noise at each shift: a draw, and the same with the other sign.
const SIGNS: [f64; 2] = [1.0, -1.0];
/// Pixels around a subset that are shifted with it.
const MARGIN_PX: i64 = 26;

/// Runs each method on shifted patches of the reference; where a subset has an outline, those that take outlines.
///
/// # Errors
/// As [`crate::track`].
pub fn self_test(
    methods: &[Method],
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
) -> Result<Vec<RungError>, CorrelationError> {
    let textured = textured(recording, subsets, reference, settings)?;
    let every = textured.len().div_ceil(MAX_SUBSETS).max(1);
    let films: Vec<Film> = textured
        .iter()
        .step_by(every)
        .zip(1..)
        .map(|(subset, seed)| Film::of(recording, subset, reference, seed))
        .collect::<Result<_, _>>()?;
    let has_outline = subsets.iter().any(|subset| !subset.outline_px.is_empty());
    let able = methods.iter().filter(|method| !has_outline || method.takes_outlines());
    able.map(|&method| test_one(method, &films, settings)).collect()
}

/// The subsets that show texture; all where none does. Those without say nothing of a method: each loses them, for that reason.
fn textured(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
) -> Result<Vec<Subset>, CorrelationError> {
    let mut textured = Vec::new();
    for subset in subsets {
        let prepared = PreparedSubset::new(&Reference::read(recording, subset, reference)?, subset, settings);
        if prepared.is_ok_and(|prepared| !is_bare_in_middle(&prepared)) {
            textured.push(subset.clone());
        }
    }
    Ok(if textured.is_empty() { subsets.to_vec() } else { textured })
}

/// What a rung did on the film itself, against the rung that follows turns, stretches and jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmError {
    /// The rung.
    pub method: Method,
    /// Root mean square difference along one axis from the other rung's positions beyond what noise explains, in pixels; `None` where nothing was
    /// found.
    pub error_px: Option<f64>,
    /// Positions that both found.
    pub n_found: u32,
    /// Positions that the other alone found.
    pub n_lost: u32,
}

/// Runs each method on the film from its first motion on: bodies that turn, stretch or move fast, which [`self_test`] does not know.
///
/// # Errors
/// As [`crate::track`].
pub fn film_test(
    methods: &[Method],
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
) -> Result<Vec<FilmError>, CorrelationError> {
    if subsets.is_empty() {
        return Ok(Vec::new());
    }
    let textured = textured(recording, subsets, reference, settings)?;
    let trial = Trial::new(recording, &textured, reference, settings)?;
    let of = |&method: &Method| {
        let OnFilm { error_px, n_found, n_lost, .. } = trial.of(method, settings)?;
        Ok(FilmError { method, error_px, n_found, n_lost })
    };
    methods.iter().map(of).collect()
}

/// The method with the least effort whose error in a self-test is at most `error_px` and which loses nothing there, nor of what the film
/// itself shows from its first motion on: bodies that turn, stretch or move fast.
///
/// # Errors
/// As [`self_test`], and [`CorrelationError::AccuracyNotReached`].
pub fn cheapest_within(
    error_px: f64,
    methods: &[Method],
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
) -> Result<Method, CorrelationError> {
    let mut rungs = self_test(methods, recording, subsets, reference, settings)?;
    rungs.sort_by(|a, b| a.effort.total_cmp(&b.effort));
    let whole =
        || rungs.iter().filter(|rung| rung.n_lost == 0).filter_map(|rung| Some((rung, rung.error_px?)));
    let good: Vec<Method> =
        whole().filter(|(_, found_px)| *found_px <= error_px).map(|(rung, _)| rung.method).collect();
    if !good.is_empty() && !subsets.is_empty() {
        let textured = textured(recording, subsets, reference, settings)?;
        let trial = Trial::new(recording, &textured, reference, settings)?;
        for &method in &good {
            if trial.of(method, settings)?.holds(error_px) {
                return Ok(method);
            }
        }
    }
    let best = whole().min_by(|(_, a), (_, b)| a.total_cmp(b));
    let best = match (best, good.is_empty()) {
        (None, _) => "no method without lost positions".into(),
        (Some((rung, found_px)), true) => format!("{found_px:.5} px by {}", rung.method),
        (Some(_), false) => "none that follows the motion of this film so".into(),
    };
    let (path, asked_px) = (recording.path().into(), error_px);
    let hint = if good.is_empty() {
        more_texture(recording, subsets)
    } else {
        "a shape function that turns and stretches"
    };
    Err(CorrelationError::AccuracyNotReached { path, asked_px, best, hint })
}

/// What makes every method more accurate; larger subsets only where the frame holds them, with what interpolation and a little motion need
/// around them.
fn more_texture(recording: &dyn Recording, subsets: &[Subset]) -> &'static str {
    let larger = |subset: &Subset| {
        let grown = |half: usize| half + half.div_ceil(4) + BORDER_PX;
        let (half_width_px, half_height_px) = (grown(subset.half_width_px), grown(subset.half_height_px));
        Reference::lies_inside(recording, &Subset { half_width_px, half_height_px, ..subset.clone() })
    };
    if subsets.iter().all(larger) {
        "larger subsets, more light, or the mean of several reference frames"
    } else {
        "more light, or the mean of several reference frames (the frame holds no larger subsets)"
    }
}

fn test_one(method: Method, films: &[Film], settings: &Settings) -> Result<RungError, CorrelationError> {
    let (mut square, mut n_found, mut n_lost) = (0.0, 0, 0);
    let mut means = [[0.0; 2]; N_SHIFTS];
    let mut effort = 0.0;
    for film in films {
        let subsets = std::slice::from_ref(&film.subset);
        let tracks =
            method.track(&film.recording, subsets, &ReferenceFrames::Single(0), settings, &|_| ())?;
        let n_pixels = (2 * film.subset.half_width_px + 1) * (2 * film.subset.half_height_px + 1);
        effort += method.effort(n_pixels);
        for (found, (shift, &[dx, dy])) in
            tracks[0].positions.iter().skip(1).zip(film.shifts.iter().enumerate())
        {
            let Ok(position) = found else {
                n_lost += 1;
                continue;
            };
            n_found += 1;
            let x = position.x_px.value - film.subset.x_px - dx;
            let y = position.y_px.value - film.subset.y_px - dy;
            square += x * x + y * y;
            means[shift % N_SHIFTS][0] += x;
            means[shift % N_SHIFTS][1] += 1.0;
        }
    }
    let means = means.iter().map(|[sum, n]| sum / n);
    let (low, high) = means.fold((f64::MAX, f64::MIN), |(low, high), mean| (low.min(mean), high.max(mean)));
    let error_px = (n_found > 0).then(|| (square / (2 * n_found) as f64).sqrt());
    let effort = effort / films.len().max(1) as f64;
    Ok(RungError { method, error_px, bias_px: high - low, n_found, n_lost, effort })
}

/// A patch of the reference, and the same patch shifted, with noise.
struct Film {
    recording: MemoryRecording,
    /// In the film's own pixels.
    subset: Subset,
    /// Of each frame after the first.
    shifts: Vec<[f64; 2]>,
}

impl Film {
    fn of(
        recording: &dyn Recording,
        subset: &Subset,
        reference: &ReferenceFrames,
        seed: u64,
    ) -> Result<Self, CorrelationError> {
        let region = patch_around(recording, subset)?;
        let scene = Reference::read_region(recording, region, reference)?;
        let sigma = noise_in(recording, region, reference.range().start)?.sqrt();
        let inwards = away_from_edges(subset, region);
        let shift = |i: usize| -> [f64; 2] {
            let [x, y] = [i, 3 * i].map(|step| (step % N_SHIFTS) as f64 / N_SHIFTS as f64);
            [x + inwards[0], y + inwards[1]]
        };
        let shifts: Vec<[f64; 2]> = (0..N_SHIFTS * SIGNS.len()).map(shift).collect();
        let mut random = Normal(seed);
        let mut noise = || -> Vec<f64> { (0..region.n_pixels()).map(|_| sigma * random.next()).collect() };
        let sensed = |pixels: &[f64], noise: &[f64], sign: f64| -> Vec<f32> {
            pixels.iter().zip(noise).map(|(value, noise)| (value + sign * noise) as f32).collect()
        };
        let pixels: Vec<f64> = scene.pixels().iter().map(|&pixel| f64::from(pixel)).collect();
        // The mean of several frames has so much less of it.
        let of_reference = (reference.range().len().max(1) as f64).sqrt().recip();
        let mut frames = vec![sensed(&pixels, &noise(), of_reference)];
        let scenes: Vec<Vec<f64>> =
            shifts[..N_SHIFTS].iter().map(|&shift| shifted(&pixels, region, shift)).collect();
        let noises: Vec<Vec<f64>> = scenes.iter().map(|_| noise()).collect();
        for sign in SIGNS {
            frames.extend(scenes.iter().zip(&noises).map(|(scene, noise)| sensed(scene, noise, sign)));
        }
        let subset = Subset {
            x_px: subset.x_px - region.x as f64,
            y_px: subset.y_px - region.y as f64,
            ..subset.clone()
        };
        let mut recording = MemoryRecording::cut_from(recording, region.width, frames);
        // what saturates in the recording has an exact truth once it is shifted as it is
        recording.info.bit_depth = f32::MAX_EXP.unsigned_abs();
        Ok(Self { recording, subset, shifts })
    }
}

/// Variance of a pixel's noise in a frame: the lesser of what the frame's highest frequencies and its difference from
/// the next frame allow, since fine texture adds to the one and motion to the other.
fn noise_in(recording: &dyn Recording, region: Region, frame: usize) -> Result<f64, CorrelationError> {
    let single = Reference::read_region(recording, region, &ReferenceFrames::Single(frame))?;
    let spatial = noise_variance(&single.gradients().fourth, single.pixels().len(), single.level());
    if frame + 1 >= recording.info().n_frames {
        return Ok(spatial);
    }
    let next = Reference::read_region(recording, region, &ReferenceFrames::Single(frame + 1))?;
    let square = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
    let squares: f64 = single.pixels().iter().zip(next.pixels()).map(square).sum();
    Ok(spatial.min(0.5 * squares / region.n_pixels() as f64))
}

fn patch_around(recording: &dyn Recording, subset: &Subset) -> Result<Region, CorrelationError> {
    Reference::check_inside(recording, subset)?;
    let [x0, x1, y0, y1] = crate::reference::pixel_bounds(subset);
    let info = recording.info();
    let (width, height) = (info.width_px, info.height_px);
    let (x0, y0) = (x0 - MARGIN_PX, y0 - MARGIN_PX);
    let region = Region::clipped(x0, y0, x1 + MARGIN_PX + 1, y1 + MARGIN_PX + 1, width, height);
    region.ok_or_else(|| crate::reference::outside(recording, subset))
}

/// Whole pixels that a subset near the edge of its patch is moved by, so that all its shifts can be interpolated.
fn away_from_edges(subset: &Subset, region: Region) -> [f64; 2] {
    const NEAR_PX: i64 = 8;
    let [x0, x1, y0, y1] = crate::reference::pixel_bounds(subset);
    let along = |low: i64, high: i64, first: usize, n: usize| {
        let (before, after) = (low - first as i64, (first + n) as i64 - high - 1);
        match (before < NEAR_PX, after < NEAR_PX) {
            (false, false) => 0.0,
            (true, false) => 4.0,
            (false, true) => -5.0,
            // a strip: to the side where there is more room
            (true, true) if before > after => -1.0,
            (true, true) => 0.0,
        }
    };
    [along(x0, x1, region.x, region.width), along(y0, y1, region.y, region.height)]
}
