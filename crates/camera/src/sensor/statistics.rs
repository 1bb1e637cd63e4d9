//! Mean and variance of every pixel over frames that show the same: dark frames, a flat field, a scene at rest.

use std::ops::Range;

use chainwave_measurement::{Recording, median};

use crate::error::CameraError;
use crate::survey::whole_frame;

/// Mean and variance over frames, pixel by pixel, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelStatistics {
    width_px: usize,
    height_px: usize,
    n_frames: usize,
    mean: Vec<f64>,
    /// Sums of squares about the mean.
    squares: Vec<f64>,
}

impl PixelStatistics {
    /// Of no frame yet.
    pub fn new(width_px: usize, height_px: usize) -> Self {
        let zeros = vec![0.0; width_px * height_px];
        Self { width_px, height_px, n_frames: 0, mean: zeros.clone(), squares: zeros }
    }

    /// Of some frames of a recording.
    ///
    /// # Errors
    /// [`CameraError::Read`] when a frame cannot be read, or is none of the recording's.
    pub fn of(recording: &dyn Recording, frames: Range<usize>) -> Result<Self, CameraError> {
        let mut statistics = Self::new(recording.info().width_px, recording.info().height_px);
        for frame in frames {
            statistics.add(&whole_frame(recording, frame)?);
        }
        Ok(statistics)
    }

    /// Takes a frame of [`width_px`](Self::width_px) times [`height_px`](Self::height_px) counts. The sums are updated about the
    /// running mean (Welford, 1962), so that nothing is lost to cancellation.
    pub fn add(&mut self, counts: &[f32]) {
        self.n_frames += 1;
        let n = self.n_frames as f64;
        for ((mean, squares), &count) in self.mean.iter_mut().zip(&mut self.squares).zip(counts) {
            let before = f64::from(count) - *mean;
            *mean += before / n;
            *squares += before * (f64::from(count) - *mean);
        }
    }

    /// Columns.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// Frames taken so far.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Mean count of every pixel; 0 of no frame.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Variance of a pixel's count from frame to frame, in counts squared; `None` of fewer than two frames.
    pub fn variance(&self, at: usize) -> Option<f64> {
        (self.n_frames > 1).then(|| self.squares[at] / (self.n_frames as f64 - 1.0))
    }

    /// Temporal noise of the usual pixel: the standard deviation of its count from frame to frame. `None` of fewer than two frames.
    ///
    /// It is told by the median over pixels, which defects and moving things do not move; the median of chi-squared is set
    /// against its mean (Wilson and Hilferty, 1931).
    pub fn noise_counts(&self) -> Option<f64> {
        let degrees_of_freedom = (self.n_frames > 1).then_some(self.n_frames as f64 - 1.0)?;
        let usual = median(self.squares.clone())?;
        let median_over_mean =
            if self.n_frames == 2 { CHI_SQUARED_1 } else { (1.0 - 2.0 / (9.0 * degrees_of_freedom)).powi(3) };
        Some((usual / degrees_of_freedom / median_over_mean).sqrt())
    }

    /// Number of pixels.
    pub(super) fn n_pixels(&self) -> usize {
        self.mean.len()
    }
}

/// Median of chi-squared with one degree of freedom, where the approximation above is off by 3 %.
const CHI_SQUARED_1: f64 = 0.454_936;
