//! Frame rates that are far from what recordings state, as one that was typed for another: from the course of a body that two views show.
//!
//! Least squares about the stated times find a clock that is off by a per cent or so; farther off they go astray. But the course of a body, from rest
//! to where it comes to stand, is one in both views, over times that are longer in the one by a factor: that is looked for among many, whenever
//! the motion comes, as a view's trigger may be late by as much as it likes.

use std::collections::BTreeSet;
use std::num::NonZero;

use chainwave_measurement::{BodyTrack, Observation, map_in_parallel, median};

/// Logarithm of the largest factor that is tried, and the step from one to the next.
const LARGEST: f64 = 0.9;
const STEP: f64 = 0.01;
/// Frames by which courses may be apart beside that.
const FRAMES_APART: f64 = 3.0;
/// Share of a step and of a frame by which the best of them is looked for.
const FINE: f64 = 0.25;
/// What a factor leaves of the square that stated times leave, at most, where it is believed.
const LEFT: f64 = 0.1;
/// Frames of a course that both views have to show at least, and the share of the longer one's.
const LEAST_FRAMES: usize = 20;
const LEAST_SHARE: f64 = 0.3;

/// The mean course of a body in the recordings of a view, from rest, at times from the trigger on: of the trial in the middle, where triggers scatter.
struct Course {
    interval_s: f64,
    displacement_m: Vec<f64>,
}

/// By how much longer than stated the time between the frames of each view is, relative to that; nothing where no two views contradict
/// each other by a per cent. Most views are taken to be right.
pub(crate) fn rough_excesses(
    observations: &[Observation],
    rest_until_s: f64,
    n_threads: NonZero<usize>,
) -> Vec<(u32, f64)> {
    let views: Vec<u32> =
        observations.iter().map(|one| one.view).collect::<BTreeSet<u32>>().into_iter().collect();
    let of_view = |view: u32| observations.iter().filter(|one| one.view == view).collect::<Vec<_>>();
    let pairs: Vec<&[u32]> = views.windows(2).collect();
    let between_pairs = map_in_parallel(pairs.len(), n_threads, |pair| {
        between(&of_view(pairs[pair][0]), &of_view(pairs[pair][1]), rest_until_s).unwrap_or(0.0)
    });
    let mut logarithm = 0.0;
    let mut of_views: Vec<f64> = views.first().map(|_| logarithm).into_iter().collect();
    for between_pair in between_pairs {
        logarithm += between_pair;
        of_views.push(logarithm);
    }
    let usual = median(of_views.clone()).unwrap_or(0.0);
    let is_off = |of_view: &f64| (of_view - usual).abs() > 0.5 * STEP;
    let excess = |(view, of_view): (&u32, &f64)| (*view, (of_view - usual).exp_m1());
    views.iter().zip(&of_views).filter(|(_, of_view)| is_off(of_view)).map(excess).collect()
}

/// The logarithm of how much longer the times of the second view are; `None` where they are as long as those of the first, or nothing tells.
fn between(first: &[&Observation], second: &[&Observation], rest_until_s: f64) -> Option<f64> {
    let bodies_of = |recordings: &[&Observation]| -> BTreeSet<usize> {
        recordings.iter().flat_map(|one| one.bodies.iter().map(|track| track.body)).collect()
    };
    let pairs: Vec<[Course; 2]> = bodies_of(first)
        .intersection(&bodies_of(second))
        .filter_map(|body| {
            Some([Course::of(first, *body, rest_until_s)?, Course::of(second, *body, rest_until_s)?])
        })
        .collect();
    if pairs.is_empty() {
        return None;
    }
    // A body that the wave does not reach in both has noise alone, and says nothing.
    let weight = |[first, second]: &[Course; 2]| first.most_m().min(second.most_m()).powi(2);
    let total: f64 = pairs.iter().map(weight).sum();
    let left = |logarithm: f64, frames: f64| -> Option<f64> {
        let weighted = |pair: &[Course; 2]| {
            Some(weight(pair) / total * left_of(&pair[0], &pair[1], logarithm.exp(), frames)?)
        };
        pairs.iter().map(weighted).sum()
    };
    let best_of = |about: f64, step: f64, n: i32, frames: f64| {
        let logarithms = (-n..=n).map(|k| about + step * f64::from(k));
        let tried = logarithms.filter_map(|logarithm| Some((logarithm, left(logarithm, frames)?)));
        tried.min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let as_stated = left(0.0, FINE)?;
    let (rough, _) = best_of(0.0, STEP, (LARGEST / STEP) as i32, 1.0)?;
    let (best, left) = best_of(rough, FINE * STEP, FINE.recip() as i32, FINE)?;
    (left < LEFT * as_stated).then_some(best)
}

/// The share of the second course's square that the first one leaves of it, over times that are so many times as long, larger or smaller by
/// a factor, and later by some of so many frames: from the triggers on, or from when both arrive. `None` where they have too little in common.
fn left_of(first: &Course, second: &Course, factor: f64, frames: f64) -> Option<f64> {
    // One of them may end on its way.
    let level_m = 0.5 * first.most_m().min(second.most_m());
    let by_arrival_s = first.passes_s(level_m)? - factor * second.passes_s(level_m)?;
    let n = (FRAMES_APART / frames) as i32;
    let apart_s = (-n..=n).map(|k| f64::from(k) * frames * second.interval_s);
    let later = apart_s.flat_map(|apart_s| [apart_s, apart_s + by_arrival_s]);
    let left = later.filter_map(|later_s| {
        let (mut n_both, [mut xx, mut xy, mut yy]) = (0, [0.0; 3]);
        for (k, y) in second.displacement_m.iter().enumerate() {
            let time_s = k as f64 * factor * second.interval_s + later_s;
            let Some(x) = first.at(time_s) else { continue };
            n_both += 1;
            (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
        }
        let most = first.displacement_m.len().max(second.displacement_m.len()) as f64;
        let is_enough = n_both >= LEAST_FRAMES && n_both as f64 > LEAST_SHARE * most && xx > 0.0 && yy > 0.0;
        is_enough.then(|| 1.0 - xy * xy / (xx * yy))
    });
    left.min_by(f64::total_cmp)
}

impl Course {
    /// `None` of a body that no recording shows from rest on.
    fn of(recordings: &[&Observation], body: usize, rest_until_s: f64) -> Option<Self> {
        let seen = recordings.iter().filter_map(|one| {
            let track = one.bodies.iter().find(|track| track.body == body)?;
            Some((*one, track, one.mean_before_m(track, rest_until_s)?))
        });
        let seen: Vec<(&Observation, &BodyTrack, f64)> = seen.collect();
        let (longest, ..) = seen.iter().max_by(|a, b| last_s(a.0).total_cmp(&last_s(b.0)))?;
        let interval_s = longest.frame_interval_s();
        let n = (last_s(longest) / interval_s).max(0.0) as usize;
        // Trials whose triggers differ would smear their mean, as a longer time does; each is shifted to when the one in the middle arrives.
        let later_s = later_than_middle_s(&seen);
        let mean_m = |k: usize| -> Option<f64> {
            let time_s = k as f64 * interval_s;
            let at = seen.iter().zip(&later_s).filter_map(|((one, track, rest_m), later_s)| {
                Some(place_m(one, track, time_s + later_s)? - rest_m)
            });
            let at: Vec<f64> = at.collect();
            (!at.is_empty()).then(|| at.iter().sum::<f64>() / at.len() as f64)
        };
        let displacement_m: Vec<f64> = (0..n).map_while(mean_m).collect();
        Some(Self { interval_s, displacement_m })
    }

    fn most_m(&self) -> f64 {
        self.displacement_m.iter().map(|x| x.abs()).fold(0.0, f64::max)
    }

    /// When the body first passes a distance from where it rested.
    fn passes_s(&self, level_m: f64) -> Option<f64> {
        let frame = self.displacement_m.iter().position(|x| x.abs() > level_m)?;
        Some(frame as f64 * self.interval_s)
    }

    fn at(&self, time_s: f64) -> Option<f64> {
        let place = time_s / self.interval_s;
        if place < 0.0 {
            return Some(0.0);
        }
        let k = place as usize;
        let (before, behind) = (self.displacement_m.get(k)?, self.displacement_m.get(k + 1)?);
        Some(before + (place - k as f64) * (behind - before))
    }
}

/// How much later than in the trial in the middle the body passes half of the least of its largest displacements, trial by trial; nothing where it
/// does not in each.
fn later_than_middle_s(seen: &[(&Observation, &BodyTrack, f64)]) -> Vec<f64> {
    let away_m = |(_, track, rest_m): &(&Observation, &BodyTrack, f64)| -> Vec<Option<f64>> {
        track.position_m.iter().map(|x| x.map(|x| (x.value - rest_m).abs())).collect()
    };
    let all: Vec<Vec<Option<f64>>> = seen.iter().map(away_m).collect();
    let most_m = all.iter().map(|one| one.iter().flatten().copied().fold(0.0, f64::max));
    let level_m = 0.5 * most_m.fold(f64::INFINITY, f64::min);
    let passes_s = |((observation, ..), away_m): (&(&Observation, &BodyTrack, f64), &Vec<Option<f64>>)| {
        let k = away_m.iter().position(|x| x.is_some_and(|x| x > level_m))?;
        let (before, behind) = (k.checked_sub(1).and_then(|before| away_m[before])?, away_m[k]?);
        let share = (level_m - before) / (behind - before);
        let times_s = &observation.times_s;
        Some(times_s[k - 1] + share * (times_s[k] - times_s[k - 1]))
    };
    let passes_s: Option<Vec<f64>> = seen.iter().zip(&all).map(passes_s).collect();
    let middle_s = passes_s.clone().and_then(median);
    match passes_s.zip(middle_s) {
        Some((passes_s, middle_s)) => passes_s.into_iter().map(|own_s| own_s - middle_s).collect(),
        None => vec![0.0; seen.len()],
    }
}

fn last_s(observation: &Observation) -> f64 {
    observation.times_s.last().copied().unwrap_or(0.0)
}

/// Place of a body at a time between two frames in which it was seen.
fn place_m(observation: &Observation, track: &BodyTrack, time_s: f64) -> Option<f64> {
    let times_s = &observation.times_s;
    let k = times_s.partition_point(|other_s| *other_s <= time_s).checked_sub(1)?;
    let (before, behind) = (track.position_m[k]?.value, (*track.position_m.get(k + 1)?)?.value);
    Some(before + (time_s - times_s[k]) / (times_s[k + 1] - times_s[k]) * (behind - before))
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;

    /// A body that starts late, swings and comes to stand, seen in three trials at 25 kHz by a view whose stamps are `factor` of the true times.
    fn view(view: u32, factor: f64, body: usize) -> Vec<Observation> {
        late_view(view, factor, body, 0.0)
    }

    /// The same with a trigger that comes so much before the others'.
    fn late_view(view: u32, factor: f64, body: usize, late_s: f64) -> Vec<Observation> {
        let times_s: Vec<f64> = (-30..330).map(|k| f64::from(k) * 4e-5).collect();
        let way_m = |time_s: f64, strength: f64| {
            let since = (time_s - late_s - 1e-3 * body as f64).max(0.0) / 1e-3;
            strength * 5e-3 * (1.0 - (-since).exp()) * (1.0 + 0.3 * (1.5 * since).sin())
        };
        let of_trial = |trial: u32| {
            let noise = |k: usize| 1e-6 * f64::sin((k * k + 7 * trial as usize) as f64);
            let place = |(k, time_s): (usize, &f64)| {
                Some(Estimate::new(way_m(*time_s, 1.0 + 0.02 * f64::from(trial)) + noise(k), 1e-6))
            };
            let position_m = times_s.iter().enumerate().map(place).collect();
            Observation {
                recording: format!("view{view}_trial{trial}"),
                view,
                trial,
                times_s: times_s.iter().map(|time_s| time_s * factor).collect(),
                bodies: vec![BodyTrack { body, position_m }],
            }
        };
        (1..=3).map(of_trial).collect()
    }

    #[test]
    fn a_view_of_another_frame_rate_is_found_among_those_that_are_right() {
        for factor in [0.5, 24.0 / 25.0, 1.0 / 0.97, 2.0] {
            let all = [view(1, 1.0, 3), view(2, factor, 3), view(3, 1.0, 3)].concat();
            let found = rough_excesses(&all, 0.0, NonZero::<usize>::MIN);
            assert_eq!(found.len(), 1, "{factor}: {found:?}");
            // To a step.
            assert!(
                found[0].0 == 2 && ((1.0 + found[0].1) * factor).ln().abs() < STEP,
                "{factor}: {found:?}"
            );
        }
    }

    #[test]
    fn views_that_are_right_and_views_that_share_nothing_say_nothing() {
        let right = [view(1, 1.0, 3), view(2, 1.0, 3), view(3, 1.004, 3)].concat();
        assert_eq!(rough_excesses(&right, 0.0, NonZero::<usize>::MIN), []);
        let late = [view(1, 1.0, 3), late_view(2, 1.0, 3, 1e-3), late_view(3, 1.0, 3, -1e-3)].concat();
        assert_eq!(rough_excesses(&late, 0.0, NonZero::<usize>::MIN), []);
        let apart = [view(1, 1.0, 3), view(2, 1.3, 4)].concat();
        assert_eq!(rough_excesses(&apart, 0.0, NonZero::<usize>::MIN), []);
        assert_eq!(rough_excesses(&[], 0.0, NonZero::<usize>::MIN), []);
    }

    #[test]
    fn trials_whose_triggers_scatter_are_no_other_frame_rate() {
        // One trial of view 2 is late or early, or all of them scatter.
        for late_s in [[1e-3, 0.0, 0.0], [-1e-3, 0.0, 0.0], [0.0, 0.0, 2e-3], [5e-4, -3e-4, 2e-4]] {
            let scattering: Vec<Observation> =
                (0..3).map(|trial| late_view(2, 1.0, 3, late_s[trial]).swap_remove(trial)).collect();
            let all = [view(1, 1.0, 3), scattering, view(3, 1.0, 3)].concat();
            assert_eq!(rough_excesses(&all, -4e-4, NonZero::<usize>::MIN), [], "{late_s:?}");
        }
    }

    #[test]
    fn of_two_views_one_is_held_against_the_other() {
        let found = rough_excesses(&[view(1, 1.0, 3), view(2, 0.8, 3)].concat(), 0.0, NonZero::<usize>::MIN);
        let [(which, excess)] = found[..] else { panic!("{found:?}") };
        let expected: f64 = if which == 1 { 0.8 } else { 1.0 / 0.8 };
        assert!(((1.0 + excess) / expected).ln().abs() < STEP, "{found:?}");
    }
}
