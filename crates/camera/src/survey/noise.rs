//! Read noise and shot noise of a camera (photon transfer) from differences of consecutive frames.

use chainwave_measurement::{Estimate, Recording};

use super::frames::{spread, whole_frame};
use super::regression::{BORDER_PX, FREEDOM, NoiseBlock, Pair, SIDE_PX};
use crate::error::CameraError;

/// Blocks below which nothing is stated.
const LEAST_BLOCKS: usize = 40;
/// Blocks in a bin of brightness, and bins at most.
const BIN_BLOCKS: usize = 200;
const MOST_BINS: usize = 24;
/// A block counts as moving when motion explains more than this many times what noise would.
const MOVING_RATIO: f64 = 4.0;
/// Standard deviation of a median over that of a mean, of normal variates.
const MEDIAN_SPREAD: f64 = 1.2533;

/// A camera's noise: variance = `variance_at_zero + variance_per_count * count`, the sum of the read noise (with the
/// rounding to whole counts) and of the shot noise, which is proportional to light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseEstimate {
    /// Variance at count 0, in counts squared; a camera that adds an offset to its counts can make it negative.
    pub variance_at_zero: Estimate,
    /// Rise of the variance with the count, in counts: the counts that one photo-electron makes.
    pub variance_per_count: Estimate,
    /// Correlation of the errors of both.
    pub correlation: f64,
    /// Median brightness of the blocks, in counts.
    pub median_count: f64,
    /// Lowest and highest brightness that the estimate rests on, in counts.
    pub range_counts: (f64, f64),
    /// Blocks of pixels that the estimate rests on.
    pub n_blocks: usize,
    /// Share of the blocks that were left out because they moved.
    pub moving_share: f64,
}

impl NoiseEstimate {
    /// Standard deviation of a pixel's count at brightness `count`, in counts.
    pub fn sigma(&self, count: f64) -> f64 {
        (self.variance_at_zero.value + self.variance_per_count.value * count).max(0.0).sqrt()
    }
}

/// Estimates the noise from the differences of consecutive frames, of at most `n_pairs` pairs that are evenly spread
/// over the recording.
///
/// In blocks of 5x5 pixels, what motion and a change of brightness explain is taken out of the difference; blocks that move
/// are left out where enough others remain; a line through the medians in bins of brightness does the rest. What stays
/// fixed from frame to frame is no noise here.
///
/// # Errors
/// [`CameraError::Read`] when a frame cannot be read, and [`CameraError::TooLittle`] when there are too few frames or
/// too few pixels that are neither black nor saturated.
pub fn noise(recording: &dyn Recording, n_pairs: usize) -> Result<NoiseEstimate, CameraError> {
    let info = recording.info();
    let too_little = |what: &str, expected: String, found: usize| CameraError::TooLittle {
        path: recording.path().into(),
        what: what.into(),
        expected,
        found: found.to_string(),
    };
    if info.n_frames < 2 {
        return Err(too_little("frames for an estimate of the noise", "2 or more".into(), info.n_frames));
    }
    let full_scale = ((1_u64 << info.bit_depth.min(16)) - 1) as f32;
    let mut blocks = Vec::new();
    let frames = spread(n_pairs, info.n_frames - 1);
    // Neighbouring pairs that share a frame: their differences correlate by -1/2, and the squares of these by 1/4.
    let n_shared = frames.windows(2).filter(|pair| pair[1] == pair[0] + 1).count();
    let enlargement = (1.0 + 0.5 * n_shared as f64 / frames.len().max(1) as f64).sqrt();
    for frame in frames {
        let (first, second) = (whole_frame(recording, frame)?, whole_frame(recording, frame + 1)?);
        let pair = Pair { first: &first, second: &second, width_px: info.width_px };
        blocks.extend(usable_blocks(&pair, info.height_px, full_scale));
    }
    if blocks.len() < LEAST_BLOCKS {
        let what = "blocks of 5x5 px between black and full scale";
        return Err(too_little(what, format!("{LEAST_BLOCKS} or more"), blocks.len()));
    }
    Ok(fit(blocks, enlargement))
}

/// The blocks without black or saturated pixels.
fn usable_blocks(pair: &Pair, height_px: usize, full_scale: f32) -> Vec<NoiseBlock> {
    let starts = |size: usize| (BORDER_PX..(size + 1).saturating_sub(BORDER_PX + SIDE_PX)).step_by(SIDE_PX);
    let is_usable = |x: usize, y: usize| {
        (y..y + SIDE_PX).all(|row| {
            let start = row * pair.width_px + x;
            let both = [pair.first, pair.second].map(|frame| &frame[start..start + SIDE_PX]);
            both.iter().flat_map(|counts| counts.iter()).all(|&count| count > 0.0 && count < full_scale)
        })
    };
    let places = starts(height_px).flat_map(|y| starts(pair.width_px).map(move |x| (x, y)));
    places.filter(|&(x, y)| is_usable(x, y)).map(|(x, y)| pair.block(x, y)).collect()
}

/// The line through the medians in bins of brightness, of the blocks at rest when there are enough of them.
/// The noise of blocks, whose variances are known so many times worse than independent ones.
fn fit(mut blocks: Vec<NoiseBlock>, enlargement: f64) -> NoiseEstimate {
    blocks.sort_by(|a, b| a.level.total_cmp(&b.level));
    let n_all = blocks.len();
    let at_rest: Vec<bool> = bins(&blocks).flat_map(still_blocks).collect();
    let n_still = at_rest.iter().filter(|&&still| still).count();
    if n_still >= LEAST_BLOCKS {
        let mut still = at_rest.into_iter();
        blocks.retain(|_| still.next().unwrap_or(false));
    }
    let points: Vec<NoiseAtLevel> = bins(&blocks).map(|bin| NoiseAtLevel::of(bin, enlargement)).collect();
    let line = Line::through(&points);
    NoiseEstimate {
        variance_at_zero: Estimate::new(line.at_zero, line.at_zero_sigma),
        variance_per_count: Estimate::new(line.slope, line.slope_sigma),
        correlation: line.correlation,
        median_count: blocks[blocks.len() / 2].level,
        range_counts: (blocks[0].level, blocks[blocks.len() - 1].level),
        n_blocks: blocks.len(),
        moving_share: (n_all - blocks.len()) as f64 / n_all as f64,
    }
}

/// Blocks of like brightness, of a list that is sorted by it; at least two bins.
fn bins(blocks: &[NoiseBlock]) -> impl Iterator<Item = &[NoiseBlock]> {
    let n_bins = (blocks.len() / BIN_BLOCKS).clamp(2, MOST_BINS);
    let edge = move |bin: usize| bin * blocks.len() / n_bins;
    (0..n_bins).map(move |bin| &blocks[edge(bin)..edge(bin + 1)])
}

/// Which blocks of a bin are at rest: motion explains no more of them than noise would. What motion explains is
/// independent of the residual, so this choice does not favour blocks of little noise.
fn still_blocks(bin: &[NoiseBlock]) -> impl Iterator<Item = bool> {
    let most = MOVING_RATIO * 2.0 * median_residual(bin);
    bin.iter().map(move |block| block.motion <= most)
}

fn median_residual(bin: &[NoiseBlock]) -> f64 {
    let mut residuals: Vec<f64> = bin.iter().map(|block| block.residual).collect();
    residuals.sort_by(f64::total_cmp);
    residuals[residuals.len() / 2] / median_over_mean()
}

/// Median of chi-squared over its mean (Wilson and Hilferty, 1931).
fn median_over_mean() -> f64 {
    (1.0 - 2.0 / (9.0 * FREEDOM)).powi(3)
}

/// The noise at one brightness.
struct NoiseAtLevel {
    level: f64,
    /// Variance of one frame's counts, half that of the difference of two.
    variance: f64,
    /// Standard deviation of `variance` over `variance`.
    relative_sigma: f64,
}

impl NoiseAtLevel {
    fn of(bin: &[NoiseBlock], enlargement: f64) -> Self {
        let n = bin.len() as f64;
        Self {
            level: bin.iter().map(|block| block.level).sum::<f64>() / n,
            variance: median_residual(bin) / 2.0,
            relative_sigma: enlargement * MEDIAN_SPREAD * (2.0 / FREEDOM / n).sqrt(),
        }
    }
}

struct Line {
    at_zero: f64,
    slope: f64,
    at_zero_sigma: f64,
    slope_sigma: f64,
    correlation: f64,
}

impl Line {
    /// Weighted least squares; the weights follow the line itself, so that bins that came out low by chance do not weigh more.
    /// The uncertainty grows with the scatter about the line where that is larger than expected.
    fn through(points: &[NoiseAtLevel]) -> Self {
        let mean = points.iter().map(|point| point.variance).sum::<f64>() / points.len() as f64;
        // Frames that are copies of each other have no noise at all, and weights must stay finite.
        let least = (0.01 * mean).max(f64::MIN_POSITIVE.sqrt());
        let mut line =
            Self { at_zero: mean, slope: 0.0, at_zero_sigma: 0.0, slope_sigma: 0.0, correlation: 0.0 };
        for _ in 0..3 {
            line = line.improved(points, least);
        }
        line
    }

    fn improved(&self, points: &[NoiseAtLevel], least: f64) -> Self {
        let sigma = |point: &NoiseAtLevel| {
            (self.at_zero + self.slope * point.level).max(least) * point.relative_sigma
        };
        let weight = |point: &NoiseAtLevel| sigma(point).powi(-2);
        let sum = |value: fn(&NoiseAtLevel) -> f64| {
            points.iter().map(|point| weight(point) * value(point)).sum::<f64>()
        };
        let total = sum(|_| 1.0);
        let centre = sum(|point| point.level) / total;
        let height = sum(|point| point.variance) / total;
        let about = |point: &NoiseAtLevel| point.level - centre;
        let spread: f64 = points.iter().map(|point| weight(point) * about(point).powi(2)).sum();
        let rise: f64 =
            points.iter().map(|point| weight(point) * about(point) * (point.variance - height)).sum();
        if spread <= 0.0 {
            // All of one brightness: how the noise depends on it stays unknown.
            let unknown = f64::INFINITY;
            return Self {
                at_zero: height,
                slope: 0.0,
                at_zero_sigma: unknown,
                slope_sigma: unknown,
                correlation: -1.0,
            };
        }
        let slope = rise / spread;
        let excess = |point: &NoiseAtLevel| (point.variance - height - slope * about(point)) / sigma(point);
        let n_free = points.len().saturating_sub(2).max(1) as f64;
        let scatter = (points.iter().map(|point| excess(point).powi(2)).sum::<f64>() / n_free).max(1.0);
        let slope_variance = scatter / spread;
        let at_zero_variance = scatter / total + centre * centre * slope_variance;
        Self {
            at_zero: height - slope * centre,
            slope,
            at_zero_sigma: at_zero_variance.sqrt(),
            slope_sigma: slope_variance.sqrt(),
            correlation: -centre * slope_variance / (at_zero_variance * slope_variance).sqrt(),
        }
    }
}
