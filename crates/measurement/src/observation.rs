//! Tracked bodies of one recording, as positions along the chain (input of stitching).

use std::iter;
use std::ops::Range;

use crate::{Estimate, median_interval_s};

/// A pause of more frames than this parts a recording.
const PAUSE_FRAMES: f64 = 1000.0;

/// The tracked bodies of one recording, as positions along the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Name of the recording, for messages.
    pub recording: String,
    /// Number of the camera view.
    pub view: u32,
    /// Number of the trial in that view.
    pub trial: u32,
    /// Time of each frame after the trigger, in seconds, increasing.
    pub times_s: Vec<f64>,
    /// The bodies seen.
    pub bodies: Vec<BodyTrack>,
}

/// One body's position along the chain in each frame of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyTrack {
    /// Number of the body; 1 is the struck one.
    pub body: usize,
    /// Position along the chain in metres, from any fixed origin; `None` where the body was lost. Of an observation across the chain it is
    /// the position there, of an observation of rotations the angle in radians (the arc, in metres, at a radius of 1 m).
    pub position_m: Vec<Option<Estimate>>,
}

/// The frames of a recording proper, by their time stamps: the longest stretch without a pause of more than a thousand frames. Cameras are known
/// to append a dummy frame that is stamped months later.
pub(crate) fn proper_frames(times_s: &[f64]) -> Range<usize> {
    let longest_s = PAUSE_FRAMES * median_interval_s(times_s).unwrap_or(f64::INFINITY);
    let pauses = times_s.windows(2).enumerate().filter(|(_, pair)| pair[1] - pair[0] > longest_s);
    let bounds: Vec<usize> =
        iter::once(0).chain(pauses.map(|(before, _)| before + 1)).chain([times_s.len()]).collect();
    // Of equally long ones the first.
    bounds.windows(2).map(|bound| bound[0]..bound[1]).rev().max_by_key(Range::len).unwrap_or(0..0)
}

impl Observation {
    /// Interval between frames, in seconds: the median of the differences of the time stamps.
    pub fn frame_interval_s(&self) -> f64 {
        median_interval_s(&self.times_s).unwrap_or(f64::INFINITY)
    }

    /// The readings of one of its bodies before a time, such as the one until which all rests.
    pub fn readings_before<'a>(
        &'a self,
        track: &'a BodyTrack,
        time_s: f64,
    ) -> impl Iterator<Item = Estimate> + Clone + 'a {
        let n_frames = self.times_s.partition_point(|own_s| *own_s < time_s);
        track.position_m.iter().take(n_frames).flatten().copied()
    }

    /// Mean position of one of its bodies before a time, in metres; `None` where it was not seen then.
    pub fn mean_before_m(&self, track: &BodyTrack, time_s: f64) -> Option<f64> {
        let readings = self.readings_before(track, time_s);
        let n = readings.clone().count();
        (n > 0).then(|| readings.map(|reading| reading.value).sum::<f64>() / n as f64)
    }

    /// First and last time of the recording proper, the longest stretch without a pause of more than a thousand frames, in seconds; `None` without
    /// frames.
    pub fn span_s(&self) -> Option<(f64, f64)> {
        let frames = self.proper_frames();
        Some((*self.times_s.get(frames.start)?, *self.times_s.get(frames.end.checked_sub(1)?)?))
    }

    /// Drops frames behind the recording proper, which say nothing of when they were taken.
    pub fn end_with_span(&mut self) {
        let end = self.proper_frames().end;
        self.times_s.truncate(end);
        self.bodies.iter_mut().for_each(|track| track.position_m.truncate(end));
    }

    fn proper_frames(&self) -> Range<usize> {
        proper_frames(&self.times_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen_at(times_s: Vec<f64>) -> Observation {
        let position_m = times_s.iter().map(|time_s| Some(Estimate::new(*time_s, 1e-6))).collect();
        let bodies = vec![BodyTrack { body: 1, position_m }];
        Observation { recording: "film".into(), view: 1, trial: 1, times_s, bodies }
    }

    #[test]
    fn stray_frames_at_either_end_are_no_part_of_the_recording() {
        let proper_s = || (0..50).map(|frame| 4e-5 * f64::from(frame));
        let mut late = seen_at(proper_s().chain([2.5e7]).collect());
        assert_eq!(late.span_s(), Some((0.0, 4e-5 * 49.0)));
        late.end_with_span();
        assert_eq!(late, seen_at(proper_s().collect()));
        let early = seen_at([-1.0].into_iter().chain(proper_s()).collect());
        assert_eq!(early.span_s(), Some((0.0, 4e-5 * 49.0)));
        assert_eq!(seen_at(Vec::new()).span_s(), None);
        assert_eq!(seen_at(vec![0.5]).span_s(), Some((0.5, 0.5)));
    }
}
