//! What each pixel of the sensor does of its own: offset and gain (fixed pattern noise), hot and dead pixels.

use rand::RngExt;
use rand_distr::{Exp1, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::{require, require_share};
use crate::seed::{Purpose, stream};

/// Fixed pattern noise: standard deviations of normal numbers, the same in every recording of the camera. Offsets (dark
/// signal non-uniformity) are fractions of the range from black to white, gains (photo response non-uniformity) factors 1 + g.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FixedPattern {
    /// Of a pixel's offset.
    pub offset_sigma: f64,
    /// Standard deviation of the Gaussian over which offsets of neighbours are alike, in pixels; 0 where each is for itself.
    pub offset_grain_px: f64,
    /// Of a pixel's relative gain.
    pub gain_sigma: f64,
    /// Of an offset that all pixels of a row have in common.
    pub row_offset_sigma: f64,
    /// Of an offset that all pixels of a column have in common.
    pub column_offset_sigma: f64,
}

/// Pixels that do not work, the same in every recording of the camera.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DefectivePixels {
    /// Share of the pixels that are hot: too bright by an offset that the light does not change.
    pub hot_fraction: f64,
    /// Mean of a hot pixel's offset as a fraction of the range from black to white; exponentially distributed, as dark
    /// currents' tails are.
    pub hot_offset_mean: f64,
    /// Share of the pixels that are dead: black whatever the light.
    pub dead_fraction: f64,
}

/// A hot pixel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HotPixel {
    /// Its column, from 0.
    pub column: usize,
    /// Its row, from 0.
    pub row: usize,
    /// How much too bright it is, as a fraction of the range from black to white.
    pub offset: f64,
}

impl FixedPattern {
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        for (name, sigma) in [
            ("camera.effects.fixed_pattern.offset_sigma", self.offset_sigma),
            ("camera.effects.fixed_pattern.gain_sigma", self.gain_sigma),
            ("camera.effects.fixed_pattern.row_offset_sigma", self.row_offset_sigma),
            ("camera.effects.fixed_pattern.column_offset_sigma", self.column_offset_sigma),
        ] {
            require((0.0..=0.2).contains(&sigma), name, "0 to 0.2", sigma)?;
        }
        let (name, grain_px) = ("camera.effects.fixed_pattern.offset_grain_px", self.offset_grain_px);
        require((0.0..=MOST_GRAIN_PX).contains(&grain_px), name, "0 to 50 pixels", grain_px)
    }
}

impl DefectivePixels {
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        require_share("camera.effects.defective_pixels.hot_fraction", self.hot_fraction)?;
        require_share("camera.effects.defective_pixels.hot_offset_mean", self.hot_offset_mean)?;
        require_share("camera.effects.defective_pixels.dead_fraction", self.dead_fraction)
    }
}

/// Offset and gain of each pixel of a frame, row by row from the top.
pub(crate) struct SensorMap {
    /// Fractions of the range from black to white.
    offsets: Vec<f32>,
    /// Relative deviations from 1; -1 where a pixel is dead.
    gains: Vec<f32>,
    pub(crate) hot: Vec<HotPixel>,
    /// (Column, row) of each dead pixel.
    pub(crate) dead: Vec<[usize; 2]>,
}

/// A pattern of a coarser grain is a gradient of the light.
const MOST_GRAIN_PX: f64 = 50.0;

/// Streams of the fixed pattern.
const OFFSET: u64 = 0;
const GAIN: u64 = 1;
const ROW: u64 = 2;
const COLUMN: u64 = 3;

impl SensorMap {
    /// The sensor of a seed, `width_px` pixels wide.
    pub(crate) fn new(
        seed: u64,
        pattern: Option<&FixedPattern>,
        defects: Option<&DefectivePixels>,
        [width_px, height_px]: [usize; 2],
    ) -> Self {
        let n_pixels = width_px * height_px;
        let FixedPattern { offset_sigma, offset_grain_px, gain_sigma, row_offset_sigma, column_offset_sigma } =
            pattern.copied().unwrap_or_default();
        let normal = |which: u64, n: usize, sigma: f64| -> Vec<f64> {
            if sigma <= 0.0 {
                return vec![0.0; n];
            }
            let mut random = stream(Purpose::FixedPattern, seed, which);
            (0..n).map(|_| sigma * random.sample::<f64, _>(StandardNormal)).collect()
        };
        let pixels = grained(normal(OFFSET, n_pixels, offset_sigma), width_px, offset_grain_px);
        let rows = normal(ROW, height_px, row_offset_sigma);
        let columns = normal(COLUMN, width_px, column_offset_sigma);
        let offset = |(pixel, offset): (usize, &f64)| {
            (offset + rows[pixel / width_px] + columns[pixel % width_px]) as f32
        };
        let mut map = Self {
            offsets: pixels.iter().enumerate().map(offset).collect(),
            gains: normal(GAIN, n_pixels, gain_sigma).into_iter().map(|gain| gain as f32).collect(),
            hot: Vec::new(),
            dead: Vec::new(),
        };
        if let Some(defects) = defects {
            map.add(defects, seed, width_px);
        }
        map
    }

    fn add(&mut self, defects: &DefectivePixels, seed: u64, width_px: usize) {
        let mut random = stream(Purpose::Defects, seed, 0);
        for pixel in 0..self.offsets.len() {
            // Each pixel draws as many numbers, so that no defect moves the others.
            let (fate, darkness): (f64, f64) = (random.random(), random.sample(Exp1));
            let [column, row] = [pixel % width_px, pixel / width_px];
            if fate < defects.hot_fraction {
                let offset = defects.hot_offset_mean * darkness;
                self.offsets[pixel] += offset as f32;
                self.hot.push(HotPixel { column, row, offset });
            } else if 1.0 - fate <= defects.dead_fraction {
                (self.offsets[pixel], self.gains[pixel]) = (0.0, -1.0);
                self.dead.push([column, row]);
            }
        }
    }

    /// Lays offsets and gains over expected counts, given the counts of black and of the range above it.
    pub(crate) fn apply(&self, counts: &mut [f32], black: f32, range: f32) {
        for ((count, offset), gain) in counts.iter_mut().zip(&self.offsets).zip(&self.gains) {
            *count += offset * range + gain * (*count - black);
        }
    }

    /// Root mean squares over all pixels: of the offsets (fractions of the range) and of the relative gains.
    pub(crate) fn rms(&self) -> [f64; 2] {
        [&self.offsets, &self.gains].map(|values| {
            let squares = values.iter().map(|&value| f64::from(value).powi(2)).sum::<f64>();
            (squares / values.len() as f64).sqrt()
        })
    }
}

/// White noise, row by row, with what a Gaussian makes of it: alike over its standard deviation, of the same variance. Pictures repeat beyond their
/// edges.
fn grained(mut pixels: Vec<f64>, width_px: usize, grain_px: f64) -> Vec<f64> {
    if grain_px <= 0.0 {
        return pixels;
    }
    let height_px = pixels.len() / width_px;
    for (n, stride, n_lines, to_next) in
        [(width_px, 1, height_px, width_px), (height_px, width_px, width_px, 1)]
    {
        let weights: Vec<f64> =
            (0..n).map(|k| (-0.5 * (k.min(n - k) as f64 / grain_px).powi(2)).exp()).collect();
        let norm = weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt();
        for line in 0..n_lines {
            let place = |k: usize| line * to_next + k % n * stride;
            let before: Vec<f64> = (0..n).map(|k| pixels[place(k)]).collect();
            for k in 0..n {
                let sum: f64 =
                    weights.iter().enumerate().map(|(lag, weight)| weight * before[(k + lag) % n]).sum();
                pixels[place(k)] = sum / norm;
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE_PX: [usize; 2] = [500, 400];
    const N: f64 = 200_000.0;

    /// What a flat field of the tone shows, less the tone, in fractions of the range.
    fn deviations(map: &SensorMap, tone: f32) -> Vec<f64> {
        let (black, range) = (64.0, 4000.0);
        let mut counts = vec![black + range * tone; SIZE_PX[0] * SIZE_PX[1]];
        map.apply(&mut counts, black, range);
        counts.iter().map(|count| f64::from((count - black) / range - tone)).collect()
    }

    fn mean_and_variance(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64)
    }

    #[test]
    fn a_grain_keeps_the_variance_and_makes_neighbours_alike() {
        let grain_px = 2.0;
        let pattern =
            FixedPattern { offset_sigma: 0.001, offset_grain_px: grain_px, ..FixedPattern::default() };
        let map = SensorMap::new(3, Some(&pattern), None, SIZE_PX);
        let found = deviations(&map, 0.5);
        let at_lag = |lag: usize| {
            let product = |row: &[f64]| row.iter().zip(&row[lag..]).map(|(a, b)| a * b).sum::<f64>();
            found.chunks(SIZE_PX[0]).map(product).sum::<f64>() / ((SIZE_PX[0] - lag) * SIZE_PX[1]) as f64
        };
        // A Gaussian of white noise has the autocovariance exp(-lag^2 / (4 grain^2)); about 4 pi grain^2 pixels are one, so 4.5 standard errors
        // of each are 4.5 sqrt(2 * 4 pi grain^2 / N) at most.
        let bound = 4.5 * (8.0 * std::f64::consts::PI * grain_px.powi(2) / N).sqrt();
        for lag in [0_usize, 1, 2, 4] {
            let expected = (-(lag as f64).powi(2) / (4.0 * grain_px * grain_px)).exp();
            assert!((at_lag(lag) / 1e-6 - expected).abs() < bound, "{lag}: {}", at_lag(lag));
        }
    }

    #[test]
    fn offset_and_gain_have_the_stated_variance() {
        let pattern = FixedPattern { offset_sigma: 0.001, gain_sigma: 0.003, ..FixedPattern::default() };
        let map = SensorMap::new(3, Some(&pattern), None, SIZE_PX);
        for tone in [0.0_f32, 0.5, 0.9] {
            let law = 0.001_f64.powi(2) + (0.003 * f64::from(tone)).powi(2);
            let (mean, variance) = mean_and_variance(&deviations(&map, tone));
            // Chi squared of 199 999 normal numbers: standard errors sqrt(law/n) and law sqrt(2/n); 4.5 of them. (Single
            // precision rounds at 1e-4 of a count, 1e-5 of the law.)
            assert!(mean.abs() < 4.5 * (law / N).sqrt(), "{tone}: {mean}");
            assert!((variance / law - 1.0).abs() < 4.5 * (2.0 / N).sqrt(), "{tone}: {variance} {law}");
        }
    }

    #[test]
    fn rows_and_columns_have_offsets_of_their_own() {
        let pattern =
            FixedPattern { row_offset_sigma: 0.002, column_offset_sigma: 0.004, ..FixedPattern::default() };
        let map = SensorMap::new(3, Some(&pattern), None, SIZE_PX);
        let dark = deviations(&map, 0.0);
        let at = |column: usize, row: usize| dark[row * SIZE_PX[0] + column];
        let rows: Vec<f64> = (0..SIZE_PX[1]).map(|row| at(0, row)).collect();
        let columns: Vec<f64> = (0..SIZE_PX[0]).map(|column| at(column, 0)).collect();
        for (values, sigma) in [(rows, 0.002_f64), (columns, 0.004)] {
            let n = values.len() as f64;
            let (_, variance) = mean_and_variance(&values);
            // Chi squared of n - 1: 4.5 standard errors, sqrt(2/n).
            assert!((variance / (sigma * sigma) - 1.0).abs() < 4.5 * (2.0 / n).sqrt(), "{variance}");
        }
        // A row's and a column's offset add: a rectangle's corners cancel but for single precision.
        assert!((at(3, 5) + at(100, 200) - at(3, 200) - at(100, 5)).abs() < 1.0e-6);
    }

    #[test]
    fn hot_and_dead_pixels_are_as_many_and_as_bright_as_stated() {
        let defects = DefectivePixels { hot_fraction: 0.01, hot_offset_mean: 0.1, dead_fraction: 0.004 };
        let map = SensorMap::new(9, None, Some(&defects), SIZE_PX);
        let (n_hot, n_dead) = (map.hot.len() as f64, map.dead.len() as f64);
        // Binomial: 4.5 standard errors.
        assert!((n_hot - 0.01 * N).abs() < 4.5 * (0.01 * 0.99 * N).sqrt(), "{n_hot}");
        assert!((n_dead - 0.004 * N).abs() < 4.5 * (0.004 * 0.996 * N).sqrt(), "{n_dead}");
        let mean = map.hot.iter().map(|pixel| pixel.offset).sum::<f64>() / n_hot;
        // An exponential's deviation is its mean.
        assert!((mean / 0.1 - 1.0).abs() < 4.5 / n_hot.sqrt(), "{mean}");
        let seen = deviations(&map, 0.5);
        for HotPixel { column, row, offset } in &map.hot {
            assert!((seen[row * SIZE_PX[0] + column] - offset).abs() < 1.0e-6); // single precision
        }
        for [column, row] in &map.dead {
            assert!((seen[row * SIZE_PX[0] + column] + 0.5).abs() < 1.0e-6);
        }
        let touched = seen.iter().filter(|seen| seen.abs() > 1.0e-6).count();
        // Of the hot ones, a share of 1e-6/0.1 is brighter by less.
        assert!(map.hot.len() + map.dead.len() - touched <= 2);
    }

    #[test]
    fn a_sensor_follows_from_its_seed_and_each_effect_stands_alone() {
        let pattern = FixedPattern { offset_sigma: 0.001, gain_sigma: 0.003, ..FixedPattern::default() };
        let with_rows = FixedPattern { row_offset_sigma: 0.01, ..pattern };
        let map = |seed, pattern| deviations(&SensorMap::new(seed, Some(pattern), None, SIZE_PX), 0.3);
        assert_eq!(map(1, &pattern), map(1, &pattern));
        assert_ne!(map(1, &pattern), map(2, &pattern));
        let rows = FixedPattern { row_offset_sigma: 0.01, ..FixedPattern::default() };
        for ((both, one), other) in map(1, &with_rows).iter().zip(map(1, &pattern)).zip(map(1, &rows)) {
            assert!((both - one - other).abs() < 1.0e-6); // single precision
        }
    }
}
