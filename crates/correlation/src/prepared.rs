use chainwave_measurement::{Lost, Subset};
use nalgebra::DMatrix;

use crate::gradient::{self, Chosen};
use crate::reference::pixel_bounds;
use crate::sample::Lattice;
use crate::simd::LANES;
use crate::uncertainty::{UnitCovariance, reference_noise_variance};
use crate::warp::MAX_PARAMETERS;
use crate::{Reference, Settings, Shape};

/// A subset of the reference with everything that does not depend on the target: grey values, steepest descent images
/// and the inverse of their Hessian.
///
/// Let f be the reference less its mean, J_p its derivatives by the shape function's parameters p, and Z_p the same
/// from a gradient that is smoothed as the noise requires. A target g = a + b f(x + J dp), of unknown offset a and
/// gain b, is solved for dp by demanding that its residual is orthogonal to 1, to f and to each Z_p:
///
/// dp = (1/b) M^-1 sum Z'_p g, with Z'_p = Z_p less its projection on 1 and f, and M_pq = sum Z'_p J_q.
///
/// That is the Gauss-Newton step of ZNSSD (B. Pan, K. Li, W. Tong, Exp. Mech. 53 (2013) 1277-1289), the derivative of
/// its normalisation included. The noise of the reference, of variance s^2, adds `s^2 <d, d'>` to products of two
/// gradients with the filters d and d', and s^2 to f^2; both are subtracted.
#[derive(Debug, Clone)]
pub struct PreparedSubset {
    pub(crate) settings: Settings,
    /// The centre in the reference image.
    pub(crate) centre_px: [f64; 2],
    /// Place of the first pixel, relative to the centre.
    pub(crate) first_px: [f64; 2],
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Column of each pixel relative to the centre. These arrays hold the pixels row by row, then zeros up to whole
    /// vectors.
    pub(crate) columns: Vec<f32>,
    /// Row of each pixel relative to the centre.
    pub(crate) rows: Vec<f32>,
    /// Reference less its mean.
    pub(crate) intensity: Vec<f32>,
    pub(crate) gradient_x: Vec<f32>,
    pub(crate) gradient_y: Vec<f32>,
    /// Mean of the reference, in counts.
    pub(crate) mean: f64,
    /// Sum of squares of `intensity`.
    pub(crate) energy: f64,
    /// The same without the noise's share.
    pub(crate) signal_energy: f64,
    /// Mean of each Z over the subset, and its regression on f.
    pub(crate) projections: [[f64; 2]; MAX_PARAMETERS],
    /// M^-1.
    pub(crate) inverse: [[f64; MAX_PARAMETERS]; MAX_PARAMETERS],
    pub(crate) covariance: UnitCovariance,
    /// Variance of the noise of a reference pixel, in counts squared.
    pub(crate) noise_variance: f64,
    /// Frames behind the reference.
    pub(crate) n_averaged: f64,
}

/// Least share of signal in the energy of the grey values, and in that of the gradient along each axis. A patch of pure
/// noise of 33 x 33 px has about 0 +- 0.07 and 0 +- 0.2 (smoothing leaves few independent gradients); speckle of 14 %
/// contrast at 10 % noise has 0.65 in its grey values.
const LEAST_SIGNAL_SHARE: f64 = 0.2;
const LEAST_GRADIENT_SHARE: f64 = 0.3;
/// A reference whose own noise moves it by more than this cannot be located to a pixel.
const LARGEST_REFERENCE_SIGMA_PX: f64 = 0.5;

impl PreparedSubset {
    /// Prepares a subset from the reference around it.
    ///
    /// # Errors
    /// [`Lost::OutOfView`] when the reference does not hold the subset, [`Lost::NoTexture`] when its contrast does
    /// not locate it in both directions.
    pub fn new(reference: &Reference, subset: &Subset, settings: &Settings) -> Result<Self, Lost> {
        let patch = Patch::new(reference, subset).ok_or(Lost::OutOfView)?;
        let n_averaged = reference.n_averaged() as f64;
        let noise_variance = reference_noise_variance(&patch);
        let chosen = gradient::choose(&patch, noise_variance, n_averaged);
        let energy: f64 = patch.intensity.iter().map(|f| f * f).sum();
        let signal_energy = energy - patch.n_pixels() as f64 * noise_variance;
        if signal_energy <= LEAST_SIGNAL_SHARE * energy || chosen.signal_share < LEAST_GRADIENT_SHARE {
            return Err(Lost::NoTexture);
        }
        let normal =
            NormalEquations::new(&patch, &chosen, settings.shape, noise_variance).ok_or(Lost::NoTexture)?;
        let covariance = normal.unit_covariance();
        let sigma_px = (noise_variance * covariance.largest_signal()).sqrt();
        if sigma_px.is_nan() || sigma_px > LARGEST_REFERENCE_SIGMA_PX {
            return Err(Lost::NoTexture);
        }
        let place = |i: usize| [(i % patch.width) as f64, (i / patch.width) as f64];
        let along = |axis: usize| (0..patch.n_pixels()).map(move |i| patch.first_px[axis] + place(i)[axis]);
        Ok(Self {
            settings: settings.clone(),
            centre_px: patch.centre_px,
            first_px: patch.first_px,
            width: patch.width,
            height: patch.height,
            columns: pad(along(0)),
            rows: pad(along(1)),
            intensity: pad(patch.intensity.iter().copied()),
            gradient_x: pad(chosen.smooth.x.iter().copied()),
            gradient_y: pad(chosen.smooth.y.iter().copied()),
            mean: patch.mean,
            energy,
            signal_energy,
            projections: normal.projections,
            inverse: normal.inverse_array(),
            covariance,
            noise_variance,
            n_averaged,
        })
    }

    /// Pixels of the subset.
    pub fn n_pixels(&self) -> usize {
        self.width * self.height
    }

    pub(crate) fn lattice(&self) -> Lattice {
        Lattice { first_px: self.first_px, width: self.width, height: self.height }
    }

    /// Half of the width and height between the outer pixels' centres, from the centre to the farther side.
    pub(crate) fn half_px(&self) -> [f64; 2] {
        let [x, y] = self.first_px;
        let (right, bottom) = (x + (self.width - 1) as f64, y + (self.height - 1) as f64);
        [right.max(-x), bottom.max(-y)]
    }

    /// The corners relative to the centre.
    pub(crate) fn corners(&self) -> [[f64; 2]; 4] {
        let [x, y] = self.first_px;
        let (right, bottom) = (x + (self.width - 1) as f64, y + (self.height - 1) as f64);
        [[x, y], [right, y], [x, bottom], [right, bottom]]
    }
}

fn pad(values: impl Iterator<Item = f64>) -> Vec<f32> {
    let mut padded: Vec<f32> = values.map(|value| value as f32).collect();
    padded.resize(padded.len().next_multiple_of(LANES), 0.0);
    padded
}

/// The pixels of a subset and their surroundings, in f64.
pub(crate) struct Patch {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) centre_px: [f64; 2],
    pub(crate) first_px: [f64; 2],
    pub(crate) mean: f64,
    /// The subset's pixels less their mean, row by row.
    pub(crate) intensity: Vec<f64>,
    /// The pixels with [`gradient::MARGIN_PX`] more on each side.
    surroundings: Vec<f64>,
}

impl Patch {
    fn new(reference: &Reference, subset: &Subset) -> Option<Self> {
        let [x0, x1, y0, y1] = pixel_bounds(subset);
        if !reference.holds([x0, x1], [y0, y1]) {
            return None;
        }
        let (width, height) = (2 * subset.half_width_px + 1, 2 * subset.half_height_px + 1);
        let margin = gradient::MARGIN_PX as i64;
        let pixels = |x0: i64, x1: i64, y0: i64, y1: i64| -> Vec<f64> {
            (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| reference.pixel(x, y))).collect()
        };
        let mut intensity = pixels(x0, x1, y0, y1);
        let mean = intensity.iter().sum::<f64>() / intensity.len() as f64;
        intensity.iter_mut().for_each(|value| *value -= mean);
        Some(Self {
            width,
            height,
            centre_px: [subset.x_px, subset.y_px],
            first_px: [x0 as f64 - subset.x_px, y0 as f64 - subset.y_px],
            mean,
            intensity,
            surroundings: pixels(x0 - margin, x1 + margin, y0 - margin, y1 + margin),
        })
    }

    pub(crate) fn n_pixels(&self) -> usize {
        self.width * self.height
    }

    /// The subset filtered by `taps_x` along rows and `taps_y` along columns, each centred at its radius.
    pub(crate) fn filtered(
        &self,
        taps_x: &[f64],
        radius_x: usize,
        taps_y: &[f64],
        radius_y: usize,
    ) -> Vec<f64> {
        let margin = gradient::MARGIN_PX;
        let full = self.width + 2 * margin;
        let n_rows = self.height + 2 * radius_y;
        let mut by_row = Vec::with_capacity(n_rows * self.width);
        for row in self.surroundings.chunks_exact(full).skip(margin - radius_y).take(n_rows) {
            let windows = row[margin - radius_x..].windows(taps_x.len()).take(self.width);
            by_row.extend(windows.map(|window| dot(window, taps_x)));
        }
        let mut result = vec![0.0; self.n_pixels()];
        for (y, out) in result.chunks_exact_mut(self.width).enumerate() {
            for (row, tap) in by_row.chunks_exact(self.width).skip(y).zip(taps_y) {
                out.iter_mut().zip(row).for_each(|(sum, value)| *sum += tap * value);
            }
        }
        result
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The normal equations of a Gauss-Newton step and what noise does to them.
struct NormalEquations {
    projections: [[f64; 2]; MAX_PARAMETERS],
    inverse: DMatrix<f64>,
    /// Sum of Z' Z', without the share of the gradient's noise.
    signal: DMatrix<f64>,
    /// That share.
    noise: DMatrix<f64>,
    n_terms: usize,
}

impl NormalEquations {
    fn new(patch: &Patch, gradients: &Chosen, shape: Shape, noise_variance: f64) -> Option<Self> {
        let terms = shape_terms(patch, shape);
        let smooth = steepest_descent(&gradients.smooth, &terms);
        let plain = steepest_descent(&gradients.plain, &terms);
        let n = patch.n_pixels() as f64;
        let signal_energy = dot(&patch.intensity, &patch.intensity) - n * noise_variance;
        let mut projections = [[0.0; 2]; MAX_PARAMETERS];
        let mut orthogonal = smooth;
        for (column, projection) in orthogonal.iter_mut().zip(&mut projections) {
            let mean = column.iter().sum::<f64>() / n;
            let slope = dot(column, &patch.intensity) / signal_energy;
            column.iter_mut().zip(&patch.intensity).for_each(|(z, f)| *z -= mean + slope * f);
            *projection = [mean, slope];
        }
        let size = orthogonal.len();
        let products =
            |a: &[Vec<f64>], b: &[Vec<f64>]| DMatrix::from_fn(size, size, |p, q| dot(&a[p], &b[q]));
        let unit_noise = noise_products(&terms);
        let noise = &unit_noise * (noise_variance * gradients.filter.noise_gain);
        let hessian =
            products(&orthogonal, &plain) - unit_noise * (noise_variance * gradients.filter.plain_overlap);
        let inverse = invert(hessian)?;
        let signal = products(&orthogonal, &orthogonal) - &noise;
        Some(Self { projections, inverse, signal, noise, n_terms: terms.len() })
    }

    fn unit_covariance(&self) -> UnitCovariance {
        let through = |middle: &DMatrix<f64>| {
            let full = &self.inverse * middle * self.inverse.transpose();
            let (u, v) = (0, self.n_terms);
            [full[(u, u)], full[(u, v)], full[(v, v)]]
        };
        UnitCovariance { signal: through(&self.signal), noise: through(&self.noise) }
    }

    fn inverse_array(&self) -> [[f64; MAX_PARAMETERS]; MAX_PARAMETERS] {
        let size = self.inverse.nrows();
        std::array::from_fn(|p| {
            std::array::from_fn(|q| if p < size && q < size { self.inverse[(p, q)] } else { 0.0 })
        })
    }
}

/// Inverts the Hessian, scaled to a unit diagonal so that pixels and gradients weigh alike. `None` where the texture
/// leaves a direction open.
fn invert(hessian: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = hessian.nrows();
    if hessian.diagonal().iter().any(|&value| value.is_nan() || value <= 0.0) {
        return None;
    }
    let scale = DMatrix::from_diagonal(&hessian.diagonal().map(|value| 1.0 / value.sqrt()));
    let scaled = (&scale * hessian * &scale).try_inverse()?;
    let largest = scaled.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    // Texture in one direction alone leaves a pivot that is rounding: 1e10 is far above any usable texture's.
    (largest.is_finite() && largest < 1e10 * size as f64).then(|| &scale * scaled * &scale)
}

/// The shape function's terms at every pixel: 1, x, y.
fn shape_terms(patch: &Patch, shape: Shape) -> Vec<Vec<f64>> {
    let place = |i: usize| {
        let [x, y] = patch.first_px;
        [1.0, x + (i % patch.width) as f64, y + (i / patch.width) as f64]
    };
    (0..shape.n_terms()).map(|term| (0..patch.n_pixels()).map(|i| place(i)[term]).collect()).collect()
}

/// Derivatives of the reference by the parameters: gradient in x, then in y, times each term.
fn steepest_descent(gradient: &gradient::Gradient, terms: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect();
    [&gradient.x, &gradient.y]
        .into_iter()
        .flat_map(|g| terms.iter().map(move |term| product(g, term)))
        .collect()
}

/// Products of the steepest descent images of white noise whose gradient has unit variance, the same in x and y.
fn noise_products(terms: &[Vec<f64>]) -> DMatrix<f64> {
    let n = terms.len();
    DMatrix::from_fn(
        2 * n,
        2 * n,
        |p, q| if p / n == q / n { dot(&terms[p % n], &terms[q % n]) } else { 0.0 },
    )
}
