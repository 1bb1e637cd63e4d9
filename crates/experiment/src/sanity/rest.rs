//! Motion while the chain should be at rest: a trigger that came late, or something that drifts.

use chainwave_correlation::{ReferenceFrames, Settings, track_from};
use chainwave_measurement::{Estimate, Observation, Subset, median, median_and_robust_sigma};

use super::view_at_rest::ViewAtRest;
use crate::finding::Finding;
use crate::recordings::view::frames_at_rest;
use crate::setup::Setup;
use crate::tracked::Tracked;
use crate::tracks::FollowedBody;

/// What a finding of this kind is called.
pub(crate) const MOTION_AT_REST: &str = "motion_at_rest";
/// Frames at rest that are looked at before tracking.
const MOST_LOOKED_AT: usize = 64;
/// Fewer frames at rest do not tell by their own scatter what is motion and what noise.
const LEAST_FRAMES: usize = 6;
/// Standard deviations of a line's slope from which on a body moves from the first frame on: where the stated sigmas are a third too small, one line in
/// 4000 has as much.
const MOVING_SIGMAS: f64 = 5.5;
/// A reading this many sigma off those of the first half has left its place, where the next one has too. Two readings in a row do so
/// on one side by chance for one body in 300 000.
const LEFT_SIGMAS: f64 = 3.0;
/// One reading alone must be farther off.
const LEFT_AT_ONCE_SIGMAS: f64 = 6.0;
/// Means of the two halves this many sigma apart do not agree.
const DRIFT_SIGMAS: f64 = 5.0;
/// Bodies of which most are told from one that moves.
const LEAST_BODIES: usize = 3;
/// Variance of a median over that of a mean.
const VARIANCE_OF_MEDIAN: f64 = std::f64::consts::FRAC_PI_2;

/// What a body does while it should rest.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    /// It moves from the first frame on.
    FromFirst {
        /// How far it comes, in the readings' unit.
        by: f64,
    },
    /// It has left its place before the rest ends.
    Left {
        /// From this frame on.
        frame: usize,
        /// How far it came, in the readings' unit.
        by: f64,
    },
    /// The second half lies elsewhere than the first.
    Drift {
        /// By so much.
        by: f64,
        /// In standard deviations.
        sigmas: f64,
    },
}

/// The bodies of a recording that move before `rest_until_s`, told view by view with the largest one.
pub(super) fn motion(setup: &Setup, tracked: &Tracked) -> Vec<Finding> {
    let rest_until_s = setup.experiment.tracking.rest_until_s;
    let mut found: Vec<Moving> = Vec::new();
    for (recording, observation) in tracked.recordings.iter().zip(&tracked.observations) {
        let n_rest = observation.times_s.partition_point(|time_s| *time_s < rest_until_s);
        let at_rest = |body: &FollowedBody| -> Vec<Option<Estimate>> {
            body.positions.iter().take(n_rest).map(|found| Some(found.as_ref().ok()?.x_px)).collect()
        };
        let bodies = &recording.tracks.bodies;
        let readings = against_the_others(bodies.iter().map(at_rest).collect());
        let of_bodies = bodies.iter().zip(&readings);
        found.extend(of_bodies.filter_map(|(body, readings)| Moving::of(observation, body.body, readings)));
    }
    let mut views: Vec<u32> = found.iter().map(|moving| moving.view).collect();
    views.sort_unstable();
    views.dedup();
    let of_view = |view: u32| {
        let of_view: Vec<&Moving> = found.iter().filter(|moving| moving.view == view).collect();
        finding(setup, &of_view)
    };
    views.into_iter().filter_map(of_view).collect()
}

/// The same of the last frames at rest of one recording of each view, before anything else is tracked: what drifts takes them all to be told.
pub(super) fn motion_in_view(setup: &Setup, view: &ViewAtRest) -> Option<Finding> {
    let recording = view.recording.as_ref();
    let rest = frames_at_rest(setup, recording).ok()?.range();
    let first = rest.start.max(rest.end.saturating_sub(MOST_LOOKED_AT));
    let reference = ReferenceFrames::Single(first);
    let settings = Settings::default();
    let of_body = |(body, subset): &(usize, Subset)| {
        let at_px = [subset.x_px, subset.y_px];
        let found = track_from(recording, subset, &reference, &settings, first..rest.end, at_px).ok()?;
        let readings: Vec<Option<Estimate>> =
            found.iter().map(|found| Some(found.as_ref().ok()?.x_px)).collect();
        let (frame, by_px) = left_rest(&readings)?;
        Some(Moving {
            view: view.trial.view,
            recording: view.trial.recording.clone(),
            body: *body,
            by_px,
            how: recording
                .info()
                .times_s
                .get(first + frame)
                .map_or(How::FromFirst, |time_s| How::From(*time_s)),
        })
    };
    let moving: Vec<Moving> = view.bodies.iter().filter_map(of_body).collect();
    finding(setup, &moving.iter().collect::<Vec<_>>())
}

/// A body that moves while it should rest.
struct Moving {
    view: u32,
    recording: String,
    body: usize,
    /// How far, in pixels along the chain.
    by_px: f64,
    how: How,
}

/// How a body moves.
#[derive(Clone, Copy)]
enum How {
    /// From the first frame on.
    FromFirst,
    /// From a time on, in seconds.
    From(f64),
    /// By so many standard deviations from one half of the rest to the other.
    Drifting(f64),
}

impl Moving {
    fn of(observation: &Observation, body: usize, readings: &[Option<Estimate>]) -> Option<Self> {
        let (by_px, how) = match moved(readings)? {
            Motion::FromFirst { by } => (by, How::FromFirst),
            Motion::Left { frame, by } => (by, How::From(*observation.times_s.get(frame)?)),
            Motion::Drift { by, sigmas } => (by, How::Drifting(sigmas)),
        };
        let (view, recording) = (observation.view, observation.recording.clone());
        Some(Self { view, recording, body, by_px, how })
    }
}

fn finding(setup: &Setup, moving: &[&Moving]) -> Option<Finding> {
    let farthest = moving.iter().max_by(|a, b| a.by_px.abs().total_cmp(&b.by_px.abs()))?;
    let mut recordings: Vec<&str> = moving.iter().map(|one| one.recording.as_str()).collect();
    recordings.dedup();
    let rest_until_s = setup.experiment.tracking.rest_until_s;
    let others = match recordings.len() {
        1 => String::new(),
        n => format!(" (and in {} other recordings of view {})", n - 1, farthest.view),
    };
    let begins = |one: &&Moving| match one.how {
        How::FromFirst => Some(f64::NEG_INFINITY),
        How::From(time_s) => Some(time_s),
        How::Drifting(_) => None,
    };
    let onset_s = moving.iter().filter_map(begins).min_by(f64::total_cmp);
    let how = match (onset_s, farthest.how) {
        (Some(f64::NEG_INFINITY), _) => {
            "from the first frame on: displacements count from places that bodies have already left \
             (hint: does the film begin after the strike? record frames before it)"
                .to_owned()
        }
        (Some(onset_s), _) => format!(
            "it begins at about {:.3} ms, before the rest ends at {:.3} ms: displacements count from places that bodies have already left \
             (hint: a tracking.rest_until_s before {onset_s:.2e}; does the trigger come late?)",
            1e3 * onset_s,
            1e3 * rest_until_s
        ),
        (None, How::Drifting(sigmas)) => format!(
            "the second half of the rest lies elsewhere than the first by {:.1} standard deviations (hint: does the camera or the chain \
             drift, or does the motion begin early?)",
            sigmas.abs()
        ),
        (None, _) => String::new(),
    };
    Some(Finding {
        code: MOTION_AT_REST,
        subject: farthest.recording.clone(),
        text: format!(
            "body {} moves by {:+.3} px while the chain should rest{others}; {how}",
            farthest.body, farthest.by_px
        ),
    })
}

/// A body that leaves its place before the rest ends.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftRest {
    /// Its number.
    pub body: usize,
    /// From when on, in seconds.
    pub onset_s: f64,
    /// How far it is by the end of the rest, in metres.
    pub by_m: f64,
}

/// The body that is the first to leave its place before `rest_until_s`, where displacements would then count from a motion.
pub fn first_to_leave_rest(observation: &Observation, rest_until_s: f64) -> Option<LeftRest> {
    let n_rest = observation.times_s.partition_point(|time_s| *time_s < rest_until_s);
    let left = observation.bodies.iter().filter_map(|track| {
        let (frame, by_m) = left_rest(&track.position_m[..n_rest.min(track.position_m.len())])?;
        Some(LeftRest { body: track.body, onset_s: *observation.times_s.get(frame)?, by_m })
    });
    left.min_by(|a, b| a.onset_s.total_cmp(&b.onset_s))
}

/// The first of some readings at rest that has left its place, where one has, and how far they come; what merely drifts has not left it.
pub(crate) fn left_rest(readings: &[Option<Estimate>]) -> Option<(usize, f64)> {
    match moved(readings)? {
        Motion::FromFirst { by } => Some((0, by)),
        Motion::Left { frame, by } => Some((frame, by)),
        Motion::Drift { .. } => None,
    }
}

/// Whether readings at rest move, and how.
fn moved(readings: &[Option<Estimate>]) -> Option<Motion> {
    let seen: Vec<(usize, Estimate)> =
        readings.iter().enumerate().filter_map(|(frame, reading)| Some((frame, (*reading)?))).collect();
    let first_half = if seen.len() < LEAST_FRAMES { &seen[..] } else { &seen[..seen.len() / 2] };
    if is_moving(first_half) {
        return Some(Motion::FromFirst { by: seen.last()?.1.value - seen.first()?.1.value });
    }
    if seen.len() < LEAST_FRAMES {
        return None;
    }
    let (early, late) = seen.split_at(seen.len() / 2);
    let values = |half: &[(usize, Estimate)]| half.iter().map(|(_, x)| x.value).collect::<Vec<f64>>();
    let [middle, scatter] = median_and_robust_sigma(values(early))?;
    let stated = median(seen.iter().map(|(_, x)| x.sigma).collect())?;
    let sigma = stated.max(scatter);
    let off = |x: &Estimate| (x.value - middle) / sigma;
    let side = off(&seen.last()?.1).signum();
    let tail = late.iter().rev().take_while(|(_, x)| side * off(x) > LEFT_SIGMAS).count();
    let farthest = seen.last()?.1;
    if tail >= 2 || (tail == 1 && off(&farthest).abs() > LEFT_AT_ONCE_SIGMAS) {
        let (frame, _) = late[late.len() - tail];
        return Some(Motion::Left { frame, by: farthest.value - middle });
    }
    let mean = |half: &[(usize, Estimate)]| values(half).iter().sum::<f64>() / half.len() as f64;
    let by = mean(late) - mean(early);
    let sigmas = by / (sigma * ((late.len() as f64).recip() + (early.len() as f64).recip()).sqrt());
    (sigmas.abs() > DRIFT_SIGMAS).then_some(Motion::Drift { by, sigmas })
}

/// The readings of bodies without what most of them have in common in each frame, which is the camera's motion and told as that; as they are where
/// fewer than three are read.
fn against_the_others(mut readings: Vec<Vec<Option<Estimate>>>) -> Vec<Vec<Option<Estimate>>> {
    let middle =
        |of_body: &Vec<Option<Estimate>>| median(of_body.iter().flatten().map(|x| x.value).collect());
    let places: Vec<Option<f64>> = readings.iter().map(middle).collect();
    for frame in 0..readings.iter().map(Vec::len).max().unwrap_or(0) {
        let read = readings.iter().zip(&places);
        let away: Vec<f64> =
            read.filter_map(|(of_body, place)| Some((*of_body.get(frame)?)?.value - (*place)?)).collect();
        let n_read = away.len();
        let Some(common) = median(away).filter(|_| n_read >= LEAST_BODIES) else { continue };
        let noise = (1.0 + VARIANCE_OF_MEDIAN / n_read as f64).sqrt();
        for reading in readings.iter_mut().filter_map(|of_body| of_body.get_mut(frame)) {
            *reading = reading.map(|x| Estimate::new(x.value - common, noise * x.sigma));
        }
    }
    readings
}

/// Whether readings go along a line whose slope no noise gives.
fn is_moving(seen: &[(usize, Estimate)]) -> bool {
    let n = seen.len() as f64;
    let mean = |of: &dyn Fn(&(usize, Estimate)) -> f64| seen.iter().map(of).sum::<f64>() / n;
    let (middle, level) = (mean(&|(frame, _)| *frame as f64), mean(&|(_, x)| x.value));
    let spread = seen.iter().map(|(frame, _)| (*frame as f64 - middle).powi(2)).sum::<f64>();
    let slope = seen.iter().map(|(frame, x)| (*frame as f64 - middle) * x.value).sum::<f64>() / spread;
    let left = |(frame, x): &(usize, Estimate)| (x.value - level - slope * (*frame as f64 - middle)).powi(2);
    // What so few leave of a line is as likely how the motion bends.
    let is_known = seen.len() >= LEAST_FRAMES;
    let scatter = if is_known { seen.iter().map(left).sum::<f64>() / (n - 2.0) } else { 0.0 };
    let variance = mean(&|(_, x)| x.sigma.powi(2)).max(scatter);
    seen.len() > 1 && slope.abs() > MOVING_SIGMAS * (variance / spread).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings of unit sigma whose noise is spread like a normal one's: the same each time.
    fn readings(n: u32, motion: impl Fn(u32) -> f64) -> Vec<Option<Estimate>> {
        let noise = |k: u32| 1.3 * f64::sin(f64::from(k * k) * 2.4) + 0.4 * f64::sin(f64::from(k) * 7.1);
        (0..n).map(|k| Some(Estimate::new(noise(k) + motion(k), 1.0))).collect()
    }

    #[test]
    fn noise_is_no_motion() {
        assert_eq!(moved(&readings(38, |_| 0.0)), None);
        assert_eq!(moved(&readings(400, |_| 0.0)), None);
        assert_eq!(moved(&readings(3, |_| 100.0)), None);
        assert_eq!(moved(&readings(2, |_| 0.0)), None);
        assert_eq!(moved(&readings(1, |_| 0.0)), None);
    }

    #[test]
    fn a_film_that_begins_after_the_strike_has_no_rest() {
        for n in [2, 3, 5, 8, 20] {
            let found = moved(&readings(n, |k| 12.0 * f64::from(k)));
            let Some(Motion::FromFirst { by }) = found else { panic!("{n}: {found:?}") };
            // to the noise of both ends
            assert!((by - 12.0 * f64::from(n - 1)).abs() < 4.0, "{n}: {by}");
        }
    }

    #[test]
    fn what_all_bodies_do_is_the_cameras_and_what_one_does_is_its_own() {
        let swing = |k: u32| 20.0 * f64::sin(0.3 * f64::from(k));
        let start = |k: u32| 5.0 * f64::from(k.saturating_sub(32)).powi(2);
        let bodies = |n: u32| -> Vec<Vec<Option<Estimate>>> {
            let of_body = |body: u32| {
                // Noise of its own: the same numbers from another place on.
                let own = readings(40 + 7 * body, |_| 0.0).split_off(7 * body as usize);
                let moved = |(k, x): (u32, Option<Estimate>)| {
                    let first = if body == 0 { start(k) } else { 0.0 };
                    x.map(|x| Estimate::new(x.value + swing(k) + first, x.sigma))
                };
                (0..).zip(own).map(moved).collect()
            };
            (0..n).map(of_body).collect()
        };
        let found: Vec<Option<Motion>> = against_the_others(bodies(4)).iter().map(|one| moved(one)).collect();
        assert!(matches!(found[0], Some(Motion::Left { frame: 33..=35, .. })), "{found:?}");
        assert!(found[1..].iter().all(Option::is_none), "{found:?}");
        // Of two nobody knows which one moves.
        assert_eq!(against_the_others(bodies(2)), bodies(2));
    }

    #[test]
    fn an_early_start_and_a_drift_are_told_apart() {
        let Some(Motion::Left { frame, by }) =
            moved(&readings(40, |k| 5.0 * f64::from(k.saturating_sub(32)).powi(2)))
        else {
            panic!("expected a start")
        };
        assert!((33..=34).contains(&frame) && (by - 245.0).abs() < 5.0, "{frame}, {by}");
        let Some(Motion::Drift { by, .. }) = moved(&readings(400, |k| 0.004 * f64::from(k))) else {
            panic!("expected a drift")
        };
        assert!((by - 0.8).abs() < 0.3, "{by}");
    }
}
