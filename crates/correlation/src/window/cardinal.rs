//! What makes each interpolation a spline through the pixels: the poles and the response of its prefilter, and what both,
//! prefilter and kernel, do to white noise.

use std::sync::LazyLock;

use crate::Interpolation;
use crate::window::kernel::{BSpline, Kernel, Moms};

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
    #[inline(always)]
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
