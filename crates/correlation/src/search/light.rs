//! How bright a subset is, which a small one tells from something else where its pattern of few speckles does not.

use crate::PreparedSubset;
use crate::search::chance::{n_independent, share_told};

/// Grey values of a subset in a frame: the mean, in counts, and how many times the contrast of the reference it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Light {
    pub(crate) mean: f64,
    pub(crate) gain: f64,
}

impl Light {
    /// That of the reference.
    pub(crate) fn of(subset: &PreparedSubset) -> Self {
        Self { mean: subset.mean, gain: 1.0 }
    }

    /// The mean of what was seen so often and this.
    pub(crate) fn averaged(self, other: Self, n: f64) -> Self {
        let toward = |from: f64, to: f64| from + (to - from) / n;
        Self { mean: toward(self.mean, other.mean), gain: toward(self.gain, other.gain) }
    }
}

/// The probability that something unrelated is as the subset should be in this light, grey value by grey value, by as much as a match is that
/// had so many parameters of its place chosen and these: a pattern of five speckles resembles another one but for mean and contrast once in a
/// few thousand cases, and with them once in a million.
///
/// Of n independent grey values of variance s^2, those of something else lie within a mean square e^2 of given ones with the probability of
/// the ball about these, whose squares are about n s^2: `(n e^2 / 2 s^2)^(n/2) exp(-n/2) / Gamma(n/2 + 1)`, which is
/// `(e / s)^n / sqrt(pi n)` by Stirling's formula. e^2 is what the match left, and what its light differs by.
pub(crate) fn chance_in_light(
    subset: &PreparedSubset,
    n_parameters: usize,
    zncc: f64,
    [expected, found]: [Light; 2],
) -> f64 {
    let contrast = subset.signal_energy / subset.n_used as f64;
    let gain = found.gain / expected.gain;
    let left = contrast * (zncc.powi(-2) - 1.0) * gain.powi(2);
    let by_light = contrast * (gain - 1.0).powi(2) + ((found.mean - expected.mean) / expected.gain).powi(2);
    let of_something_else = contrast + subset.noise_variance * subset.n_averaged;
    let n = (n_independent(subset) * share_told(subset) - n_parameters as f64).max(1.0);
    let share = ((left + by_light) / of_something_else).min(1.0);
    share.powf(0.5 * n) / (std::f64::consts::PI * n).sqrt()
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::{Region, Subset};
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::warp::Warp;
    use crate::{Interpolation, Reference, Settings, Window, Workspace};

    const SIZE_PX: usize = 240;

    /// Spots of 4.5 px at random.
    fn speckle(seed: u64) -> Vec<f32> {
        const RADIUS_PX: f64 = 1.35;
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut pixels = vec![200.0; SIZE_PX * SIZE_PX];
        let n_spots = SIZE_PX * SIZE_PX / 12;
        for _ in 0..n_spots {
            let [x, y]: [f64; 2] = [0, 1].map(|_| random.random_range(0.0..SIZE_PX as f64));
            let around = |at: f64| (at as usize).saturating_sub(6)..(at as usize + 7).min(SIZE_PX);
            for row in around(y) {
                for column in around(x) {
                    let square = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                    pixels[row * SIZE_PX + column] +=
                        (1000.0 * (-0.5 * square / RADIUS_PX.powi(2)).exp()) as f32;
                }
            }
        }
        pixels
    }

    #[test]
    fn something_else_is_as_bright_grey_value_by_grey_value_as_rarely_as_is_said() {
        let region = Region::whole(SIZE_PX, SIZE_PX);
        let settings = Settings { interpolation: Interpolation::Cubic, ..Settings::default() };
        let reference = Reference::new(region, speckle(1), 1).unwrap();
        let mut workspace = Workspace::default();
        for half_px in [5, 8] {
            let places =
                (1..14).flat_map(|j| (1..14).map(move |i| [17.0 * f64::from(i), 17.0 * f64::from(j)]));
            let prepared = |[x, y]: [f64; 2]| {
                PreparedSubset::new(&reference, &Subset::new("a", x, y, half_px, half_px), &settings).ok()
            };
            let subsets: Vec<PreparedSubset> = places.filter_map(prepared).collect();
            let mut chances = Vec::new();
            for seed in 2..62 {
                let window = Window::new(region, &speckle(seed), settings.interpolation).unwrap();
                for subset in &subsets {
                    let at = Warp::at(subset.centre_px);
                    let unlike = subset.evaluate(&window, &at, &mut workspace).map_or(1.0, |found| {
                        let light = Light { mean: found.mean + f64::from(window.level), gain: found.gain };
                        chance_in_light(subset, 0, found.zncc, [Light::of(subset), light])
                    });
                    chances.push(unlike);
                }
            }
            let n = chances.len() as f64;
            for p in [1e-1, 1e-2, 1e-3] {
                let n_below = chances.iter().filter(|&&chance| chance < p).count() as f64;
                // three standard deviations of a count
                assert!(
                    n_below <= n * p + 3.0 * (n * p).sqrt(),
                    "half a side of {half_px} px: {n_below} of {n} below {p}"
                );
            }
        }
    }
}
