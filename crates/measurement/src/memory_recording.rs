//! Recordings that are no file: frames in memory, and some frames of another recording.

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::{ReadError, Recording, RecordingInfo, Region};

/// Frames in memory.
#[derive(Debug, Clone)]
pub struct MemoryRecording {
    /// What stands for the path in messages.
    pub path: PathBuf,
    /// What is said of the frames.
    pub info: RecordingInfo,
    /// The linear counts of each frame, row by row from the top.
    pub frames: Vec<Vec<f32>>,
}

impl MemoryRecording {
    /// Frames of `width_px` columns of counts of `bit_depth` bits; their times, in seconds, count them.
    pub fn new(width_px: usize, bit_depth: u32, frames: Vec<Vec<f32>>) -> Self {
        let info = RecordingInfo {
            format: "memory".into(),
            width_px,
            height_px: height_px(width_px, &frames),
            n_frames: frames.len(),
            bit_depth,
            rate_hz: None,
            times_s: counted(frames.len()),
            first_image: 0,
            camera: None,
            exposure_s: None,
            triggered_unix_s: None,
            warnings: Vec::new(),
        };
        Self { path: "memory".into(), info, frames }
    }

    /// Equal parts of frames of a recording, of `width_px` columns: what is said of them is what it says of itself, but for their size, and
    /// their times, which count them.
    pub fn cut_from(recording: &dyn Recording, width_px: usize, frames: Vec<Vec<f32>>) -> Self {
        let info = RecordingInfo {
            width_px,
            height_px: height_px(width_px, &frames),
            n_frames: frames.len(),
            times_s: counted(frames.len()),
            ..recording.info().clone()
        };
        Self { path: recording.path().into(), info, frames }
    }
}

fn height_px(width_px: usize, frames: &[Vec<f32>]) -> usize {
    frames.first().map_or(0, Vec::len) / width_px.max(1)
}

fn counted(n_frames: usize) -> Vec<f64> {
    (0..n_frames).map(|frame| frame as f64).collect()
}

impl Recording for MemoryRecording {
    fn path(&self) -> &Path {
        &self.path
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        let n_pixels = self.info.width_px * self.info.height_px;
        let whole = self.frames.get(frame).filter(|whole| whole.len() == n_pixels).ok_or_else(|| {
            let found = self.frames.get(frame).map_or(0, Vec::len);
            let reason = format!("expected {n_pixels} pixels in memory, found {found}");
            ReadError::Unreadable { path: self.path.clone(), frame, reason }
        })?;
        let rows = whole.chunks_exact(self.info.width_px.max(1)).skip(region.y);
        for (out, row) in pixels.chunks_exact_mut(region.width.max(1)).zip(rows) {
            out.copy_from_slice(&row[region.x..region.x + region.width]);
        }
        Ok(())
    }
}

/// Some frames of a recording, in any order.
#[derive(Clone)]
pub struct Excerpt<'a> {
    recording: &'a dyn Recording,
    info: RecordingInfo,
    frames: Vec<usize>,
}

impl<'a> Excerpt<'a> {
    /// These frames, by their numbers in the recording, with the times that they have there.
    pub fn new(recording: &'a dyn Recording, frames: Vec<usize>) -> Self {
        let all = recording.info();
        let times_s = frames.iter().filter_map(|&frame| all.times_s.get(frame).copied()).collect();
        Self { info: RecordingInfo { n_frames: frames.len(), times_s, ..all.clone() }, recording, frames }
    }
}

impl Recording for Excerpt<'_> {
    fn path(&self) -> &Path {
        self.recording.path()
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn is_sequential(&self) -> bool {
        self.recording.is_sequential()
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        for &frame in self.frames.get(frames).unwrap_or_default() {
            self.recording.will_read(frame..frame + 1, regions);
        }
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        self.recording.read_region(self.frames[frame], region, pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counting() -> MemoryRecording {
        let frame = |number: u16| (0..12).map(|i| f32::from(100 * number + i)).collect();
        MemoryRecording::new(4, 12, (0..3).map(frame).collect())
    }

    #[test]
    fn a_region_is_read_row_by_row() {
        let mut pixels = [0.0; 4];
        counting().read_region(1, Region { x: 2, y: 1, width: 2, height: 2 }, &mut pixels).unwrap();
        assert_eq!(pixels.map(f32::to_bits), [106.0_f32, 107.0, 110.0, 111.0].map(f32::to_bits));
    }

    #[test]
    fn an_excerpt_shows_the_frames_it_names() {
        let whole = counting();
        let excerpt = Excerpt::new(&whole, vec![2, 0]);
        let mut pixels = [0.0];
        excerpt.read_region(0, Region { x: 1, y: 0, width: 1, height: 1 }, &mut pixels).unwrap();
        assert_eq!((pixels, &excerpt.info().times_s), ([201.0], &vec![2.0, 0.0]));
        assert!(excerpt.read_region(2, Region::whole(1, 1), &mut pixels).is_err());
    }

    #[test]
    fn a_frame_of_another_size_is_named() {
        let mut recording = counting();
        recording.frames[1].pop();
        let error = recording.read_region(1, Region::whole(1, 1), &mut [0.0]).unwrap_err().to_string();
        assert!(error.contains("expected 12 pixels in memory, found 11"), "{error}");
    }
}
