//! Gradients of a noisy reference.
//!
//! The plain gradient is the derivative of the cubic B-spline through the pixels. Noise in it makes the estimate less
//! precise (the steepest descent images weight the pixels wrongly), at 5 % noise by some 10 % in the standard
//! deviation; smoothing takes the noise out, and some of the signal with it. The filter is chosen so that the
//! predicted variance of the displacement is least. All filters are antisymmetric, so the noise of a pixel never
//! multiplies itself and no choice of filter biases the estimate.

use crate::prepared::Patch;

/// Radius of the derivative: the pole of the cubic spline to this power is 2e-6.
const DERIVATIVE_RADIUS: usize = 10;
/// Radius of the smoothing.
const SMOOTHING_RADIUS: usize = 4;
/// Pixels around a subset that the widest filter uses.
pub(crate) const MARGIN_PX: usize = DERIVATIVE_RADIUS + SMOOTHING_RADIUS;
/// Standard deviations of the smoothing Gaussians, in pixels. The first is the plain gradient.
const SMOOTHING_PX: [f64; 5] = [0.5, 0.65, 0.8, 1.0, 1.3];

/// A separable derivative filter: `derivative` along its axis and `smoothing` across it.
#[derive(Debug, Clone)]
pub(crate) struct GradientFilter {
    derivative: Vec<f64>,
    smoothing: Vec<f64>,
    /// Variance of the gradient of white noise of unit variance.
    pub(crate) noise_gain: f64,
    /// Covariance of this gradient and the plain one, for such noise.
    pub(crate) plain_overlap: f64,
}

/// A gradient at every pixel of a subset, row by row, in counts per pixel.
#[derive(Debug, Clone)]
pub(crate) struct Gradient {
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
}

/// The gradients of a patch.
pub(crate) struct Chosen {
    /// Of the cubic spline itself.
    pub(crate) plain: Gradient,
    /// By the chosen filter.
    pub(crate) smooth: Gradient,
    /// The chosen filter.
    pub(crate) filter: GradientFilter,
    /// Share of the gradient's energy that is not noise, the lesser of x and y.
    pub(crate) signal_share: f64,
}

/// The gradients of `patch` by the filter with the least predicted variance of the displacement.
///
/// `noise_variance` is that of a pixel of the reference, which is the mean of `n_averaged` frames.
pub(crate) fn choose(patch: &Patch, noise_variance: f64, n_averaged: f64) -> Chosen {
    let plain = GradientFilter::new(0.0).apply(patch);
    let candidates = SMOOTHING_PX.map(|sigma| {
        let filter = GradientFilter::new(sigma);
        let smooth = filter.apply(patch);
        let noise = Noise { variance: noise_variance, n_averaged, filter: &filter };
        let [vx, sx] = noise.predict(&smooth.x, &plain.x);
        let [vy, sy] = noise.predict(&smooth.y, &plain.y);
        (vx + vy, sx.min(sy), smooth, filter)
    });
    let [first, others @ ..] = candidates;
    let best = others.into_iter().fold(first, |best, next| if next.0 < best.0 { next } else { best });
    Chosen { plain, signal_share: best.1, smooth: best.2, filter: best.3 }
}

struct Noise<'a> {
    variance: f64,
    n_averaged: f64,
    filter: &'a GradientFilter,
}

impl Noise<'_> {
    /// Predicted variance of a displacement along one axis (see [`crate::uncertainty`]), and the share of the
    /// gradient's energy that is signal.
    fn predict(&self, smooth: &[f64], plain: &[f64]) -> [f64; 2] {
        let n = smooth.len() as f64;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let raw = dot(smooth, smooth);
        let noise = n * self.variance * self.filter.noise_gain;
        let slope = dot(smooth, plain) - n * self.variance * self.filter.plain_overlap;
        if raw <= noise || slope <= 0.0 {
            return [f64::INFINITY, 0.0];
        }
        let both = 1.0 + 1.0 / self.n_averaged;
        [(both * (raw - noise) + noise) / slope.powi(2), (raw - noise) / raw]
    }
}

impl GradientFilter {
    fn new(smoothing_px: f64) -> Self {
        let plain = spline_derivative();
        let smoothing = gaussian(smoothing_px);
        let derivative = convolve(&plain, &smoothing);
        let square = |taps: &[f64]| taps.iter().map(|tap| tap * tap).sum::<f64>();
        let inner = &derivative[SMOOTHING_RADIUS..derivative.len() - SMOOTHING_RADIUS];
        let overlap: f64 = inner.iter().zip(&plain).map(|(a, b)| a * b).sum();
        Self {
            noise_gain: square(&derivative) * square(&smoothing),
            plain_overlap: overlap * smoothing[SMOOTHING_RADIUS],
            derivative,
            smoothing,
        }
    }

    fn apply(&self, patch: &Patch) -> Gradient {
        let (along, across) = (self.derivative.len() / 2, SMOOTHING_RADIUS);
        let x = patch.filtered(&self.derivative, along, &self.smoothing, across);
        let y = patch.filtered(&self.smoothing, across, &self.derivative, along);
        Gradient { x, y }
    }
}

/// The derivative at a pixel of the cubic spline through all pixels: `-3 z^|k| sign(k)` at distance k, where
/// z = sqrt(3) - 2 is the spline's pole.
fn spline_derivative() -> Vec<f64> {
    let pole = 3.0_f64.sqrt() - 2.0;
    let radius = DERIVATIVE_RADIUS as i32;
    (-radius..=radius).map(|k| -3.0 * f64::from(k.signum()) * pole.powi(k.abs())).collect()
}

/// A sampled Gaussian of unit sum; a single 1 for no smoothing.
fn gaussian(sigma: f64) -> Vec<f64> {
    let radius = SMOOTHING_RADIUS as i32;
    let weight = |k: i32| if k == 0 { 1.0 } else { (-0.5 * (f64::from(k) / sigma).powi(2)).exp() };
    let taps: Vec<f64> = (-radius..=radius).map(weight).collect();
    let sum: f64 = taps.iter().sum();
    taps.into_iter().map(|tap| tap / sum).collect()
}

fn convolve(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut result = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            result[i + j] += a * b;
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plain_derivative_is_exact_for_a_cubic() {
        // A cubic spline reproduces x^3, so its derivative at 0 is 0 and that of x is 1; f64 and 10 taps leave 1e-4.
        let taps = spline_derivative();
        let moment = |power: i32| -> f64 {
            taps.iter()
                .enumerate()
                .map(|(i, tap)| tap * (i as f64 - DERIVATIVE_RADIUS as f64).powi(power))
                .sum()
        };
        assert!((moment(1) - 1.0).abs() < 1e-4, "{}", moment(1));
        assert!(moment(3).abs() < 1e-2, "{}", moment(3));
    }

    #[test]
    fn the_noise_gain_of_the_plain_gradient_is_the_closed_form() {
        let pole = 3.0_f64.sqrt() - 2.0;
        let filter = GradientFilter::new(0.0);
        assert!((filter.noise_gain - 18.0 * pole.powi(2) / (1.0 - pole.powi(2))).abs() < 1e-9);
        assert!((filter.plain_overlap - filter.noise_gain).abs() < 1e-12);
        assert!(GradientFilter::new(0.8).noise_gain < 0.3 * filter.noise_gain);
    }
}
