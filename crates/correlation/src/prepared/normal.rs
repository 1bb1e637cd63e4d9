//! The normal equations of a Gauss-Newton step, and what noise does to them.

use nalgebra::SMatrix;

use crate::Shape;
use crate::prepared::moments::{MAX_MONOMIALS, Moments, Places, TERMS, moments, monomial};
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

/// A matrix of the parameters of the largest shape function; those of the others fill its first rows and columns.
pub(crate) type Matrix = [[f64; MAX_PARAMETERS]; MAX_PARAMETERS];

/// The normal equations; see [`crate::PreparedSubset`] for the symbols.
pub(crate) struct NormalEquations {
    /// Mean of each Z, and its regression on f.
    pub(crate) projections: [[f64; 2]; MAX_PARAMETERS],
    /// Sum of f^2 without the noise's share.
    pub(crate) signal_energy: f64,
    /// Share of the gradient's energy that is not noise, the lesser of x and y.
    pub(crate) signal_share: f64,
    /// M.
    pub(crate) hessian: Matrix,
    /// M^-1, within what the shape function allows.
    pub(crate) inverse: Matrix,
    pub(crate) covariance: Box<UnitCovariance>,
}

impl NormalEquations {
    /// The equations of a shape function over `n_pixels`; `None` where the texture leaves a direction open.
    pub(crate) fn new(
        images: Images<'_>,
        shape: Shape,
        n_pixels: usize,
        noise: ReferenceNoise,
    ) -> Option<Self> {
        match shape.n_terms() {
            1 => Tables::<2>::new::<1>(images, n_pixels).equations(shape, noise),
            3 => Tables::<6>::new::<3>(images, n_pixels).equations(shape, noise),
            _ => Tables::<12>::new::<6>(images, n_pixels).equations(shape, noise),
        }
    }
}

/// The sums over a subset's pixels that the equations of `N` parameters consist of.
struct Tables<const N: usize> {
    n_pixels: f64,
    /// f f.
    energy: f64,
    /// Z_p and Z_p f.
    smooth: [f64; N],
    smooth_with_f: [f64; N],
    /// J_p and J_p f.
    plain: [f64; N],
    plain_with_f: [f64; N],
    /// Z_p Z_q.
    squares: [[f64; N]; N],
    /// Z_p J_q.
    mixed: [[f64; N]; N],
    /// Z_p Z_q of white noise whose gradient has unit variance, the same in x and y.
    unit_noise: [[f64; N]; N],
}

impl<const N: usize> Tables<N> {
    /// The sums for the first `N_TERMS` terms along each axis.
    fn new<const N_TERMS: usize>(images: Images<'_>, n_pixels: usize) -> Self {
        let order = const { TERMS[N_TERMS - 1][1] };
        let Images { places, intensity: f, ones, smooth: [x, y], plain: [plain_x, plain_y] } = images;
        let [of_ones] = moments(places, ones, [ones], 2 * order);
        let [of_x, of_y, of_plain_x, of_plain_y] = moments(places, ones, [x, y, plain_x, plain_y], order);
        let [ff, fx, fy, f_plain_x, f_plain_y] = moments(places, f, [f, x, y, plain_x, plain_y], order);
        let [xx, xy, x_plain_x, x_plain_y] = moments(places, x, [x, y, plain_x, plain_y], 2 * order);
        let [yy, y_plain_x, y_plain_y] = moments(places, y, [y, plain_x, plain_y], 2 * order);
        let nothing = [0.0; MAX_MONOMIALS];
        let column =
            |of_axis: [Moments; 2]| std::array::from_fn(|p| of_axis[p / N_TERMS][product(p % N_TERMS, 0)]);
        let table = |of_axes: [[Moments; 2]; 2]| {
            matrix(|p, q| of_axes[p / N_TERMS][q / N_TERMS][product(p % N_TERMS, q % N_TERMS)])
        };
        Self {
            n_pixels: n_pixels as f64,
            energy: ff[0],
            smooth: column([of_x, of_y]),
            smooth_with_f: column([fx, fy]),
            plain: column([of_plain_x, of_plain_y]),
            plain_with_f: column([f_plain_x, f_plain_y]),
            squares: table([[xx, xy], [xy, yy]]),
            mixed: table([[x_plain_x, x_plain_y], [y_plain_x, y_plain_y]]),
            unit_noise: table([[of_ones, nothing], [nothing, of_ones]]),
        }
    }

    fn equations(&self, shape: Shape, noise: ReferenceNoise) -> Option<NormalEquations> {
        let n = self.n_pixels;
        let signal_energy = self.energy - n * noise.variance;
        let projections: [[f64; 2]; N] =
            std::array::from_fn(|p| [self.smooth[p] / n, self.smooth_with_f[p] / signal_energy]);
        let projected =
            |p: usize, sum: f64, product: f64| projections[p][0] * sum + projections[p][1] * product;
        let hessian: [[f64; N]; N] = matrix(|p, q| {
            let slope = self.mixed[p][q] - projected(p, self.plain[q], self.plain_with_f[q]);
            slope - noise.variance * noise.overlap * self.unit_noise[p][q]
        });
        let of_noise = noise.variance * noise.gain;
        let gradient_noise: [[f64; N]; N] = matrix(|p, q| of_noise * self.unit_noise[p][q]);
        // Z' Z' = Z Z - (Z on 1 and f) - the same with p and q exchanged + (1 and f) (1 and f)
        let signal: [[f64; N]; N] = matrix(|p, q| {
            let back = projected(p, n * projections[q][0], self.energy * projections[q][1]);
            self.squares[p][q]
                - projected(p, self.smooth[q], self.smooth_with_f[q])
                - projected(q, self.smooth[p], self.smooth_with_f[p])
                + back
                - gradient_noise[p][q]
        });
        let inverse = invert_for(shape, &hessian)?;
        let through = |middle: &[[f64; N]; N]| resized(&covariance(&inverse, middle));
        let share = |p: usize| (self.squares[p][p] - n * of_noise) / self.squares[p][p];
        Some(NormalEquations {
            projections: std::array::from_fn(|p| projections.get(p).copied().unwrap_or_default()),
            signal_energy,
            signal_share: share(0).min(share(N / 2)),
            hessian: resized(&hessian),
            inverse: resized(&inverse),
            covariance: Box::new(UnitCovariance {
                signal: through(&signal),
                noise: through(&gradient_noise),
                n_terms: N / 2,
            }),
        })
    }
}

/// The monomial of the product of two terms.
fn product(a: usize, b: usize) -> usize {
    monomial(TERMS[a][0] + TERMS[b][0], TERMS[a][1] + TERMS[b][1])
}

fn matrix<const N: usize>(entry: impl Fn(usize, usize) -> f64) -> [[f64; N]; N] {
    std::array::from_fn(|p| std::array::from_fn(|q| entry(p, q)))
}

/// The first rows and columns of a matrix, or these and zeros.
fn resized<const FROM: usize, const TO: usize>(from: &[[f64; FROM]; FROM]) -> [[f64; TO]; TO] {
    matrix(|p, q| if p < FROM && q < FROM { from[p][q] } else { 0.0 })
}

/// The inverse of a shape function's Hessian ([`invert_for`]).
pub(crate) fn inverse_of(shape: Shape, hessian: &Matrix) -> Option<Matrix> {
    Some(match shape.n_terms() {
        1 => resized(&invert_for::<2>(shape, &resized(hessian))?),
        3 => resized(&invert_for::<6>(shape, &resized(hessian))?),
        _ => invert_for(shape, hessian)?,
    })
}

/// What each parameter of a rotation does to the affine parameters: u, v and the angle.
const OF_ROTATION: [(usize, usize, f64); 4] = [(0, 0, 1.0), (3, 1, 1.0), (2, 2, -1.0), (4, 2, 1.0)];

/// The inverse of the Hessian within what the shape function allows: for a rotation, whose parameters are u, v and the
/// angle, `C (C^T M C)^-1 C^T` with the columns of C being what each of them does to the affine parameters.
fn invert_for<const N: usize>(shape: Shape, hessian: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    if shape != Shape::Rigid {
        return invert(hessian);
    }
    let entries = || OF_ROTATION.iter().flat_map(|left| OF_ROTATION.iter().map(move |right| (left, right)));
    let mut reduced = [[0.0; 3]; 3];
    for ((p, i, left), (q, j, right)) in entries() {
        reduced[*i][*j] += left * hessian[*p][*q] * right;
    }
    let reduced = invert(&reduced)?;
    let mut inverse = [[0.0; N]; N];
    for ((p, i, left), (q, j, right)) in entries() {
        inverse[*p][*q] = left * reduced[*i][*j] * right;
    }
    Some(inverse)
}

/// Inverts the Hessian, scaled to a unit diagonal so that pixels and gradients weigh alike. `None` where the texture
/// leaves a direction open.
fn invert<const N: usize>(hessian: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let scale: [f64; N] = std::array::from_fn(|p| 1.0 / hessian[p][p].sqrt());
    if !scale.iter().all(|scale| scale.is_finite()) {
        return None;
    }
    let scaled = SMatrix::<f64, N, N>::from_fn(|p, q| scale[p] * hessian[p][q] * scale[q]).try_inverse()?;
    let largest = scaled.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    // Texture in one direction alone leaves a pivot that is rounding: 1e6 is far above any usable texture's.
    let is_usable = largest.is_finite() && largest < 1e6 * N as f64;
    is_usable.then(|| matrix(|p, q| scale[p] * scaled[(p, q)] * scale[q]))
}

/// M^-1 X M^-T.
fn covariance<const N: usize>(inverse: &[[f64; N]; N], middle: &[[f64; N]; N]) -> [[f64; N]; N] {
    inverse.map(|row| {
        let half: [f64; N] = std::array::from_fn(|q| {
            row.iter().zip(middle).map(|(inverse, middle)| inverse * middle[q]).sum()
        });
        inverse.each_ref().map(|row| half.iter().zip(row).map(|(half, inverse)| half * inverse).sum())
    })
}

/// Covariance of the parameters per unit variance of a pixel's noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct UnitCovariance {
    /// M^-1 S M^-T.
    pub(crate) signal: Matrix,
    /// M^-1 K M^-T.
    pub(crate) noise: Matrix,
    /// Terms of the shape function along each axis.
    n_terms: usize,
}

impl UnitCovariance {
    /// That of the displacement of the centre (xx, xy, yy), by the signal and by the noise.
    pub(crate) fn of_centre(&self) -> [[f64; 3]; 2] {
        let v = self.n_terms;
        [&self.signal, &self.noise].map(|full| [full[0][0], full[0][v], full[v][v]])
    }

    /// That of the displacement gradient (du/dx, du/dy, dv/dx, dv/dy) by the signal; of a shape function that has one.
    pub(crate) fn of_gradient(&self) -> [[f64; 4]; 4] {
        let places = [1, 2, self.n_terms + 1, self.n_terms + 2];
        places.map(|p| places.map(|q| self.signal[p][q]))
    }

    pub(crate) fn largest_signal(&self) -> f64 {
        let [[xx, _, yy], _] = self.of_centre();
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
        let place = axis * self.n_terms;
        let noise = self.noise[place][place] / self.signal[place][place];
        ((4.0 * noise + 2.0 * noise * noise) / n).sqrt()
    }
}
