//! The B-splines of degree 1, 3 and 5: pieces, poles, and what they do to white noise.
//!
//! M. Unser, A. Aldroubi, M. Eden: B-spline signal processing, IEEE Trans. Signal Process. 41 (1993) 821-848.

use std::sync::LazyLock;

use crate::Interpolation;

/// The polynomial pieces of the B-spline of degree `TAPS - 1`: entry `[power][tap]` is the coefficient of `t^power`
/// in the weight of the coefficient at `floor(x) - first_tap + tap`, where `t = x - floor(x)`. Taps beyond `TAPS`
/// have weight 0 and fill up a vector of `LANES`.
///
/// Weight of tap j: `1/n! sum_k (-1)^k C(n+1, k) (t + n - j - k)^n` over `k` from 0 to `n - j` (eq. 2.2 of the paper
/// above).
pub(crate) const fn pieces<const TAPS: usize, const LANES: usize>() -> [[f32; LANES]; TAPS] {
    let degree = TAPS - 1;
    let mut table = [[0.0; LANES]; TAPS];
    let mut power = 0;
    while power < TAPS {
        let mut tap = 0;
        while tap < TAPS {
            let mut sum = 0.0;
            let mut k = 0;
            while k + tap <= degree {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                let shift = (degree - tap - k) as f64;
                sum += sign
                    * binomial(degree + 1, k)
                    * binomial(degree, power)
                    * power_of(shift, degree - power);
                k += 1;
            }
            table[power][tap] = (sum / factorial(degree)) as f32;
            tap += 1;
        }
        power += 1;
    }
    table
}

const fn power_of(base: f64, exponent: usize) -> f64 {
    let mut result = 1.0;
    let mut i = 0;
    while i < exponent {
        result *= base;
        i += 1;
    }
    result
}

const fn factorial(n: usize) -> f64 {
    let mut result = 1.0;
    let mut i = 2;
    while i <= n {
        result *= i as f64;
        i += 1;
    }
    result
}

const fn binomial(n: usize, k: usize) -> f64 {
    factorial(n) / (factorial(k) * factorial(n - k))
}

impl Interpolation {
    /// Coefficients that carry weight along one axis.
    pub(crate) const fn n_taps(self) -> usize {
        match self {
            Self::Linear => 2,
            Self::Cubic => 4,
            Self::Quintic => 6,
        }
    }

    /// Taps before `floor(x)`.
    pub(crate) const fn taps_before(self) -> usize {
        self.n_taps() / 2 - 1
    }

    /// Taps after `floor(x)`.
    pub(crate) const fn taps_after(self) -> usize {
        self.n_taps() / 2
    }

    /// Poles of the recursive prefilter that lie within the unit circle (table I of the paper above).
    pub(crate) const fn poles(self) -> &'static [f64] {
        match self {
            Self::Linear => &[],
            Self::Cubic => &[-0.267_949_192_431_122_7],
            Self::Quintic => &[-0.430_575_347_099_973_8, -0.043_096_288_203_264_65],
        }
    }

    /// Pixels around the taps that keep the start of the recursion at a window's edge out of the subset.
    ///
    /// The start mirrors the image at the edge; its error decays with the largest pole z as `|z|^margin`, to 4e-4
    /// (cubic) and 5e-4 (quintic) of the kink that mirroring makes. Where the window ends with the frame there is no
    /// margin, and the mirrored image is the one interpolated.
    pub(crate) const fn prefilter_margin_px(self) -> usize {
        match self {
            Self::Linear => 0,
            Self::Cubic => 6,
            Self::Quintic => 9,
        }
    }

    /// The variance of a value interpolated at the phase `t` (in 0..1, the same along x and y for a product of two)
    /// in an image of white noise of unit variance, along one axis: the sum of squares of the cardinal spline at `t +
    /// k`.
    pub(crate) fn noise_gain(self, t: f64) -> f64 {
        let table = match self {
            Self::Linear => &*LINEAR_GAIN,
            Self::Cubic => &*CUBIC_GAIN,
            Self::Quintic => &*QUINTIC_GAIN,
        };
        let place = (t - t.floor()) * PHASES as f64;
        let below = (place as usize).min(PHASES - 1);
        table[below] + (place - below as f64) * (table[below + 1] - table[below])
    }
}

/// Phases at which the noise gain is tabulated.
const PHASES: usize = 64;
type GainTable = [f64; PHASES + 1];

static LINEAR_GAIN: LazyLock<GainTable> = LazyLock::new(|| gain_table::<2>(Interpolation::Linear));
static CUBIC_GAIN: LazyLock<GainTable> = LazyLock::new(|| gain_table::<4>(Interpolation::Cubic));
static QUINTIC_GAIN: LazyLock<GainTable> = LazyLock::new(|| gain_table::<6>(Interpolation::Quintic));

fn gain_table<const TAPS: usize>(interpolation: Interpolation) -> GainTable {
    const HALF: usize = 40; // 0.43^40 = 2e-15: the impulse response has died away
    let mut cardinal = [0.0; 2 * HALF + 1];
    cardinal[HALF] = 1.0;
    for &pole in interpolation.poles() {
        prefilter_line(&mut cardinal, pole);
    }
    let table = const { pieces::<TAPS, TAPS>() };
    std::array::from_fn(|phase| {
        let t = phase as f64 / PHASES as f64;
        let weight =
            |tap: usize| table.iter().rev().fold(0.0, |sum, powers| sum * t + f64::from(powers[tap]));
        let weights: [f64; TAPS] = std::array::from_fn(weight);
        cardinal.windows(TAPS).map(|c| c.iter().zip(weights).map(|(c, w)| c * w).sum::<f64>().powi(2)).sum()
    })
}

/// One pole of the prefilter along a line that starts and ends in zeros.
fn prefilter_line(line: &mut [f64], pole: f64) {
    let n = line.len();
    for i in 1..n {
        line[i] += pole * line[i - 1];
    }
    let gain = (1.0 - pole) * (1.0 - 1.0 / pole);
    let mut after = 0.0;
    for value in line.iter_mut().rev() {
        after = pole * (after - *value);
        *value = gain * after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_pieces_are_the_known_ones() {
        let table = pieces::<4, 4>();
        let expected =
            [[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]];
        for (found, expected) in table.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found - expected / 6.0).abs() < 1e-7, "one unit in the last place of f32");
        }
    }

    #[test]
    fn quintic_pieces_sum_to_one_and_start_with_the_samples_of_the_spline() {
        let table = pieces::<6, 8>();
        let at_pixel = [1.0, 26.0, 66.0, 26.0, 1.0, 0.0, 0.0, 0.0].map(|w: f32| w / 120.0);
        for (found, expected) in table[0].iter().zip(at_pixel) {
            assert!((found - expected).abs() < 1e-7);
        }
        for powers in &table[1..] {
            assert!(powers.iter().sum::<f32>().abs() < 1e-6, "the weights sum to 1 for every t");
        }
    }

    #[test]
    fn noise_passes_whole_at_a_pixel_and_less_between_two() {
        // Parseval: the mean over all frequencies of the squared response of interpolation half way between pixels.
        let mean_square = |response: fn(f64) -> f64| {
            let n = 1000;
            let frequency = |i: i32| std::f64::consts::PI * (f64::from(i) + 0.5) / f64::from(n);
            (0..n).map(|i| response(frequency(i)).powi(2)).sum::<f64>() / f64::from(n)
        };
        let linear = mean_square(|w| (w / 2.0).cos());
        let cubic = mean_square(|w| (23.0 * (w / 2.0).cos() + (1.5 * w).cos()) / 8.0 / (2.0 + w.cos()));
        for (interpolation, half) in [(Interpolation::Linear, linear), (Interpolation::Cubic, cubic)] {
            assert!((interpolation.noise_gain(0.0) - 1.0).abs() < 1e-6, "f32 pieces");
            assert!((interpolation.noise_gain(0.5) - half).abs() < 1e-6, "f32 pieces");
            assert!((interpolation.noise_gain(7.5) - half).abs() < 1e-6, "f32 pieces");
        }
        assert!(Interpolation::Quintic.noise_gain(0.5) > cubic);
    }
}
