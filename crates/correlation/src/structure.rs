//! What residuals that are alike in neighbouring pixels do to a place.
//!
//! [`crate::uncertainty`] takes each pixel's residual for independent of its neighbours'. But rows and columns of a sensor have noise and
//! offsets of their own, blots and reflections are larger than a pixel, and so is the block of a compressed picture. Let a be what a unit of
//! each pixel's grey value displaces the centre by (`M^-1 Z'`). Then the displacement has the variance
//!
//! `T = sum over lags of R(lag) A(lag)`, R the autocovariance of the residual for a pair of pixels, A the sum of the products of a,
//!
//! of which lag zero alone counts where pixels are independent: the sandwich that is consistent with errors that are alike (W. K. Newey, K. D.
//! West, Econometrica 55 (1987) 703-708; in a plane, T. G. Conley, J. Econom. 92 (1999) 1-45). A match takes from its residual whatever
//! resembles the images that it fits, of which a is made, so even of white noise T finds too little: with W the quadratic form that T is
//! of the residual, and u these images made orthonormal, `tr W - sum u^T W u` in place of `tr W`. T is enlarged by that share.

use crate::PreparedSubset;
use crate::prepared::moments::TERMS;
use crate::prepared::steps::Steps;
use crate::simd::LANES;
use crate::warp::Warp;

/// Lags along each axis, in pixels, at most: the gradients of speckles up to 6 px wide are alike over no more.
const REACH_PX: usize = 6;
/// Lags of which none is the negative of another one: those of the rows below, and of the own row to the right.
const N_LAGS: usize = 1 + REACH_PX + REACH_PX * (2 * REACH_PX + 1);
/// Share of T that is left at least: where so few pixels are fitted by so much, nothing tells how they are alike.
const LEAST_LEFT: f64 = 0.5;
/// An image of which the others leave less than this share of its square is made of them.
const DEPENDENT: f64 = 1e-6;

/// The variance of a subset's centre by the autocovariance of its residual.
pub(crate) struct Structure {
    n_columns: usize,
    /// Products of two pixels at each lag to the variance of the displacement: xx, xy and yy, in square pixels a square count.
    weights: [[f64; N_LAGS]; 3],
    /// Relative standard deviation, for x and y, of the variance that one match's white residuals give.
    pub(crate) scatter: [f64; 2],
}

impl Structure {
    /// Of a subset's place, by residuals that a match with the shape function of `fitted` leaves.
    pub(crate) fn of(subset: &PreparedSubset, fitted: &PreparedSubset) -> Self {
        Self::of_steps(Steps::of(subset).by_pixel(), fitted)
    }

    /// Of the difference between the places of two subsets that differ in their shape functions, by residuals that the richer one leaves.
    pub(crate) fn of_difference(subset: &PreparedSubset, richer: &PreparedSubset) -> Self {
        let [mut along_x, mut along_y] = Steps::of(richer).by_pixel();
        let of_subset = Steps::of(subset).by_pixel();
        for (steps, others) in [&mut along_x, &mut along_y].into_iter().zip(of_subset) {
            steps.iter_mut().zip(others).for_each(|(step, other)| *step -= other);
        }
        Self::of_steps([along_x, along_y], richer)
    }

    fn of_steps([along_x, along_y]: [Vec<f32>; 2], fitted: &PreparedSubset) -> Self {
        let both: Vec<f32> = along_x.iter().zip(&along_y).map(|(x, y)| x + y).collect();
        let products = |image: &[f32]| products(image, fitted.width);
        let [xx, both, yy] = [&along_x, &both, &along_y].map(|image| products(image));
        let xy = std::array::from_fn(|lag| 0.5 * (both[lag] - xx[lag] - yy[lag]));
        let n_pairs = products(&fitted.weights[..fitted.n_pixels()]);
        let of_fitted: Vec<[f64; N_LAGS]> =
            orthonormal(fitted.fitted_images()).iter().map(|image| products(image)).collect();
        let mut weights = [xx, xy, yy].map(|of_steps| {
            let mut weights = [0.0; N_LAGS];
            for (lag, weight) in weights.iter_mut().enumerate() {
                let both_ways = if lag == 0 { 1.0 } else { 2.0 };
                *weight = both_ways * of_steps[lag] / n_pairs[lag].max(1.0);
            }
            weights
        });
        let left = |weights: &[f64; N_LAGS]| {
            let taken: f64 = of_fitted.iter().map(|image| sum(weights, image)).sum();
            (1.0 - taken / (weights[0] * n_pairs[0])).max(LEAST_LEFT)
        };
        let (of_x, of_y) = (left(&weights[0]), left(&weights[2]));
        for (weights, left) in weights.iter_mut().zip([of_x, (of_x * of_y).sqrt(), of_y]) {
            weights.iter_mut().for_each(|weight| *weight /= left);
        }
        // The variance of r^T W r is 2 tr W^2; a lag's weight is that of both its signs.
        let scatter = [0, 2].map(|axis| {
            let square = |lag: usize| {
                let both_ways = if lag == 0 { 1.0 } else { 2.0 };
                weights[axis][lag].powi(2) * n_pairs[lag] / both_ways
            };
            (2.0 * (0..N_LAGS).map(square).sum::<f64>()).sqrt() / (weights[axis][0] * n_pairs[0])
        });
        Self { n_columns: fitted.width, weights, scatter }
    }

    /// Variance of the place along x and y in the target, in square pixels, of a match that leaves `residuals` (counts of the target, of all
    /// pixels of the subset, 0 where it uses none) with a gain of the target over the reference.
    pub(crate) fn variance_px2(&self, warp: &Warp, residuals: &[f32], gain: f64) -> [f64; 2] {
        let products = products(residuals, self.n_columns);
        let [xx, xy, yy] = self.weights.each_ref().map(|weights| sum(weights, &products) / gain.powi(2));
        warp.variances_in_target([xx, xy, yy])
    }
}

fn sum(weights: &[f64; N_LAGS], products: &[f64; N_LAGS]) -> f64 {
    weights.iter().zip(products).map(|(weight, product)| weight * product).sum()
}

/// The sum of the products of pixels of an image at each lag.
fn products(image: &[f32], n_columns: usize) -> [f64; N_LAGS] {
    // With zeros between rows, pixels at a lag are a constant number of places apart.
    let stride = n_columns + REACH_PX;
    let n = (image.len() / n_columns * stride).next_multiple_of(LANES);
    let mut spaced = vec![0.0_f32; n + REACH_PX * (stride + 1)];
    for (to, from) in spaced.chunks_mut(stride).zip(image.chunks_exact(n_columns)) {
        to[..n_columns].copy_from_slice(from);
    }
    let below = (1..=REACH_PX).flat_map(|row| (0..=2 * REACH_PX).map(move |column| row * stride + column));
    let places = (0..=REACH_PX).chain(below.map(|place| place - REACH_PX));
    let mut sums = [0.0; N_LAGS];
    for (total, place) in sums.iter_mut().zip(places) {
        *total = f64::from(dot(&spaced[..n], &spaced[place..place + n]));
    }
    sums
}

/// As [`crate::simd::dot`], in f32: what a lag's sum is off by is far below what it scatters by.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    chainwave_vectors::dispatch_loop(
        #[inline(always)]
        || {
            let mut lanes = [0.0_f32; LANES];
            for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b.as_chunks::<LANES>().0) {
                for i in 0..LANES {
                    lanes[i] = a[i].mul_add(b[i], lanes[i]);
                }
            }
            lanes.iter().sum()
        },
    )
}

/// Images that span what the given ones do, orthogonal and with squares that add to 1 (modified Gram-Schmidt).
pub(crate) fn orthonormal(images: Vec<Vec<f32>>) -> Vec<Vec<f32>> {
    let mut basis: Vec<Vec<f32>> = Vec::new();
    for mut image in images {
        let before = crate::simd::dot(&image, &image);
        for known in &basis {
            let share = crate::simd::dot(known, &image) as f32;
            image.iter_mut().zip(known).for_each(|(value, known)| *value -= share * known);
        }
        let square = crate::simd::dot(&image, &image);
        if square > DEPENDENT * before {
            image.iter_mut().for_each(|value| *value = (f64::from(*value) / square.sqrt()) as f32);
            basis.push(image);
        }
    }
    basis
}

impl PreparedSubset {
    /// What a match fits to the target: light, the reference, and its derivatives by the parameters.
    pub(crate) fn fitted_images(&self) -> Vec<Vec<f32>> {
        let n = self.n_pixels();
        let light = [&self.weights[..n], &self.intensity[..n]].map(<[f32]>::to_vec);
        let terms = &TERMS[..self.settings.shape.n_terms()];
        let slopes = [&self.gradient_x, &self.gradient_y];
        let derivatives = slopes.into_iter().flat_map(|slope| {
            terms.iter().map(|[i, j]| {
                let places = self.columns.iter().zip(self.rows.iter());
                let of_pixel =
                    |(slope, (x, y)): (&f32, (&f32, &f32))| slope * x.powi(*i as i32) * y.powi(*j as i32);
                slope[..n].iter().zip(places).map(of_pixel).collect()
            })
        });
        light.into_iter().chain(derivatives).collect()
    }
}
