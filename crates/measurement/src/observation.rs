//! Tracked bodies of one recording, as positions along the chain (input of stitching).

use crate::Estimate;

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

impl Observation {
    /// Interval between frames, in seconds: the median of the differences of the time stamps.
    pub fn frame_interval_s(&self) -> f64 {
        let mut intervals: Vec<f64> = self.times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_by(f64::total_cmp);
        intervals.get(intervals.len() / 2).copied().unwrap_or(f64::INFINITY)
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

    /// First and last time of the recording proper, in seconds.
    ///
    /// Cameras are known to append a dummy frame stamped months later; the span ends at the first pause of more than a
    /// thousand frames.
    pub fn span_s(&self) -> Option<(f64, f64)> {
        let longest_s = 1000.0 * self.frame_interval_s();
        let pause = self.times_s.windows(2).position(|pair| pair[1] - pair[0] > longest_s);
        let last = pause.unwrap_or(self.times_s.len() - 1);
        Some((*self.times_s.first()?, *self.times_s.get(last)?))
    }
}
