//! What ways through an experiment cost: the pixels that each looks at, made up from what is counted once for each part of them.

use super::schedule::{PlannedRecording, Schedule};
use crate::recordings::view::bodies_in_view;
use crate::setup::Setup;

/// What a run looks at, as indices into the trials, times and sizes that are tried.
pub(super) type Extent = [usize; 3];

/// Pixels by extent.
pub(super) struct Costs {
    /// Whether each recording is used, for each number of trials.
    used: Vec<Vec<bool>>,
    /// Frames of each recording, for each time.
    frames: Vec<Vec<u64>>,
    /// Pixels of a frame of each recording, for each size of the subsets.
    of_a_frame: Vec<Vec<u64>>,
}

impl Costs {
    /// Of an experiment with its first so many trials, until some times and with some half sizes of its subsets.
    pub(super) fn of(
        setup: &Setup,
        schedule: &Schedule,
        (trials, until_s, halves_px): (&[usize], &[Option<f64>], &[[usize; 2]]),
    ) -> Self {
        let recordings = &schedule.recordings;
        let is_used = |n: usize| {
            let all = || recordings.iter().map(|one| &one.trial);
            recordings.iter().map(|one| one.trial.is_among_first(n, all())).collect()
        };
        let frames = |until_s: &Option<f64>| {
            let shortened = until_s.map_or_else(|| schedule.clone(), |until_s| schedule.until(until_s));
            shortened.recordings.iter().map(|one| one.info.n_frames as u64).collect()
        };
        let of_a_frame = |halves: &[usize; 2]| {
            let mut sized = setup.clone();
            let tracking = &mut sized.experiment.tracking;
            [tracking.half_width_px, tracking.half_height_px] = *halves;
            let subset = halves.iter().map(|half| 2 * *half as u64 + 1).product::<u64>();
            let bodies = |one: &PlannedRecording| bodies_in_view(&sized, &one.trial, &one.info).len() as u64;
            recordings.iter().map(|one| bodies(one) * subset).collect()
        };
        Self {
            used: trials.iter().map(|n| is_used(*n)).collect(),
            frames: until_s.iter().map(frames).collect(),
            of_a_frame: halves_px.iter().map(of_a_frame).collect(),
        }
    }

    /// Pixels that are looked at.
    pub(super) fn pixels(&self, [trials, time, size]: Extent) -> u64 {
        let of_each = self.frames[time].iter().zip(&self.of_a_frame[size]).zip(&self.used[trials]);
        of_each.filter(|(_, is_used)| **is_used).map(|((frames, pixels), _)| frames * pixels).sum()
    }
}
