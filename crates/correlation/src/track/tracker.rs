//! The way through a recording, which all trackers go.

use std::ops::Range;

use chainwave_measurement::{Lost, Position, Subset, Track};

pub(crate) type Found = Result<Position, Lost>;

/// What follows all subsets from one frame to the next.
pub(crate) trait Tracker {
    /// Each subset's position in the next frame on the way.
    fn locate(&mut self, frame: usize) -> Vec<Found>;

    /// Tells the recording what will be looked at in frames that are soon reached.
    fn read_ahead(&self, _frames: Range<usize>) {}

    /// Goes back to the first frame of the way, where the subsets were `found`, to follow them the other way.
    fn restart(&mut self, found: &[Found]);

    /// Of each subset, readings of earlier frames that were told by later ones.
    fn settled_late(&mut self) -> Vec<Vec<(usize, Position)>> {
        Vec::new()
    }
}

/// Frames that are read ahead at a time: at each, those after the ones that were before. A disk has as long for them as they take to be
/// matched.
const BATCH: usize = 8;

/// Which of the `n` steps of a way are to be read ahead when one is taken; none at most of them.
fn ahead(step: usize, n: usize) -> Range<usize> {
    let behind = match step {
        0 => 0,
        _ if step.is_multiple_of(BATCH) => step + BATCH,
        _ => return n..n,
    };
    behind.min(n)..(step + 2 * BATCH).min(n)
}

/// Tracks from frame `first` to the end, and from there back to frame 0.
pub(crate) fn track_both_ways(
    tracker: &mut (impl Tracker + ?Sized),
    first: usize,
    n_frames: usize,
    subsets: &[Subset],
    progress: &(dyn Fn(u64) + Sync),
) -> Vec<Track> {
    let locate = |tracker: &mut _, frame| {
        let found = Tracker::locate(tracker, frame);
        progress(1);
        found
    };
    let onwards = |tracker: &mut _, frame: usize| {
        let steps = ahead(frame - first, n_frames - first);
        Tracker::read_ahead(tracker, first + steps.start..first + steps.end);
        locate(tracker, frame)
    };
    let back = |tracker: &mut _, frame: usize| {
        let steps = ahead(first - 1 - frame, first);
        Tracker::read_ahead(tracker, first - steps.end..first - steps.start);
        locate(tracker, frame)
    };
    let after: Vec<Vec<Found>> = (first..n_frames).map(|frame| onwards(tracker, frame)).collect();
    if let Some(found) = after.first() {
        tracker.restart(found);
    }
    let mut frames: Vec<Vec<Found>> = (0..first).rev().map(|frame| back(tracker, frame)).collect();
    frames.reverse();
    frames.extend(after);
    for (i, late) in tracker.settled_late().into_iter().enumerate() {
        late.into_iter().for_each(|(frame, position)| frames[frame][i] = Ok(position));
    }
    let of_subset = |i: usize| frames.iter().map(|found| found[i]).collect();
    let named = |(i, subset): (usize, &Subset)| Track {
        name: subset.name.clone(),
        positions: of_subset(i),
        still_share: None,
    };
    subsets.iter().enumerate().map(named).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_is_read_ahead_once_and_before_it_is_taken() {
        for n in [0, 1, 7, 8, 9, 16, 17, 100] {
            let mut read = 0;
            for step in 0..n {
                let steps = ahead(step, n);
                if !steps.is_empty() {
                    assert_eq!(steps.start, read, "{step} of {n}: {steps:?}");
                    read = steps.end;
                }
                assert!(read > step);
            }
            assert_eq!(read, n);
        }
    }
}
