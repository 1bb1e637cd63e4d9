//! The way through a recording, which all trackers go.

use chainwave_measurement::{Lost, Position, Subset, Track};

pub(crate) type Found = Result<Position, Lost>;

/// What follows all subsets from one frame to the next.
pub(crate) trait Tracker {
    /// Each subset's position in the next frame on the way.
    fn locate(&mut self, frame: usize) -> Vec<Found>;

    /// Goes back to the first frame of the way, where the subsets were `found`, to follow them the other way.
    fn restart(&mut self, found: &[Found]);

    /// Of each subset, readings of earlier frames that were told by later ones.
    fn settled_late(&mut self) -> Vec<Vec<(usize, Position)>> {
        Vec::new()
    }
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
    let after: Vec<Vec<Found>> = (first..n_frames).map(|frame| locate(tracker, frame)).collect();
    if let Some(found) = after.first() {
        tracker.restart(found);
    }
    let mut frames: Vec<Vec<Found>> = (0..first).rev().map(|frame| locate(tracker, frame)).collect();
    frames.reverse();
    frames.extend(after);
    for (i, late) in tracker.settled_late().into_iter().enumerate() {
        late.into_iter().for_each(|(frame, position)| frames[frame][i] = Ok(position));
    }
    let of_subset = |i: usize| frames.iter().map(|found| found[i]).collect();
    let named = |(i, subset): (usize, &Subset)| Track { name: subset.name.clone(), positions: of_subset(i) };
    subsets.iter().enumerate().map(named).collect()
}
