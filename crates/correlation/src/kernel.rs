//! The interpolation kernels: B-splines and MOMS, their poles, and what they do to white noise.
//!
//! A kernel of degree n is the B-spline of that degree plus multiples of its even derivatives: a MOMS, which reproduces
//! every polynomial of degree n as the B-spline does, at the same cost (T. Blu, P. Thevenaz, M. Unser: MOMS, IEEE
//! Trans. Image Process. 10 (2001) 1069-1080). That paper chooses the multiples for the least error of the image. A
//! displacement is blind to most of that error: it sees only the part that is odd under a mirroring of the image.
//! With the kernel's spectrum `sinc^(n+1) P(w)`, the spectrum's first alias at 2 pi turns a component of low frequency
//! w into an odd error of order `w^(n+2)`, proportional to the derivative of `P(w)/w^(n+1)` at `w = 2 pi`. For degree
//! 3 that is zero where the multiple of the second derivative is `1/(2 pi^2)`; 1/18 does as well over the frequencies
//! that speckles have, and puts the pole at -1/2. For degree 5 the multiples 11/200 and 1/2000 were found in the same
//! way by a search over speckles of 3.5 to 6 px.
//!
//! Bias over phases by the spectrum of Gaussian speckle whose autocorrelation is 3.7, 4.5 and 6.3 px wide at half
//! height, peak to peak (in the manner of Y. Su et al., Opt. Express 23 (2015) 19242-19260):
//! cubic B-spline 4.9, 2.0, 0.49 mpx; cubic o-MOMS 3.4, 1.3, 0.29; cubic here 1.2, 0.28, 0.07; quintic B-spline 0.83,
//! 0.20, 0.02; quintic o-MOMS 0.49, 0.10, 0.01; septic B-spline 0.21, 0.03, 0.001; quintic here 0.21, 0.02, 0.002.

use std::sync::LazyLock;

use pulp::Simd;

use crate::Interpolation;

/// A kernel of `TAPS` coefficients along one axis.
pub(crate) trait Kernel<const TAPS: usize> {
    /// Multiples of the B-spline's second and fourth derivative that are added to it.
    const DERIVATIVES: [f64; 2];

    /// The weights of the taps.
    const WEIGHTS: Weights = Weights::new(&pieces::<TAPS>(Self::DERIVATIVES));
}

/// The B-spline of degree `TAPS - 1`.
pub(crate) struct BSpline;
/// The MOMS of degree `TAPS - 1` with little bias.
pub(crate) struct Moms;

impl<const TAPS: usize> Kernel<TAPS> for BSpline {
    const DERIVATIVES: [f64; 2] = [0.0; 2];
}

impl Kernel<4> for Moms {
    const DERIVATIVES: [f64; 2] = [1.0 / 18.0, 0.0];
}

impl Kernel<6> for Moms {
    const DERIVATIVES: [f64; 2] = [11.0 / 200.0, 1.0 / 2000.0];
}

/// Half of the most taps.
const MAX_HALF: usize = 3;

/// The weights of the taps at the fraction t of a pixel as polynomials in `s = t - 1/2`. The tap j and its mirror
/// image are `even[j](s^2) + s odd[j](s^2)` and the same with a minus, so one evaluation gives both.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weights {
    even: [[f32; MAX_HALF]; MAX_HALF],
    odd: [[f32; MAX_HALF]; MAX_HALF],
}

impl Weights {
    const fn new<const TAPS: usize>(pieces: &[[f64; TAPS]; TAPS]) -> Self {
        let mut even = [[0.0; MAX_HALF]; MAX_HALF];
        let mut odd = [[0.0; MAX_HALF]; MAX_HALF];
        let mut tap = 0;
        while 2 * tap < TAPS {
            let mut order = 0;
            while order < TAPS {
                let mut coefficient = 0.0;
                let mut power = order;
                while power < TAPS {
                    coefficient += pieces[tap][power] * binomial(power, order) * power_of(0.5, power - order);
                    power += 1;
                }
                let to = if order % 2 == 0 { &mut even[tap] } else { &mut odd[tap] };
                to[order / 2] = coefficient as f32;
                order += 1;
            }
            tap += 1;
        }
        Self { even, odd }
    }

    /// The weights of the taps at a fraction of a pixel.
    #[inline(always)]
    pub(crate) fn at<const TAPS: usize>(&self, t: f32) -> [f32; TAPS] {
        let half = TAPS / 2;
        let s = t - 0.5;
        let square = s * s;
        let mut weights = [0.0; TAPS];
        for tap in 0..half {
            let (mut even, mut odd) = (self.even[tap][half - 1], self.odd[tap][half - 1]);
            for power in (0..half - 1).rev() {
                even = even.mul_add(square, self.even[tap][power]);
                odd = odd.mul_add(square, self.odd[tap][power]);
            }
            weights[tap] = odd.mul_add(s, even);
            weights[TAPS - 1 - tap] = odd.mul_add(-s, even);
        }
        weights
    }
}

impl Weights {
    /// [`Weights::at`] for a vector of fractions.
    #[inline(always)]
    pub(crate) fn at_all<S: Simd, const TAPS: usize>(&self, simd: S, t: S::f32s) -> [S::f32s; TAPS] {
        let half = TAPS / 2;
        let s = simd.sub_f32s(t, simd.splat_f32s(0.5));
        let square = simd.mul_f32s(s, s);
        let mut weights = [s; TAPS];
        for tap in 0..half {
            let constant = |value: f32| simd.splat_f32s(value);
            let (mut even, mut odd) = (constant(self.even[tap][half - 1]), constant(self.odd[tap][half - 1]));
            for power in (0..half - 1).rev() {
                even = simd.mul_add_f32s(even, square, constant(self.even[tap][power]));
                odd = simd.mul_add_f32s(odd, square, constant(self.odd[tap][power]));
            }
            weights[tap] = simd.mul_add_f32s(odd, s, even);
            weights[TAPS - 1 - tap] = simd.mul_add_f32s(odd, simd.neg_f32s(s), even);
        }
        weights
    }
}

/// The polynomial pieces of a kernel: entry `[tap][power]` is the coefficient of `t^power` in the weight of the
/// coefficient at `floor(x) + 1 - TAPS/2 + tap`, where `t = x - floor(x)`.
///
/// Weight of tap j of the B-spline of degree n: `1/n! sum_k (-1)^k C(n+1, k) (t + n - j - k)^n` over `k` from 0 to
/// `n - j` (M. Unser, A. Aldroubi, M. Eden: B-spline signal processing, IEEE Trans. Signal Process. 41 (1993) 821-848,
/// eq. 2.2).
const fn pieces<const TAPS: usize>(derivatives: [f64; 2]) -> [[f64; TAPS]; TAPS] {
    let mut table = [[0.0; TAPS]; TAPS];
    let mut tap = 0;
    while tap < TAPS {
        let mut spline = [0.0; TAPS];
        let mut power = 0;
        while power < TAPS {
            spline[power] = spline_coefficient(TAPS - 1, tap, power);
            power += 1;
        }
        power = 0;
        while power < TAPS {
            table[tap][power] = spline[power];
            let mut order = 1;
            while order <= 2 && power + 2 * order < TAPS {
                let from = power + 2 * order;
                let slope = factorial(from) / factorial(power);
                table[tap][power] += derivatives[order - 1] * slope * spline[from];
                order += 1;
            }
            power += 1;
        }
        tap += 1;
    }
    table
}

const fn spline_coefficient(degree: usize, tap: usize, power: usize) -> f64 {
    let mut sum = 0.0;
    let mut k = 0;
    while k + tap <= degree {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        let shift = (degree - tap - k) as f64;
        sum += sign * binomial(degree + 1, k) * binomial(degree, power) * power_of(shift, degree - power);
        k += 1;
    }
    sum / factorial(degree)
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
            Self::Cubic | Self::CubicMoms => 4,
            Self::Quintic | Self::QuinticMoms => 6,
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

    /// Poles of the recursive prefilter that lie within the unit circle: the roots of the kernel's values at whole
    /// pixels. Those of the quintic MOMS have `z + 1/z = -22/9` and `-21/2`.
    pub(crate) const fn poles(self) -> &'static [f64] {
        match self {
            Self::Linear => &[],
            Self::Cubic => &[-0.267_949_192_431_122_7],
            Self::CubicMoms => &[-0.5],
            Self::Quintic => &[-0.430_575_347_099_973_8, -0.043_096_288_203_264_65],
            Self::QuinticMoms => &[-0.519_493_853_295_915_7, -0.096_117_967_977_924_31],
        }
    }

    /// Pixels around the taps that the prefilter needs.
    ///
    /// The filter along rows takes no more than these. What it leaves out scatters displacements by some 0.1 mpx for the
    /// cubic kernels, and by less than 0.02 mpx for the quintic ones. That along columns starts by mirroring the image at the window's
    /// edge; its error decays with the largest pole z as `|z|^margin`, to 1e-3 (cubic), 2e-3 (cubic MOMS) and 2e-4 (both
    /// quintic) of the kink that mirroring makes. Where the window ends with the frame there is no margin, and the mirrored image
    /// is the one interpolated.
    pub(crate) const fn prefilter_margin_px(self) -> usize {
        match self {
            Self::Linear => 0,
            Self::Cubic => 5,
            Self::Quintic => 10,
            Self::CubicMoms => 9,
            Self::QuinticMoms => 13,
        }
    }

    /// The prefilter's response to one bright pixel, at its place and at each distance up to the margin.
    pub(crate) fn prefilter_response(self) -> &'static [f32] {
        match self {
            Self::Linear => &[],
            Self::Cubic => &CUBIC_RESPONSE,
            Self::CubicMoms => &CUBIC_MOMS_RESPONSE,
            Self::Quintic => &QUINTIC_RESPONSE,
            Self::QuinticMoms => &QUINTIC_MOMS_RESPONSE,
        }
    }

    /// What interpolation does to white noise.
    pub(crate) fn noise_gain(self) -> NoiseGain {
        NoiseGain(match self {
            Self::Linear => &LINEAR_GAIN,
            Self::Cubic => &CUBIC_GAIN,
            Self::CubicMoms => &CUBIC_MOMS_GAIN,
            Self::Quintic => &QUINTIC_GAIN,
            Self::QuinticMoms => &QUINTIC_MOMS_GAIN,
        })
    }
}

/// The variance of a value interpolated in an image of white noise of unit variance, over the phase between two pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NoiseGain(&'static GainTable);

impl NoiseGain {
    /// The gain along one axis at a place; that of a point of the image is the product of two. It is the sum of squares of
    /// the cardinal spline at the place's distances from all pixels.
    pub(crate) fn at(self, x: f64) -> f64 {
        let place = (x - x.floor()) * PHASES as f64;
        let below = (place as usize).min(PHASES - 1);
        self.0[below] + (place - below as f64) * (self.0[below + 1] - self.0[below])
    }
}

/// Phases at which the noise gain is tabulated.
const PHASES: usize = 64;
type GainTable = [f64; PHASES + 1];

static LINEAR_GAIN: LazyLock<GainTable> = LazyLock::new(|| gain_table::<BSpline, 2>(Interpolation::Linear));
static CUBIC_GAIN: LazyLock<GainTable> = LazyLock::new(|| gain_table::<BSpline, 4>(Interpolation::Cubic));
static CUBIC_MOMS_GAIN: LazyLock<GainTable> =
    LazyLock::new(|| gain_table::<Moms, 4>(Interpolation::CubicMoms));
static QUINTIC_GAIN: LazyLock<GainTable> = LazyLock::new(|| gain_table::<BSpline, 6>(Interpolation::Quintic));
static QUINTIC_MOMS_GAIN: LazyLock<GainTable> =
    LazyLock::new(|| gain_table::<Moms, 6>(Interpolation::QuinticMoms));

fn gain_table<K: Kernel<TAPS>, const TAPS: usize>(interpolation: Interpolation) -> GainTable {
    let cardinal = cardinal_coefficients(interpolation);
    std::array::from_fn(|phase| {
        let t = phase as f64 / PHASES as f64;
        let weights: [f64; TAPS] = K::WEIGHTS.at::<TAPS>(t as f32).map(f64::from);
        cardinal.windows(TAPS).map(|c| c.iter().zip(weights).map(|(c, w)| c * w).sum::<f64>().powi(2)).sum()
    })
}

/// Half of the coefficients that are kept of an image of one bright pixel: 0.52^50 = 6e-15.
const HALF: usize = 50;

/// The coefficients along a line of one bright pixel in its middle.
fn cardinal_coefficients(interpolation: Interpolation) -> [f64; 2 * HALF + 1] {
    let mut cardinal = [0.0; 2 * HALF + 1];
    cardinal[HALF] = 1.0;
    for &pole in interpolation.poles() {
        prefilter_line(&mut cardinal, pole);
    }
    cardinal
}

static CUBIC_RESPONSE: LazyLock<Vec<f32>> = LazyLock::new(|| response(Interpolation::Cubic));
static CUBIC_MOMS_RESPONSE: LazyLock<Vec<f32>> = LazyLock::new(|| response(Interpolation::CubicMoms));
static QUINTIC_RESPONSE: LazyLock<Vec<f32>> = LazyLock::new(|| response(Interpolation::Quintic));
static QUINTIC_MOMS_RESPONSE: LazyLock<Vec<f32>> = LazyLock::new(|| response(Interpolation::QuinticMoms));

/// The response of the prefilter within its margin. The last tap stands for all that follow, which have alternating
/// signs, so a constant stays as it is.
fn response(interpolation: Interpolation) -> Vec<f32> {
    let cardinal = cardinal_coefficients(interpolation);
    let mut side = cardinal[HALF..=HALF + interpolation.prefilter_margin_px()].to_vec();
    let rest = 0.5 * (1.0 - side[0]) - side[1..].iter().sum::<f64>();
    if let Some(last) = side.last_mut() {
        *last += rest;
    }
    side.into_iter().map(|value| value as f32).collect()
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
    fn cubic_weights_are_the_known_ones() {
        for t in [0.0_f32, 0.3, 0.5, 1.0] {
            let weights: [f32; 4] = <BSpline as Kernel<4>>::WEIGHTS.at(t);
            let u = 1.0 - t;
            let inner = |t: f32| (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0;
            let expected = [u * u * u / 6.0, inner(t), inner(u), t * t * t / 6.0];
            for (found, expected) in weights.iter().zip(expected) {
                assert!((found - expected).abs() < 2e-7, "two units in the last place of f32");
            }
        }
    }

    #[test]
    fn weights_sum_to_one() {
        fn check<K: Kernel<TAPS>, const TAPS: usize>() {
            for t in [0.0, 0.37, 0.9] {
                let sum: f32 = K::WEIGHTS.at::<TAPS>(t).iter().sum();
                assert!((sum - 1.0).abs() < 1e-6, "{TAPS} taps: {sum}");
            }
        }
        check::<BSpline, 2>();
        check::<BSpline, 4>();
        check::<BSpline, 6>();
        check::<Moms, 4>();
        check::<Moms, 6>();
    }

    #[test]
    fn poles_are_roots_of_the_values_at_whole_pixels() {
        fn check<K: Kernel<TAPS>, const TAPS: usize>(interpolation: Interpolation) {
            let values: [f32; TAPS] = K::WEIGHTS.at(0.0);
            for &z in interpolation.poles() {
                let polynomial = values.iter().rev().fold(0.0, |sum, &value| sum * z + f64::from(value));
                assert!(polynomial.abs() < 1e-6, "{interpolation}, {z}: f32 values");
            }
        }
        check::<BSpline, 4>(Interpolation::Cubic);
        check::<Moms, 4>(Interpolation::CubicMoms);
        check::<BSpline, 6>(Interpolation::Quintic);
        check::<Moms, 6>(Interpolation::QuinticMoms);
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
            assert!((interpolation.noise_gain().at(0.0) - 1.0).abs() < 1e-6, "f32 weights");
            assert!((interpolation.noise_gain().at(0.5) - half).abs() < 1e-6, "f32 weights");
            assert!((interpolation.noise_gain().at(7.5) - half).abs() < 1e-6, "f32 weights");
        }
        assert!(Interpolation::Quintic.noise_gain().at(0.5) > cubic);
    }
}
