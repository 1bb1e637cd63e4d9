//! Whether the lines of a picture are exposed one after another: a body that moves along the lines is then sheared in its picture, by its
//! velocity times the time from one line to the next.

use std::collections::BTreeMap;
use std::num::NonZero;

use chainwave_analysis::SIGNIFICANCE_LEVEL;
use chainwave_analysis::probability::variance_ratio_beyond;
use chainwave_correlation::{Acceptance, ReferenceFrames, Settings, mean_of_frames};
use chainwave_measurement::{
    Estimate, MemoryRecording, Position, Recording, Region, Subset, map_in_parallel, median_and_robust_sigma,
    median_interval_s,
};

use crate::finding::Finding;
use crate::recordings::view::frames_at_rest;
use crate::setup::Setup;
use crate::tracked::{Tracked, TrackedRecording};
use crate::tracks::FollowedBody;
use crate::wording::estimate;

/// Bodies of recordings that are looked at, spread evenly over all.
const MOST_BODIES: usize = 256;
/// Frames of all of them together, spread evenly over those in which they are fast: the work of a thousandth of a large experiment.
const MOST_FRAMES: usize = 1024;
/// A body is fast from this share of its largest velocity on.
const FAST: f64 = 0.25;
/// Fewer bodies do not tell a shear from what markers happen to look like.
const LEAST_BODIES: usize = 4;
/// A picture whose last line is later than its first by less than this share of a frame's period is not worth a word...
const LEAST_DELAY_SHARE: f64 = 0.01;
/// ...nor less than this one where it is not certain: shutters that roll take most of a period.
const LEAST_UNCERTAIN_SHARE: f64 = 0.1;
/// Standard deviations by which the last line may seem to be later than the next picture's first, which no shutter's is.
const BEYOND_PERIOD: f64 = 3.0;
/// Shears farther from their median than this many standard deviations are no shears: one of a million normal ones is.
const STRAY_SIGMAS: f64 = 5.0;
/// Chance below which times are corrected. A false correction moves all of them, and a shutter that does roll is told with chances far below:
/// of a thousand sound experiments ten are warned, and of ten thousand one is corrected.
const CERTAIN: f64 = 1e-4;
/// Correlation of a half with its reference from which on it is the same.
const ALIKE: f64 = 0.6;
/// Columns and rows around a subset in what is matched again.
const MARGIN_PX: i64 = 8;

/// A shutter that rolls by another time than is stated.
pub(crate) struct RollingShutter {
    /// What is to be said of it.
    pub(crate) finding: Finding,
    /// The time from line to line by which times are corrected: where none is stated, and this one is certain.
    pub(crate) corrects_to_s: Option<Estimate>,
}

/// The shutter, where it rolls by another time than is stated.
pub(crate) fn rolling_shutter(
    setup: &Setup,
    tracked: &Tracked,
    n_threads: NonZero<usize>,
) -> Option<RollingShutter> {
    let line_time = line_time(setup, tracked, n_threads)?;
    let is_stated = setup.experiment.camera.line_time_s.is_some();
    let stated_s = setup.line_time_s();
    let least_share = if line_time.p_value < CERTAIN { LEAST_DELAY_SHARE } else { LEAST_UNCERTAIN_SHARE };
    let is_much =
        (line_time.found_s.value - stated_s).abs() * line_time.n_lines > least_share * line_time.period_s;
    let contradicts = is_much && line_time.is_possible() && line_time.p_value < SIGNIFICANCE_LEVEL;
    let corrects = !is_stated && line_time.p_value < CERTAIN;
    let stated = match is_stated {
        true => format!("{:.3} us stated", 1e6 * stated_s),
        false => "nothing stated".into(),
    };
    let what_is_done = match (is_stated, corrects) {
        (true, _) => {
            "times are taken as stated, and off by the difference times the row of the picture (hint: state camera.line_time_s anew)"
        }
        (false, true) => {
            "times are corrected by that times the row of the picture (hint: state camera.line_time_s, by the camera's data sheet)"
        }
        (false, false) => {
            "too uncertain to correct times by; if it is so, they are off by that times the row of the picture (hint: state camera.line_time_s, by \
             the camera's data sheet, 0 if it has a global shutter)"
        }
    };
    contradicts.then(|| RollingShutter {
        finding: Finding {
            code: "rolling_shutter",
            subject: "camera.line_time_s".into(),
            text: format!(
                "bodies are sheared in their pictures in proportion to their velocity, as by a rolling shutter whose lines are exposed {} us \
                 after one another, with {stated} (p = {:.1e}): {what_is_done}",
                estimate(line_time.found_s.scaled(1e6)),
                line_time.p_value
            ),
        },
        corrects_to_s: corrects.then_some(line_time.found_s),
    })
}

/// The time between lines that shears ask for.
struct LineTime {
    found_s: Estimate,
    /// Chance of being as far off what is stated, were that true.
    p_value: f64,
    /// Lines of a picture.
    n_lines: f64,
    /// From frame to frame.
    period_s: f64,
}

impl LineTime {
    /// Whether the last line may be exposed before the next picture's first.
    fn is_possible(&self) -> bool {
        let Estimate { value, sigma } = self.found_s;
        (value.abs() - BEYOND_PERIOD * sigma) * self.n_lines <= self.period_s
    }
}

/// The slope of shear over velocity, fitted to all bodies by least squares; what bodies differ by is its uncertainty. Recordings of one body count
/// as one: what its marker feigns, by how it bends or as it was compressed, is the same in all of them.
fn line_time(setup: &Setup, tracked: &Tracked, n_threads: NonZero<usize>) -> Option<LineTime> {
    let all: Vec<(usize, usize)> = tracked
        .recordings
        .iter()
        .enumerate()
        .flat_map(|(index, one)| (0..one.tracks.bodies.len()).map(move |body| (index, body)))
        .collect();
    let chosen: Vec<(usize, usize)> = spread(&all, MOST_BODIES);
    let n_frames = MOST_FRAMES / chosen.len().max(1);
    let sheared = map_in_parallel(chosen.len(), n_threads, |i| {
        let (recording, body) = chosen[i];
        let recording = &tracked.recordings[recording];
        let body = &recording.tracks.bodies[body];
        Sheared::of(setup, recording, body, n_frames).map(|sheared| (body.body, sheared))
    });
    let mut by_body: BTreeMap<usize, Sheared> = BTreeMap::new();
    for (body, sheared) in sheared.into_iter().flatten() {
        by_body.entry(body).and_modify(|known| known.add(&sheared)).or_insert(sheared);
    }
    let sheared: Vec<Sheared> = by_body.into_values().collect();
    let n = sheared.len();
    if n < LEAST_BODIES {
        return None;
    }
    let sum = |of: fn(&Sheared) -> f64| sheared.iter().map(of).sum::<f64>();
    let squares = sum(|one| one.velocity_squared);
    let slope_s = sum(|one| one.shear_by_velocity) / squares;
    let left_over = |one: &Sheared| (one.shear_by_velocity - slope_s * one.velocity_squared).powi(2);
    let degrees_of_freedom = n as f64 - 1.0;
    let variance =
        sheared.iter().map(left_over).sum::<f64>() / squares.powi(2) * (n as f64 / degrees_of_freedom);
    let off = slope_s - setup.line_time_s();
    let first = sheared.first()?;
    Some(LineTime {
        found_s: Estimate::new(slope_s, variance.sqrt()),
        p_value: variance_ratio_beyond(off.powi(2) / variance, 1.0, degrees_of_freedom),
        n_lines: first.n_lines,
        period_s: first.period_s,
    })
}

/// Every so many of a list, not more than `most`.
fn spread<T: Copy>(all: &[T], most: usize) -> Vec<T> {
    let n = all.len().min(most);
    (0..n).map(|i| all[i * all.len() / n]).collect()
}

/// What one body in one or more recordings says: sums over frames for the slope of its shear over its velocity along the lines.
struct Sheared {
    /// Velocity times shear, in px/s.
    shear_by_velocity: f64,
    /// Velocity squared, in (px/s)^2.
    velocity_squared: f64,
    n_lines: f64,
    period_s: f64,
}

impl Sheared {
    /// Joins what another recording says of the same body.
    fn add(&mut self, other: &Self) {
        self.shear_by_velocity += other.shear_by_velocity;
        self.velocity_squared += other.velocity_squared;
    }

    /// `None` where the body is too small for halves, hardly seen, or cannot be read again.
    fn of(setup: &Setup, tracked: &TrackedRecording, body: &FollowedBody, n_frames: usize) -> Option<Self> {
        let recording = setup.open(&tracked.trial).ok()?;
        let reference = frames_at_rest(setup, recording.as_ref()).ok()?;
        let fast = spread(&fast_frames(&tracked.tracks.times_s, body), n_frames);
        let at_rest = body.positions.get(reference.range())?.iter().flatten().next()?;
        let crops = cropped(setup, recording.as_ref(), &reference, at_rest, &fast)?;
        let (mut shear_by_velocity, mut velocity_squared) = (0.0, 0.0);
        for (velocity, shear) in without_strays(shears(setup, &crops)?)? {
            shear_by_velocity += velocity * shear;
            velocity_squared += velocity.powi(2);
        }
        let info = recording.info();
        let period_s = median_interval_s(&info.times_s)?;
        (velocity_squared > 0.0).then_some(Self {
            shear_by_velocity,
            velocity_squared,
            n_lines: info.height_px as f64,
            period_s,
        })
    }
}

/// Frames without those in which some half was matched elsewhere: shears that lie many deviations, by the median of their distances, off the
/// median.
fn without_strays(shears: Vec<(f64, f64)>) -> Option<Vec<(f64, f64)>> {
    let [middle, scatter] = median_and_robust_sigma(shears.iter().map(|(_, shear)| *shear).collect())?;
    let is_near = |(_, shear): &(f64, f64)| (shear - middle).abs() <= STRAY_SIGMAS * scatter;
    Some(shears.into_iter().filter(is_near).collect())
}

/// A frame in which a body is fast.
#[derive(Clone, Copy)]
struct Fast {
    frame: usize,
    place: Position,
    /// Along the lines, in px/s.
    velocity: f64,
}

fn fast_frames(times_s: &[f64], body: &FollowedBody) -> Vec<Fast> {
    let at = |frame: usize| body.positions.get(frame)?.as_ref().ok();
    let of_frame = |frame: usize| {
        let (before, here, after) = (at(frame - 1)?, at(frame)?, at(frame + 1)?);
        let velocity = (after.x_px.value - before.x_px.value) / (times_s[frame + 1] - times_s[frame - 1]);
        Some(Fast { frame, place: *here, velocity })
    };
    let last = times_s.len().saturating_sub(1);
    let moving: Vec<Fast> = (1..last.max(1)).filter_map(of_frame).collect();
    let fastest = moving.iter().map(|one| one.velocity.abs()).fold(0.0, f64::max);
    moving.into_iter().filter(|one| one.velocity.abs() >= FAST * fastest && fastest > 0.0).collect()
}

/// A body as its recording shows it at rest (first) and in frames in which it is fast, each cut out where it is by then.
struct BodyCrops {
    pictures: MemoryRecording,
    /// Velocities in the frames from the second on, in px/s.
    velocities: Vec<f64>,
    subset: Subset,
}

fn cropped(
    setup: &Setup,
    recording: &dyn Recording,
    reference: &ReferenceFrames,
    at_rest: &Position,
    fast: &[Fast],
) -> Option<BodyCrops> {
    let tracking = &setup.experiment.tracking;
    let (width_px, height_px) = (recording.info().width_px, recording.info().height_px);
    let half_px = [tracking.half_width_px as i64 + MARGIN_PX, tracking.half_height_px as i64 + MARGIN_PX];
    let region = |place: &Position| {
        let [x, y] = [place.x_px.value.round() as i64, place.y_px.value.round() as i64];
        let region = Region::clipped(
            x - half_px[0],
            y - half_px[1],
            x + half_px[0] + 1,
            y + half_px[1] + 1,
            width_px,
            height_px,
        )?;
        let is_whole =
            region.width as i64 == 2 * half_px[0] + 1 && region.height as i64 == 2 * half_px[1] + 1;
        is_whole.then_some(region)
    };
    let first = region(at_rest)?;
    let mut frames = vec![mean_of_frames(recording, first, reference.range()).ok()?];
    let mut velocities = Vec::new();
    for one in fast {
        let Some(region) = region(&one.place) else { continue };
        let mut pixels = vec![0.0; region.n_pixels()];
        recording.read_region(one.frame, region, &mut pixels).ok()?;
        frames.push(pixels);
        velocities.push(one.velocity);
    }
    let subset = Subset::new(
        "",
        at_rest.x_px.value - first.x as f64,
        at_rest.y_px.value - first.y as f64,
        tracking.half_width_px,
        tracking.half_height_px,
    )
    .within(tracking.outline_px.clone());
    let pictures = MemoryRecording::cut_from(recording, first.width, frames);
    Some(BodyCrops { pictures, velocities, subset })
}

/// Velocity and shear in each frame: how far the lower half leads the upper one along the lines, and the right half the left one across
/// them, of which a turn leaves nothing.
fn shears(setup: &Setup, body: &BodyCrops) -> Option<Vec<(f64, f64)>> {
    let subset = &body.subset;
    let half_width_px = subset.half_width_px.checked_sub(1)? / 2;
    let half_height_px = subset.half_height_px.checked_sub(1)? / 2;
    let apart_px =
        [subset.half_width_px - half_width_px, subset.half_height_px - half_height_px].map(|px| px as f64);
    let beside = |side: f64| subset.part_at([side * apart_px[0], 0.0], half_width_px, subset.half_height_px);
    let above = |side: f64| subset.part_at([0.0, side * apart_px[1]], subset.half_width_px, half_height_px);
    let parts = [above(-1.0), above(1.0), beside(-1.0), beside(1.0)];
    let reference = ReferenceFrames::Single(0);
    // Each picture is cut out where the body is, so that nothing is searched for, and strays are told by the shears.
    let settings =
        Settings { acceptance: Acceptance::Zncc(ALIKE), search_radius_px: 2, ..Settings::default() };
    let tracks = setup.method().track(&body.pictures, &parts, &reference, &settings, &|_| ()).ok()?;
    let place = |part: usize, frame: usize| tracks.get(part)?.positions.get(frame)?.as_ref().ok();
    let of_frame = |(index, velocity): (usize, &f64)| {
        let at = |part: usize| place(part, index + 1);
        let (upper, lower, left, right) = (at(0)?, at(1)?, at(2)?, at(3)?);
        let along = (lower.x_px.value - upper.x_px.value) / (2.0 * apart_px[1]);
        let across = (right.y_px.value - left.y_px.value) / (2.0 * apart_px[0]);
        Some((*velocity, along + across))
    };
    Some(body.velocities.iter().enumerate().filter_map(of_frame).collect())
}
