//! Where an experiment's recordings come from: files in its folder, or recordings that the caller holds.

use std::path::PathBuf;
use std::sync::Arc;

use chainwave_measurement::{Head, Recording, Region};
use sha2::{Digest, Sha256};

use crate::configuration::Trial;
use crate::error::Error;
use crate::input::content::{content, hexadecimal};
use crate::setup::{HeldRecordings, Setup};

impl Setup {
    /// The setup with recordings that need no file; the others are looked for in its folder.
    ///
    /// # Errors
    /// A recording that no trial names.
    pub fn with_recordings(mut self, held: HeldRecordings) -> Result<Self, Error> {
        let is_named = |name: &String| self.table.iter().any(|trial| trial.recording == *name);
        if let Some(stranger) = held.keys().find(|name| !is_named(name)) {
            let expected = self.table.first().map_or("", |trial| trial.recording.as_str());
            return Err(Error::Value(format!(
                "recordings: expected names that the trials table has, such as {expected:?}, found {stranger:?}"
            )));
        }
        self.held = held;
        Ok(self)
    }

    /// Where the file of a recording lies.
    pub fn path_of(&self, trial: &Trial) -> PathBuf {
        self.recordings.join(&trial.recording)
    }

    /// Opens a recording that the calibration holds for, as far as it is looked at, without what the sensor adds where that is known.
    ///
    /// # Errors
    /// A recording that cannot be read, or whose frames have another size than the calibration's.
    pub fn open(&self, trial: &Trial) -> Result<Box<dyn Recording>, Error> {
        let recording: Box<dyn Recording> = match self.held.get(&trial.recording) {
            Some(held) => Box::new(Arc::clone(held)),
            None => chainwave_camera::open_with(&self.path_of(trial), &self.open_options())?,
        };
        self.map.check_size(recording.as_ref())?;
        let corrected = match &self.sensor {
            Some(sensor) => sensor.correct(recording)?,
            None => recording,
        };
        Ok(match self.experiment.tracking.until_s {
            Some(until_s) => Box::new(Head::until(corrected, until_s)),
            None => corrected,
        })
    }

    /// Whether there is something to open.
    pub(crate) fn has_recording(&self, trial: &Trial) -> bool {
        self.held.contains_key(&trial.recording) || self.path_of(trial).exists()
    }

    /// What a recording holds, as a text: two that have the same are the same.
    pub(crate) fn content_of(&self, trial: &Trial) -> Result<String, Error> {
        match self.held.get(&trial.recording) {
            Some(held) => content_of_frames(held.as_ref()),
            None => content(&self.path_of(trial)),
        }
    }
}

/// Size, times and a digest of every pixel.
fn content_of_frames(recording: &dyn Recording) -> Result<String, Error> {
    let info = recording.info();
    let whole = Region { x: 0, y: 0, width: info.width_px, height: info.height_px };
    let (mut hash, mut pixels) = (Sha256::new(), vec![0.0_f32; whole.n_pixels()]);
    info.times_s.iter().for_each(|time_s| hash.update(time_s.to_le_bytes()));
    for frame in 0..info.n_frames {
        recording.read_region(frame, whole, &mut pixels)?;
        pixels.iter().for_each(|count| hash.update(count.to_le_bytes()));
    }
    let (n, width_px, height_px) = (info.n_frames, info.width_px, info.height_px);
    Ok(format!("{n} frames of {width_px} x {height_px} px, sha256 {}", hexadecimal(&hash.finalize())))
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::MemoryRecording;

    use super::*;

    #[test]
    fn a_pixel_and_a_time_count() {
        let frames = || vec![vec![1.0_f32; 12], vec![2.0; 12]];
        let usual = content_of_frames(&MemoryRecording::new(4, 8, frames())).unwrap();
        assert!(usual.starts_with("2 frames of 4 x 3 px"), "{usual}");
        let mut changed = frames();
        changed[1][11] = 2.5;
        assert_ne!(content_of_frames(&MemoryRecording::new(4, 8, changed)).unwrap(), usual);
        let mut later = MemoryRecording::new(4, 8, frames());
        later.info.times_s[1] += 1e-9;
        assert_ne!(content_of_frames(&later).unwrap(), usual);
    }
}
