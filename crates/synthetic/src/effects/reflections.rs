//! Still reflections: glare that adds light and dirt that takes some away, smooth and at rest in the picture.

use rand::RngExt;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::require;
use crate::seed::{Purpose, stream};

/// Glare and dirt on a window before the camera: light = (1 - dirt(x, y)) light + glare(x, y), both at least 0.
///
/// Each is its mean times the square of a smooth, nearly normal random field of variance 1, so its standard deviation is 1.4
/// to 1.6 times its mean, and it changes over distances of `size_px`: the field's own autocorrelation is
/// exp(-r^2/(4 size^2)).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reflections {
    /// Mean light that is added, as a fraction of the range from black to white.
    #[serde(default)]
    pub glare: f64,
    /// Mean share of the light that is taken away (never more than all).
    #[serde(default)]
    pub dirt: f64,
    /// Size of the pattern, in pixels.
    pub size_px: f64,
    /// Whether each view has a pattern of its own; else all recordings share one.
    #[serde(default)]
    pub per_view: bool,
}

impl Reflections {
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        for (name, mean) in
            [("camera.effects.reflections.glare", self.glare), ("camera.effects.reflections.dirt", self.dirt)]
        {
            require((0.0..=0.5).contains(&mean), name, "0 to 0.5", mean)?;
        }
        let size = self.size_px >= 2.0 && self.size_px <= 1.0e4;
        require(size, "camera.effects.reflections.size_px", "2 to 10000 pixels", self.size_px)
    }
}

/// What a window does to each pixel of a frame, row by row from the top.
pub(crate) struct ReflectionMap {
    glare: Vec<f32>,
    passed: Vec<f32>,
}

/// Standard deviations after which a blot of the field is left out: exp(-12.5) of it.
const REACH_SIGMA: f64 = 5.0;

/// Streams of the two patterns.
const GLARE: u64 = 0;
const DIRT: u64 = 1;

impl ReflectionMap {
    pub(crate) fn new(seed: u64, view: u64, settings: &Reflections, size_px: [usize; 2]) -> Self {
        let view = if settings.per_view { view } else { 0 };
        let squares = |which: u64, mean: f64| -> Vec<f64> {
            if mean <= 0.0 {
                return vec![0.0; size_px[0] * size_px[1]];
            }
            let field = smooth_field(seed, view << 1 | which, settings.size_px, size_px);
            field.into_iter().map(|value| mean * value * value).collect()
        };
        let glare = squares(GLARE, settings.glare).into_iter().map(|light| light as f32).collect();
        let passed = squares(DIRT, settings.dirt).into_iter().map(|loss| (1.0 - loss).max(0.0) as f32);
        Self { glare, passed: passed.collect() }
    }

    /// Lays the reflections over a frame's tones, from the pixel `first` on.
    pub(crate) fn apply(&self, tones: &mut [f32], first: usize) {
        for ((tone, glare), passed) in tones.iter_mut().zip(&self.glare[first..]).zip(&self.passed[first..]) {
            *tone = *tone * passed + glare;
        }
    }
}

/// A random field of mean 0 and variance 1: blots exp(-r^2/(2 size^2)) of normal height, one at random in each square
/// cell with sides of `blot_px`, the blots' size. A point's variance over the draws is the sum over cells of the mean square
/// of a blot, pi height^2, wherever it lies; given the blots' places the field is normal.
fn smooth_field(seed: u64, counter: u64, blot_px: f64, [width_px, height_px]: [usize; 2]) -> Vec<f64> {
    let mut random = stream(Purpose::Reflections, seed, counter);
    let height = 1.0 / std::f64::consts::PI.sqrt();
    let margin = REACH_SIGMA.ceil() as i64;
    let cells = |size_px: usize| -margin..(size_px as f64 / blot_px).ceil() as i64 + margin;
    let mut field = vec![0.0; width_px * height_px];
    for cell_row in cells(height_px) {
        for cell_column in cells(width_px) {
            let x_px = (cell_column as f64 + random.random::<f64>()) * blot_px;
            let y_px = (cell_row as f64 + random.random::<f64>()) * blot_px;
            let height = height * random.sample::<f64, _>(StandardNormal);
            let reached = |at_px: f64, limit: usize| {
                let inside = |edge_px: f64| edge_px.ceil().clamp(0.0, limit as f64) as usize;
                inside(at_px - REACH_SIGMA * blot_px)..inside(at_px + REACH_SIGMA * blot_px)
            };
            let profile = |apart_px: f64| libm::exp(-0.5 * (apart_px / blot_px).powi(2));
            let columns = reached(x_px, width_px);
            let along_x: Vec<f64> = columns.clone().map(|column| profile(column as f64 - x_px)).collect();
            for row in reached(y_px, height_px) {
                let along_y = height * profile(row as f64 - y_px);
                let values = &mut field[row * width_px..][columns.clone()];
                values.iter_mut().zip(&along_x).for_each(|(value, along_x)| *value += along_y * along_x);
            }
        }
    }
    field
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Reflections = Reflections { glare: 0.06, dirt: 0.03, size_px: 6.0, per_view: false };
    const SIZE_PX: [usize; 2] = [16, 10];

    /// Most that the blots' places change a pixel's variance V about its mean of 1: one blot in each unit cell adds a variance of
    /// at most its mean square of exp(-r^2)/pi, together 1/(2 pi).
    const PLACES: f64 = 0.16;

    /// Draws of the field.
    const N: f64 = 10_000.0;

    /// Glare and dirt of every pixel.
    fn patterns(seed: u64, view: u64, settings: &Reflections) -> [Vec<f64>; 2] {
        let map = ReflectionMap::new(seed, view, settings, SIZE_PX);
        let at = |tone: f32| {
            let mut tones = vec![tone; SIZE_PX[0] * SIZE_PX[1]];
            map.apply(&mut tones, 0);
            tones
        };
        let (dark, bright) = (at(0.0), at(1.0));
        let dirt = bright.iter().zip(&dark).map(|(bright, dark)| f64::from(1.0 - (bright - dark))).collect();
        [dark.into_iter().map(f64::from).collect(), dirt]
    }

    #[test]
    fn a_pixels_glare_and_dirt_have_the_stated_mean_and_spread() {
        let pixel = 4 * SIZE_PX[0] + 11;
        let mut samples = [Vec::new(), Vec::new()];
        for seed in 0..N as u64 {
            let drawn = patterns(seed, 1, &SETTINGS);
            samples.iter_mut().zip(&drawn).for_each(|(samples, drawn)| samples.push(drawn[pixel]));
        }
        for (samples, mean) in samples.iter().zip([0.06, 0.03]) {
            let found = samples.iter().sum::<f64>() / N / mean;
            let variance = samples.iter().map(|value| (value / mean - found).powi(2)).sum::<f64>() / N;
            // The square of the field f has the variance 3 E V^2 - 1, from 2 to 2 + 3 PLACES; 4.5 standard errors of its mean.
            assert!((found - 1.0).abs() < 4.5 * ((2.0 + 3.0 * PLACES) / N).sqrt(), "{found}");
            // The fourth central moment of a squared normal number is 60, and E V^4, about 1 + 6 PLACES, times that here.
            let error = 4.5 * (60.0 * (1.0 + 6.0 * PLACES) / N).sqrt();
            assert!(variance > 2.0 - error && variance < 2.0 + 3.0 * PLACES + error, "{variance}");
            assert!(samples.iter().all(|value| *value >= -1.0e-7)); // single precision
        }
    }

    #[test]
    fn neighbours_are_alike_as_the_size_says() {
        let apart_px = 6;
        let pixel = 5 * SIZE_PX[0] + 5;
        let (mut products, mut squares) = (0.0, 0.0);
        for seed in 0..N as u64 {
            let field = smooth_field(seed, 0, 6.0, SIZE_PX);
            products += field[pixel] * field[pixel + apart_px];
            squares += field[pixel] * field[pixel];
        }
        // exp(-r^2/(4 size^2)) a size apart. The regression's residual has a variance below 1, times E V^2 at most: 4.5
        // standard errors.
        let slope = products / squares;
        assert!((slope - libm::exp(-0.25)).abs() < 4.5 * ((1.0 + PLACES) / N).sqrt(), "{slope}");
    }

    #[test]
    fn views_share_the_pattern_unless_they_have_their_own() {
        let own = Reflections { per_view: true, ..SETTINGS };
        assert_eq!(patterns(1, 1, &SETTINGS), patterns(1, 2, &SETTINGS));
        assert_ne!(patterns(1, 1, &own), patterns(1, 2, &own));
        assert_ne!(patterns(1, 1, &SETTINGS), patterns(2, 1, &SETTINGS));
    }
}
