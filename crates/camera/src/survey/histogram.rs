//! The histogram of counts, and at which count the sensor saturates.

use chainwave_measurement::Recording;

use super::frames::{spread, whole_frame};
use crate::error::CameraError;

/// A level holds this many times its darker neighbours' mean when the sensor, not the scene, put pixels there.
const SPIKE_RATIO: f64 = 10.0;
/// Darker neighbours that a possible spike is held against.
const N_NEIGHBOURS: usize = 8;

/// How many pixels of some frames have each count.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Pixels of each count, from 0 to the full scale of the recording's bit depth.
    pub n_pixels: Vec<u64>,
    /// The frames that were counted.
    pub frames: Vec<usize>,
}

/// Counts the pixels of at most `n_frames` frames, evenly spread over the recording.
///
/// # Errors
/// [`CameraError::Read`] when a frame cannot be read.
pub fn histogram(recording: &dyn Recording, n_frames: usize) -> Result<Histogram, CameraError> {
    let info = recording.info();
    let full_scale = (1_usize << info.bit_depth.min(16)) - 1;
    let mut n_pixels = vec![0; full_scale + 1];
    let frames = spread(n_frames, info.n_frames);
    for &frame in &frames {
        for count in whole_frame(recording, frame)? {
            n_pixels[(count as usize).min(full_scale)] += 1;
        }
    }
    Ok(Histogram { n_pixels, frames })
}

/// The count at which a sensor saturates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Saturation {
    /// That count.
    pub count: usize,
    /// Pixels there, which may have been brighter.
    pub n_pixels: u64,
}

impl Histogram {
    /// All pixels that were counted.
    pub fn total(&self) -> u64 {
        self.n_pixels.iter().sum()
    }

    /// The smallest count that at least `share` of the pixels do not exceed; 0 of no pixels.
    pub fn quantile(&self, share: f64) -> usize {
        let wanted = share * self.total() as f64;
        let mut n_below = 0;
        let reaches = |&n: &u64| {
            n_below += n;
            n_below as f64 >= wanted
        };
        self.n_pixels.iter().position(reaches).unwrap_or(0)
    }

    /// Pixels at count 0, which may have been darker.
    pub fn n_dark(&self) -> u64 {
        self.n_pixels.first().copied().unwrap_or(0)
    }

    /// Where the sensor saturates: at full scale, or at the highest count found when pixels pile up at it. `None` when neither
    /// holds.
    pub fn saturation(&self) -> Option<Saturation> {
        let highest = self.n_pixels.iter().rposition(|&n| n > 0)?;
        let n_highest = self.n_pixels[highest];
        let below = &self.n_pixels[highest.saturating_sub(N_NEIGHBOURS)..highest];
        let usual = below.iter().sum::<u64>() as f64 / below.len().max(1) as f64;
        let is_spike = highest > 0 && n_highest as f64 > SPIKE_RATIO * usual.max(1.0);
        (is_spike || highest + 1 == self.n_pixels.len())
            .then_some(Saturation { count: highest, n_pixels: n_highest })
    }

    /// The histogram in `n_bins` bins of equal width (the last may be narrower).
    pub fn binned(&self, n_bins: usize) -> Vec<u64> {
        let width = self.n_pixels.len().div_ceil(n_bins.max(1));
        self.n_pixels.chunks(width).map(|bin| bin.iter().sum()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(n_pixels: Vec<u64>) -> Histogram {
        Histogram { n_pixels, frames: vec![0] }
    }

    #[test]
    fn saturation_is_full_scale_or_a_spike_at_the_top() {
        assert_eq!(of(vec![3, 5, 2, 1]).saturation(), Some(Saturation { count: 3, n_pixels: 1 }));
        assert_eq!(of(vec![3, 5, 2, 1, 0, 0]).saturation(), None);
        assert_eq!(of(vec![3, 5, 2, 90, 0, 0]).saturation(), Some(Saturation { count: 3, n_pixels: 90 }));
        assert_eq!(of(vec![0; 4]).saturation(), None);
    }

    #[test]
    fn quantiles_and_bins_count_pixels() {
        let histogram = of(vec![10, 0, 20, 70, 0]);
        assert_eq!((histogram.total(), histogram.n_dark()), (100, 10));
        assert_eq!([0.05, 0.1, 0.3, 0.5, 1.0].map(|share| histogram.quantile(share)), [0, 0, 2, 3, 3]);
        assert_eq!(histogram.binned(2), [30, 70]);
        assert_eq!(histogram.binned(0), [100]);
    }
}
