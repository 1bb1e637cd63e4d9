//! The normal equations of a Gauss-Newton step, and what noise does to them.

use nalgebra::DMatrix;

use crate::Shape;
use crate::prepared::moments::{MAX_MONOMIALS, Places, TERMS, moments, monomial};
use crate::warp::MAX_PARAMETERS;

/// The images of a subset from which the equations are made, padded to whole vectors by zeros.
#[derive(Clone, Copy)]
pub(crate) struct Images<'a> {
    pub(crate) places: Places<'a>,
    /// The reference less its mean.
    pub(crate) intensity: &'a [f32],
    /// 1 in every pixel.
    pub(crate) ones: &'a [f32],
    /// Gradients that the steepest descent images are made of, along x and y.
    pub(crate) smooth: [&'a [f32]; 2],
    /// Gradients without smoothing.
    pub(crate) plain: [&'a [f32]; 2],
}

/// Noise of the reference.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReferenceNoise {
    /// Variance of a pixel, in counts squared.
    pub(crate) variance: f64,
    /// Variance of the smooth gradient of white noise of unit variance.
    pub(crate) gain: f64,
    /// Covariance of the smooth and the plain gradient, for such noise.
    pub(crate) overlap: f64,
}

/// The normal equations; see [`crate::PreparedSubset`] for the symbols.
pub(crate) struct NormalEquations {
    /// Mean of each Z, and its regression on f.
    pub(crate) projections: [[f64; 2]; MAX_PARAMETERS],
    /// Sum of f^2 without the noise's share.
    pub(crate) signal_energy: f64,
    /// Share of the gradient's energy that is not noise, the lesser of x and y.
    pub(crate) signal_share: f64,
    /// M.
    pub(crate) hessian: DMatrix<f64>,
    /// M^-1, within what the shape function allows.
    inverse: DMatrix<f64>,
    /// Sum of Z' Z', without the share of the gradient's noise.
    signal: DMatrix<f64>,
    /// That share.
    noise: DMatrix<f64>,
}

type Moments = [f64; MAX_MONOMIALS];

impl NormalEquations {
    /// The equations of a shape function over `n_pixels`; `None` where the texture leaves a direction open.
    pub(crate) fn new(
        images: Images<'_>,
        shape: Shape,
        n_pixels: usize,
        noise: ReferenceNoise,
    ) -> Option<Self> {
        let n_terms = shape.n_terms();
        let n_monomials = if n_terms == 1 {
            1
        } else if n_terms == 3 {
            6
        } else {
            MAX_MONOMIALS
        };
        let of = |a: &[f32], b: &[f32]| moments(images.places, a, b, n_monomials);
        let of_terms = |a: &[f32], b: &[f32]| moments(images.places, a, b, n_terms);
        let f = images.intensity;
        let n = n_pixels as f64;
        let energy = moments(images.places, f, f, 1)[0];
        let signal_energy = energy - n * noise.variance;
        let size = 2 * n_terms;
        let column = |of_axis: [Moments; 2]| -> Vec<f64> {
            (0..size).map(|p| of_axis[p / n_terms][term(p, n_terms)]).collect()
        };
        let table = |of_axes: [[Moments; 2]; 2]| {
            DMatrix::from_fn(size, size, |p, q| {
                of_axes[p / n_terms][q / n_terms][product(p % n_terms, q % n_terms)]
            })
        };
        let pairs = |a: [&[f32]; 2], b: [&[f32]; 2]| a.map(|a| b.map(|b| of(a, b)));
        let sums_smooth = column(images.smooth.map(|z| of_terms(z, images.ones)));
        let sums_plain = column(images.plain.map(|j| of_terms(j, images.ones)));
        let with_f = column(images.smooth.map(|z| of_terms(z, f)));
        let plain_with_f = column(images.plain.map(|j| of_terms(j, f)));
        let [x, y] = images.smooth;
        let across = of(x, y);
        let squares = table([[of(x, x), across], [across, of(y, y)]]);
        let mixed = table(pairs(images.smooth, images.plain));
        let unit_noise = unit_noise(of(images.ones, images.ones), n_terms);

        let mut projections = [[0.0; 2]; MAX_PARAMETERS];
        for p in 0..size {
            projections[p] = [sums_smooth[p] / n, with_f[p] / signal_energy];
        }
        let projected =
            |p: usize, sum: f64, product: f64| projections[p][0] * sum + projections[p][1] * product;
        let slopes =
            DMatrix::from_fn(size, size, |p, q| mixed[(p, q)] - projected(p, sums_plain[q], plain_with_f[q]));
        // Z' Z' = Z Z - (Z on 1 and f) - the same with p and q exchanged + (1 and f) (1 and f)
        let energies = DMatrix::from_fn(size, size, |p, q| {
            let back = projected(p, n * projections[q][0], energy * projections[q][1]);
            squares[(p, q)]
                - projected(p, sums_smooth[q], with_f[q])
                - projected(q, sums_smooth[p], with_f[p])
                + back
        });
        let gradient_noise = &unit_noise * (noise.variance * noise.gain);
        let hessian = slopes - unit_noise * (noise.variance * noise.overlap);
        let share = |axis: usize| {
            let energy = squares[(axis * n_terms, axis * n_terms)];
            (energy - n * noise.variance * noise.gain) / energy
        };
        Some(Self {
            projections,
            signal_energy,
            signal_share: share(0).min(share(1)),
            inverse: invert_for(shape, hessian.clone())?,
            hessian,
            signal: energies - &gradient_noise,
            noise: gradient_noise,
        })
    }

    /// What unit variance of a pixel's noise makes of the parameters.
    pub(crate) fn unit_covariance(&self) -> UnitCovariance {
        let through = |middle: &DMatrix<f64>| &self.inverse * middle * self.inverse.transpose();
        UnitCovariance { signal: through(&self.signal), noise: through(&self.noise) }
    }

    /// M^-1, filled up with zeros.
    pub(crate) fn inverse_array(&self) -> [[f64; MAX_PARAMETERS]; MAX_PARAMETERS] {
        let size = self.inverse.nrows();
        std::array::from_fn(|p| {
            std::array::from_fn(|q| if p < size && q < size { self.inverse[(p, q)] } else { 0.0 })
        })
    }
}

/// The monomial of a parameter.
fn term(parameter: usize, n_terms: usize) -> usize {
    let [i, j] = TERMS[parameter % n_terms];
    monomial(i, j)
}

/// The monomial of the product of two terms.
fn product(a: usize, b: usize) -> usize {
    monomial(TERMS[a][0] + TERMS[b][0], TERMS[a][1] + TERMS[b][1])
}

/// Products of the steepest descent images of white noise whose gradient has unit variance, the same in x and y.
fn unit_noise(of_places: Moments, n_terms: usize) -> DMatrix<f64> {
    let same_axis = |p: usize, q: usize| p / n_terms == q / n_terms;
    let value = |p: usize, q: usize| of_places[product(p % n_terms, q % n_terms)];
    DMatrix::from_fn(2 * n_terms, 2 * n_terms, |p, q| if same_axis(p, q) { value(p, q) } else { 0.0 })
}

/// The inverse of the Hessian within what the shape function allows: for a rotation, whose parameters are u, v and the
/// angle, `C (C^T M C)^-1 C^T` with the columns of C being what each of them does to the affine parameters.
pub(crate) fn invert_for(shape: Shape, hessian: DMatrix<f64>) -> Option<DMatrix<f64>> {
    if shape != Shape::Rigid {
        return invert(hessian);
    }
    let mut columns = DMatrix::zeros(6, 3);
    for (row, column, value) in [(0, 0, 1.0), (3, 1, 1.0), (2, 2, -1.0), (4, 2, 1.0)] {
        columns[(row, column)] = value;
    }
    let reduced = invert(columns.transpose() * hessian * &columns)?;
    Some(&columns * reduced * columns.transpose())
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
    // Texture in one direction alone leaves a pivot that is rounding: 1e6 is far above any usable texture's.
    (largest.is_finite() && largest < 1e6 * size as f64).then(|| &scale * scaled * &scale)
}

/// Covariance of the parameters per unit variance of a pixel's noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct UnitCovariance {
    /// M^-1 S M^-T.
    pub(crate) signal: DMatrix<f64>,
    /// M^-1 K M^-T.
    pub(crate) noise: DMatrix<f64>,
}

impl UnitCovariance {
    pub(crate) fn largest_signal(&self) -> f64 {
        let [xx, _, yy] = of_centre(&self.signal);
        // NaN stays NaN
        if xx > yy { xx } else { yy }
    }

    /// Relative standard error with which a subset knows how the displacement of its centre along x or y (0 or 1) answers to the texture,
    /// where `n` independent gradients tell it.
    ///
    /// The square of a gradient of energy S with noise of energy K has, less K, a variance of `(4 S K + 2 K^2)/n`; M, and with it sigma, is
    /// known no better than that. It counts in the direction that moves the centre: where that depends on a parameter which the
    /// texture hardly shows (the turn of a lone round spot), S is that parameter's.
    pub(crate) fn sensitivity_error(&self, axis: usize, n: f64) -> f64 {
        let place = axis * (self.signal.nrows() / 2);
        let noise = self.noise[(place, place)] / self.signal[(place, place)];
        ((4.0 * noise + 2.0 * noise * noise) / n).sqrt()
    }
}

/// Covariance of the displacement of the centre (xx, xy, yy), out of that of all parameters.
pub(crate) fn of_centre(full: &DMatrix<f64>) -> [f64; 3] {
    let v = full.nrows() / 2;
    [full[(0, 0)], full[(0, v)], full[(v, v)]]
}
