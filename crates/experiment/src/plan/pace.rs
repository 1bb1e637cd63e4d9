//! How long bodies take to be followed, measured on pictures by as many threads as a run has.

use std::num::NonZero;
use std::ops::Range;

use chainwave_correlation::ReferenceFrames;
use chainwave_measurement::{Excerpt, Subset, map_in_parallel, median};

use super::pictures::{MOST_REST_FRAMES, Pictures};
use super::schedule::{PlannedRecording, Schedule};
use crate::error::Error;
use crate::monitor::Monitor;
use crate::setup::Setup;
use crate::tracking::follow::{edges_beside, follow, threads_of_each};

/// Seconds of one thread while all of them work: they share memory, caches and often cores.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    /// To prepare a subset.
    prepared_s: f64,
    /// To find it in a frame.
    found_s: f64,
    /// To wait for a disk, for each frame that memory does not hold.
    waited_s: f64,
    /// Whether frames are decoded one after the other, which one thread does.
    is_sequential: bool,
}

/// Of the frames in motion, those that the shorter of two measurements takes.
const FEW_FRAMES: usize = 4;
/// How many times both are taken.
const ROUNDS: usize = 3;

impl Pace {
    /// Measured by a clock: the same bodies followed through a few frames, and through more, by all threads side by side.
    ///
    /// # Errors
    /// Pictures that cannot be followed.
    pub(super) fn measured(
        setup: &Setup,
        pictures: &[Pictures],
        n_threads: NonZero<usize>,
        now_s: &dyn Fn() -> f64,
    ) -> Result<Self, Error> {
        let seconds = |most_moving: usize| -> Result<f64, Error> {
            let from_s = now_s();
            let of_thread = |thread: usize| {
                // Each begins with another view, as in a run.
                let mut in_turn = pictures.iter().cycle().skip(thread).take(pictures.len());
                in_turn.try_for_each(|one| follow_some(setup, one, most_moving))
            };
            map_in_parallel(n_threads.get(), n_threads, of_thread)
                .into_iter()
                .collect::<Result<(), Error>>()?;
            Ok(now_s() - from_s)
        };
        let waited_s = waited_s(setup, pictures, n_threads, now_s)?;
        let mut rounds = Vec::with_capacity(ROUNDS);
        for _ in 0..ROUNDS {
            rounds.push([seconds(FEW_FRAMES)?, seconds(usize::MAX)?]);
        }
        // What else the machine does disturbs a round at times, and seldom most of them.
        let middle = |of: &dyn Fn(&[f64; 2]) -> f64| median(rounds.iter().map(of).collect()).unwrap_or(0.0);
        let (more_s, all_s) = (middle(&|[few_s, all_s]| all_s - few_s), middle(&|[_, all_s]| *all_s));
        let sum = |of: &dyn Fn(&Pictures) -> usize| pictures.iter().map(of).sum::<usize>() as f64;
        let n_more = sum(&|one| one.subsets.len() * one.moving.len().saturating_sub(FEW_FRAMES));
        let n_found = sum(&|one| one.subsets.len() * (some_rest(one).len() + one.moving.len()));
        let found_s = (more_s / n_more.max(1.0)).max(0.0);
        let n_prepared = sum(&|one| one.subsets.len()).max(1.0);
        let prepared_s = ((all_s - found_s * n_found) / n_prepared).max(0.0);
        let is_sequential = pictures.iter().any(|one| one.recording.is_sequential());
        Ok(Self { prepared_s, found_s, waited_s, is_sequential })
    }

    /// Seconds for all recordings of a schedule with so many threads, which work on recordings side by side as a run does.
    pub(super) fn seconds(&self, setup: &Setup, schedule: &Schedule, n_threads: NonZero<usize>) -> f64 {
        let of_recording = |one: &PlannedRecording| {
            let n_frames = one.info.n_frames as f64;
            let followed_s = one.n_bodies(setup) as f64 * (self.prepared_s + self.found_s * n_frames);
            followed_s + self.waited_s * (1.0 - one.in_memory) * n_frames
        };
        let recordings = &schedule.recordings;
        let of_all: f64 = recordings.iter().map(of_recording).sum();
        let of_each = if self.is_sequential { 1 } else { threads_of_each(n_threads, recordings.len()).get() };
        of_all / side_by_side(recordings.len(), n_threads) / of_each as f64
    }
}

/// Seconds that one thread, beside the others, waits for a disk for each frame that memory does not hold: by what following takes longer the
/// first time than again. 0 where memory holds all.
fn waited_s(
    setup: &Setup,
    pictures: &[Pictures],
    n_threads: NonZero<usize>,
    now_s: &dyn Fn() -> f64,
) -> Result<f64, Error> {
    let on_disk = |one: &Pictures| (1.0 - one.moving_in_memory) * one.moving.len() as f64;
    let n_on_disk: f64 = pictures.iter().map(on_disk).sum();
    if n_on_disk < 1.0 {
        return Ok(0.0);
    }
    let seconds = || -> Result<f64, Error> {
        let from_s = now_s();
        let of_each = |index: usize| follow_some(setup, &pictures[index], usize::MAX);
        map_in_parallel(pictures.len(), n_threads, of_each).into_iter().collect::<Result<(), Error>>()?;
        Ok(now_s() - from_s)
    };
    let (first_s, again_s) = (seconds()?, seconds()?);
    Ok((first_s - again_s).max(0.0) * side_by_side(pictures.len(), n_threads) / n_on_disk)
}

/// How many recordings are worked on at once, on the mean over a run: towards its end some threads have none.
fn side_by_side(n_recordings: usize, n_threads: NonZero<usize>) -> f64 {
    n_recordings as f64 / n_recordings.div_ceil(n_threads.get()).max(1) as f64
}

/// Frames at rest that are followed: a recording may have thousands.
fn some_rest(pictures: &Pictures) -> Range<usize> {
    let Range { start, end } = pictures.rest;
    start..end.min(start + MOST_REST_FRAMES)
}

fn follow_some(setup: &Setup, pictures: &Pictures, most_moving: usize) -> Result<(), Error> {
    let subsets: Vec<Subset> = pictures.subsets.iter().map(|(_, subset)| subset.clone()).collect();
    let rest = some_rest(pictures);
    let reference = ReferenceFrames::Mean(0..rest.len());
    let frames: Vec<usize> = rest.chain(pictures.moving.clone().take(most_moving)).collect();
    let excerpt = Excerpt::new(pictures.recording.as_ref(), frames);
    follow(&excerpt, &subsets, &reference, setup.method(), NonZero::<usize>::MIN, &Monitor::SILENT)?;
    edges_beside(&excerpt, &subsets, &reference)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_recordings_leave_threads_without_work() {
        for (n_recordings, n_threads, expected) in
            [(25, 1, 1.0), (25, 2, 25.0 / 13.0), (5, 4, 2.5), (3, 8, 3.0)]
        {
            let found = side_by_side(n_recordings, NonZero::new(n_threads).unwrap());
            assert!((found - expected).abs() < 1e-12, "{n_recordings} by {n_threads}: {found}");
        }
    }
}
