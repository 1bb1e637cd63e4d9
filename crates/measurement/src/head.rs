//! The first frames of a recording.

use std::ops::Range;
use std::path::Path;

use crate::{PlainFrame, ReadError, Recording, RecordingInfo, Region};

/// A recording without its last frames.
pub struct Head {
    recording: Box<dyn Recording>,
    info: RecordingInfo,
}

impl Head {
    /// The frames before the first one that is stamped after `until_s`, in seconds after the trigger.
    pub fn until(recording: Box<dyn Recording>, until_s: f64) -> Self {
        let info = recording.info().until(until_s);
        Self { recording, info }
    }
}

impl RecordingInfo {
    /// What the recording would say of itself without the first frame that is stamped after `until_s`, and all that follow.
    #[must_use]
    pub fn until(&self, until_s: f64) -> Self {
        let times_s: Vec<f64> =
            self.times_s.iter().copied().take_while(|time_s| *time_s <= until_s).collect();
        Self { n_frames: times_s.len(), times_s, ..self.clone() }
    }
}

impl Recording for Head {
    fn path(&self) -> &Path {
        self.recording.path()
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn is_sequential(&self) -> bool {
        self.recording.is_sequential()
    }

    fn plain_frame(&self, frame: usize) -> Option<PlainFrame<'_>> {
        self.recording.plain_frame(frame).filter(|_| frame < self.info.n_frames)
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        self.recording.will_read(frames.start..frames.end.min(self.info.n_frames), regions);
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        self.recording.read_region(frame, region, pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MemoryRecording;

    #[test]
    fn a_head_ends_with_the_last_frame_before_its_time() {
        let mut film = MemoryRecording::new(1, 1, (0..4).map(|number| vec![number as f32]).collect());
        film.info.times_s = vec![-1.0, 0.0, 1.0, 2.0];
        let head = Head::until(Box::new(film), 1.0);
        assert_eq!(head.info().times_s, [-1.0, 0.0, 1.0]);
        assert_eq!(head.info().n_frames, 3);
        let (pixel, mut pixels) = (Region::whole(1, 1), [0.0]);
        head.read_region(2, pixel, &mut pixels).unwrap();
        assert_eq!(pixels.map(f32::to_bits), [2.0_f32.to_bits()]);
        let outside = head.read_region(3, pixel, &mut pixels).unwrap_err();
        assert!(matches!(outside, ReadError::FrameOutside { frame: 3, n_frames: 3, .. }), "{outside}");
        assert!(head.plain_frame(3).is_none());
    }
}
