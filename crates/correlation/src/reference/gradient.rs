//! Gradients of a noisy reference.
//!
//! The plain gradient is the derivative of the cubic B-spline through the pixels. Noise in it makes the estimate less
//! precise (the steepest descent images weight the pixels wrongly), at 5 % noise by 11 % in the standard deviation;
//! smoothing takes the noise out, and some of the signal with it. The filter is chosen so that the predicted variance
//! of the displacement is least. All filters are antisymmetric, so the noise of a pixel never multiplies itself and no
//! choice of filter biases the estimate.
//!
//! The least variance that any weighting of frequencies reaches where both images have noise of spectrum N and the scene
//! has S = s N is `1 / sum w^2 s^2/(2s + 1)` (G. C. Carter, Proc. IEEE 75 (1987) 236-255), by weights that follow
//! `2s/(2s + 1)`: flat up to where the noise takes over. For speckles of 4.5 px and 17 % contrast its root is 1.002,
//! 1.005, 1.020 and 1.053 times the noise floor at 1, 2, 5 and 10 % noise; the tapered low-pass filters here have
//! 1.002, 1.007, 1.024 and 1.060, where Gaussians have 1.005, 1.011, 1.033 and 1.072.
//!
//! The gradients are made once for all pixels of a reference, of which any number of subsets then take their part.

use std::f64::consts::PI;

use chainwave_measurement::Region;

use crate::reference::filter::{Line, convolve, filtered};
use crate::reference::image::ReferenceImage;
use crate::reference::mask::usable_pixels;
use crate::simd::{dot, square_sum};

/// Radius of the derivative: the pole of the cubic spline to this power is 2e-6.
const DERIVATIVE_RADIUS: usize = 10;
/// Radius of the smoothing.
const SMOOTHING_RADIUS: usize = 4;
/// Pixels around a subset that the widest filter uses.
pub(crate) const MARGIN_PX: usize = DERIVATIVE_RADIUS + SMOOTHING_RADIUS;
/// Cut-off frequencies of the smoothing, in radians per pixel. At pi nothing is cut off: that is the plain gradient.
const CUT_OFFS: [f64; 7] = [PI, 2.7, 2.4, 2.1, 1.8, 1.5, 1.2];

/// A separable derivative filter: `derivative` along its axis and `smoothing` across it.
#[derive(Debug, Clone)]
pub(crate) struct GradientFilter {
    derivative: Line,
    smoothing: Line,
    /// Variance of the gradient of white noise of unit variance.
    pub(crate) noise_gain: f64,
    /// Covariance of this gradient and the plain one, for such noise.
    pub(crate) plain_overlap: f64,
}

/// A gradient at every pixel of a part of the reference, row by row, in counts per pixel.
#[derive(Debug, Clone)]
pub(crate) struct Gradient {
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
}

/// What the subsets of a reference are prepared from, for each of its pixels.
#[derive(Debug, Clone)]
pub(crate) struct Gradients {
    /// Of the cubic spline itself.
    pub(crate) plain: Gradient,
    /// By the chosen filter.
    pub(crate) smooth: Gradient,
    /// The chosen filter.
    pub(crate) filter: GradientFilter,
    /// Fourth differences along both axes, see [`noise_variance`].
    pub(crate) fourth: Vec<f32>,
    /// 1 for each pixel that is used, 0 for the others; `None` where all are.
    pub(crate) usable: Option<Vec<f32>>,
}

impl Gradients {
    pub(crate) fn of(reference: &ReferenceImage) -> Self {
        let filter = choose(reference);
        let whole = reference.region;
        let (plain, smooth) =
            (GradientFilter::new(PI).apply(reference, whole), filter.apply(reference, whole));
        let fourth = fourth_differences(reference, whole);
        let usable = usable_pixels(whole, reference, &fourth);
        Self { plain, smooth, filter, fourth, usable }
    }
}

/// Columns and rows of the patches by which the filter is chosen, and the most of them along one axis.
const PATCH_PX: usize = 48;
const MAX_PATCHES: usize = 4;

/// The filter with the least predicted variance of a displacement, over patches spread over the reference.
fn choose(reference: &ReferenceImage) -> GradientFilter {
    let mut totals = CUT_OFFS.map(|_| [Energies::default(); 2]);
    let filters = CUT_OFFS.map(GradientFilter::new);
    let plain_filter = GradientFilter::new(PI);
    let mut noise = 0.0;
    for patch in patches(reference.region) {
        let plain = plain_filter.apply(reference, patch);
        let fourth = fourth_differences(reference, patch);
        noise += noise_variance(&fourth, fourth.len(), reference.level) * patch.n_pixels() as f64;
        for (total, filter) in totals.iter_mut().zip(&filters) {
            let smooth = filter.apply(reference, patch);
            total[0].add(&smooth.x, &plain.x);
            total[1].add(&smooth.y, &plain.y);
        }
    }
    let n_averaged = reference.n_averaged as f64;
    let predicted = |(total, filter): (&[Energies; 2], &GradientFilter)| -> f64 {
        total.iter().map(|energies| energies.predicted_variance(filter, noise, n_averaged)).sum()
    };
    let variances: Vec<f64> = totals.iter().zip(&filters).map(predicted).collect();
    let [first, others @ ..] = filters;
    let (mut best, mut least) = (first, variances[0]);
    for (filter, &variance) in others.into_iter().zip(&variances[1..]) {
        if variance < least {
            (best, least) = (filter, variance);
        }
    }
    best
}

/// Patches that are spread over a region, or the region itself where it is small.
fn patches(region: Region) -> Vec<Region> {
    let along = |first: usize, n: usize| -> Vec<[usize; 2]> {
        let size = if n <= 2 * PATCH_PX { n } else { PATCH_PX };
        let count = (n / size.max(1)).clamp(1, MAX_PATCHES);
        let place = |i: usize| first + (n - size) * (2 * i + 1) / (2 * count);
        (0..count).map(|i| [place(i), size]).collect()
    };
    let columns = along(region.x, region.width);
    let in_row = |[y, height]: [usize; 2]| {
        columns.iter().map(move |&[x, width]| Region { x, y, width, height }).collect::<Vec<_>>()
    };
    along(region.y, region.height).into_iter().flat_map(in_row).collect()
}

/// Sums of squares and products of the gradients along one axis.
#[derive(Debug, Clone, Copy, Default)]
struct Energies {
    smooth: f64,
    with_plain: f64,
}

impl Energies {
    fn add(&mut self, smooth: &[f32], plain: &[f32]) {
        self.smooth += square_sum(smooth);
        self.with_plain += dot(smooth, plain);
    }

    /// Predicted variance of a displacement along the axis (see [`crate::uncertainty`]); `noise` is the variance of a
    /// pixel's noise times the number of pixels.
    fn predicted_variance(&self, filter: &GradientFilter, noise: f64, n_averaged: f64) -> f64 {
        let gradient_noise = noise * filter.noise_gain;
        let slope = self.with_plain - noise * filter.plain_overlap;
        if self.smooth <= gradient_noise || slope <= 0.0 {
            return f64::INFINITY;
        }
        let both = 1.0 + 1.0 / n_averaged;
        (both * (self.smooth - gradient_noise) + gradient_noise) / slope.powi(2)
    }
}

impl GradientFilter {
    fn new(cut_off: f64) -> Self {
        let plain = spline_derivative();
        let smoothing = low_pass(cut_off);
        let derivative = convolve(&plain, &smoothing);
        let square = |taps: &[f64]| taps.iter().map(|tap| tap * tap).sum::<f64>();
        let inner = &derivative[SMOOTHING_RADIUS..derivative.len() - SMOOTHING_RADIUS];
        let overlap: f64 = inner.iter().zip(&plain).map(|(a, b)| a * b).sum();
        Self {
            noise_gain: square(&derivative) * square(&smoothing),
            plain_overlap: overlap * smoothing[SMOOTHING_RADIUS],
            derivative: Line::antisymmetric(&derivative),
            smoothing: Line::symmetric(&smoothing),
        }
    }

    /// The smoothed pixels of a part, less the reference's level.
    pub(crate) fn smooth(&self, reference: &ReferenceImage, part: Region) -> Vec<f32> {
        filtered(reference, part, &self.smoothing, &self.smoothing)
    }

    fn apply(&self, reference: &ReferenceImage, part: Region) -> Gradient {
        let x = filtered(reference, part, &self.derivative, &self.smoothing);
        let y = filtered(reference, part, &self.smoothing, &self.derivative);
        Gradient { x, y }
    }
}

/// The image's highest frequencies, where optics leave no texture: fourth differences along x and y, 1 -4 6 -4 1 in each.
fn fourth_differences(reference: &ReferenceImage, part: Region) -> Vec<f32> {
    let fourth = Line::symmetric(&[1.0, -4.0, 6.0, -4.0, 1.0]);
    filtered(reference, part, &fourth, &fourth)
}

/// Variance of the noise of one pixel, by the mean square of the fourth differences of `n_pixels` (others being zero), whose
/// taps' squares sum to 70 along each axis.
///
/// (J. Immerkaer, Comput. Vis. Image Underst. 64 (1996) 300-302, uses second differences; by their spectrum, speckles
/// of 4.5 px leave 1 % of full range in those and 0.2 % here.)
pub(crate) fn noise_variance(fourth_differences: &[f32], n_pixels: usize, level: f64) -> f64 {
    let mean_square = square_sum(fourth_differences) / n_pixels.max(1) as f64;
    // Rounding of f32 pixels: so an image of exact stripes has no texture along them either.
    let rounding = 1e-6 * level.abs();
    mean_square / (70.0 * 70.0) + rounding * rounding
}

/// The filter that takes the derivative at a pixel of the cubic spline through all pixels.
fn spline_derivative() -> Vec<f64> {
    let radius = DERIVATIVE_RADIUS as i32;
    (-radius..=radius).map(spline_slope).collect()
}

/// What the pixel at a distance counts in that derivative: `-3 z^|k| sign(k)`, where z = sqrt(3) - 2 is the spline's pole.
pub(crate) fn spline_slope(distance: i32) -> f64 {
    let pole = 3.0_f64.sqrt() - 2.0;
    -3.0 * f64::from(distance.signum()) * pole.powi(distance.abs())
}

/// A low-pass filter of unit sum, tapered by a raised cosine; a single 1 where nothing is cut off.
fn low_pass(cut_off: f64) -> Vec<f64> {
    let radius = SMOOTHING_RADIUS as i32;
    let weight = |k: i32| {
        let taper = 0.5 + 0.5 * (PI * f64::from(k) / f64::from(radius + 1)).cos();
        let angle = cut_off * f64::from(k);
        if k == 0 { 1.0 } else { taper * angle.sin() / angle }
    };
    let taps: Vec<f64> = (-radius..=radius).map(weight).collect();
    let sum: f64 = taps.iter().sum();
    taps.into_iter().map(|tap| tap / sum).collect()
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
        let filter = GradientFilter::new(PI);
        assert!((filter.noise_gain - 18.0 * pole.powi(2) / (1.0 - pole.powi(2))).abs() < 1e-9);
        assert!((filter.plain_overlap - filter.noise_gain).abs() < 1e-12);
        assert!(GradientFilter::new(1.8).noise_gain < 0.3 * filter.noise_gain);
    }

    #[test]
    fn patches_lie_in_the_region() {
        for (width, height) in [(1, 1), (61, 61), (97, 2048), (420, 33)] {
            let region = Region { x: 5, y: 7, width, height };
            for patch in patches(region) {
                assert!(patch.x >= 5 && patch.y >= 7 && patch.n_pixels() > 0);
                assert!(patch.x + patch.width <= 5 + width && patch.y + patch.height <= 7 + height);
            }
        }
    }
}
