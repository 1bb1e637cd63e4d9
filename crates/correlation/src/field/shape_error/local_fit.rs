//! The displacement around a point as a polynomial of which the matches of its neighbours are what they are.
//!
//! Each match gives `u_i = sum K_i(x) u(X_i + x)` and noise, with the moments of K_i known
//! ([`crate::prepared::response`]). For a polynomial u its coefficients follow by least squares, and from them the systematic error of
//! the point's own match. Both the second order and the fourth are taken: what the latter adds tells how the series goes on.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::Shape;
use crate::field::overlap::noise_correlation;
use crate::prepared::moments::{MAX_MONOMIALS, monomial};
use crate::prepared::response::Response;

/// Monomials up to the second order, and neighbours from which on they are told.
const N_SECOND: usize = 6;
const LEAST_FOR_SECOND: usize = 8;
/// Neighbours from which on the fourth order is told: half as many more as it has monomials.
pub(super) const LEAST_FOR_FOURTH: usize = 22;

/// What one point of a field says of the displacement around another.
pub(super) struct Neighbour<'a> {
    /// From the point in question, in the reference.
    pub(super) offset_px: [f64; 2],
    pub(super) u_px: [f64; 2],
    pub(super) sigma_px: [f64; 2],
    pub(super) shape: Shape,
    pub(super) response: &'a Response,
}

/// Estimates of the systematic error of a match along one axis, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LocalError {
    /// By a polynomial of second order, and what the fourth adds.
    pub(super) parts_px: [f64; 2],
    /// By the second order, were the texture equal everywhere and the shape function affine.
    pub(super) of_affine_px: f64,
    /// Covariance of the noise of the two parts.
    pub(super) covariance: [[f64; 2]; 2],
    /// Variance of the noise of `of_affine_px`.
    pub(super) variance_of_affine: f64,
    /// Covariance of the noise of the parts with that of the match itself.
    pub(super) with_own: [f64; 2],
    /// Whether the neighbours tell the fourth order: else the second part is zero and says nothing.
    pub(super) has_fourth: bool,
    /// How far the point lies aside of the middle of its neighbours, as a share of their reach: 1 in the outermost row of a field.
    pub(super) aside: f64,
}

/// The displacement around a point, of the highest order that its neighbours tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Polynomial {
    /// Coefficients of the monomials of places over the reach, of u and of v, in pixels.
    coefficients_px: [[f64; MAX_MONOMIALS]; 2],
    reach_px: f64,
}

impl Polynomial {
    /// The displacement along x and y at a place from the point, in pixels.
    pub(super) fn at(&self, from_point_px: [f64; 2]) -> [f64; 2] {
        let [x, y] = from_point_px.map(|offset| offset / self.reach_px);
        let powers = |x: f64| [1.0, x, x * x, x * x * x, x * x * x * x];
        let (of_x, of_y) = (powers(x), powers(y));
        let mut sums = [0.0; 2];
        for_each_monomial(|i, j| {
            let value = of_x[i] * of_y[j];
            (0..2).for_each(|axis| sums[axis] += value * self.coefficients_px[axis][monomial(i, j)]);
        });
        sums
    }
}

/// The errors along x and y of the match of the neighbour that is `own`, and what they follow from; `None` where too few surround it.
/// `reach_px` is how far they go, and `side_px` the side of a subset.
pub(super) fn local_error(
    neighbours: &[Neighbour<'_>],
    own: usize,
    reach_px: f64,
    side_px: f64,
) -> Option<([LocalError; 2], Polynomial)> {
    if neighbours.len() < LEAST_FOR_SECOND {
        return None;
    }
    let design = Design::new(neighbours, own, reach_px);
    let of_second = design.fit(N_SECOND)?;
    let second = of_second.functionals(&design.own)?;
    let of_affine = of_second.functionals(&design.of_affine(side_px))?;
    let [x, y] = [0, 1].map(|axis| neighbours.iter().map(|neighbour| neighbour.offset_px[axis]).sum::<f64>());
    let aside = x.abs().max(y.abs()) / neighbours.len() as f64 / reach_px;
    let of_fourth = (neighbours.len() >= LEAST_FOR_FOURTH).then(|| design.fit(MAX_MONOMIALS)).flatten();
    let fourth = of_fourth.as_ref().and_then(|fit| fit.functionals(&design.own));
    let has_fourth = fourth.is_some();
    let highest = of_fourth.filter(|_| has_fourth).unwrap_or(of_second);
    let beyond = fourth.map_or_else(|| DMatrix::zeros(second.nrows(), 2), |fourth| fourth - &second);
    let covariance = noise_covariance(neighbours, side_px);
    let through = [&second, &beyond, &of_affine].map(|weights| &covariance * weights);
    let displacement = |k: usize| neighbours[k / 2].u_px[k % 2] - neighbours[own].u_px[k % 2];
    let polynomial = Polynomial {
        coefficients_px: highest
            .coefficients(&DVector::from_fn(2 * neighbours.len(), |k, _| displacement(k))),
        reach_px,
    };
    let errors = [0, 1].map(|component| {
        let value = |weights: &DMatrix<f64>| -> f64 {
            weights.column(component).iter().enumerate().map(|(k, weight)| weight * displacement(k)).sum()
        };
        let product = |weights: &DMatrix<f64>, through: &DMatrix<f64>| {
            weights.column(component).dot(&through.column(component))
        };
        let mixed = product(&second, &through[1]);
        LocalError {
            parts_px: [value(&second), value(&beyond)],
            of_affine_px: value(&of_affine),
            covariance: [[product(&second, &through[0]), mixed], [mixed, product(&beyond, &through[1])]],
            variance_of_affine: product(&of_affine, &through[2]),
            with_own: [0, 1].map(|part| through[part][(2 * own + component, component)]),
            has_fourth,
            aside,
        }
    });
    Some((errors, polynomial))
}

/// Covariance of the neighbours' noise; row and column 2 i + axis is the displacement of the i-th along an axis.
fn noise_covariance(neighbours: &[Neighbour<'_>], side_px: f64) -> DMatrix<f64> {
    let n = neighbours.len();
    let mut covariance = DMatrix::zeros(2 * n, 2 * n);
    for (i, a) in neighbours.iter().enumerate() {
        for (j, b) in neighbours[..=i].iter().enumerate() {
            let apart = [0, 1].map(|axis| a.offset_px[axis] - b.offset_px[axis]);
            let shared = noise_correlation([a.shape, b.shape], apart, side_px);
            for axis in 0..2 {
                let value = shared * a.sigma_px[axis] * b.sigma_px[axis];
                covariance[(2 * i + axis, 2 * j + axis)] = value;
                covariance[(2 * j + axis, 2 * i + axis)] = value;
            }
        }
    }
    covariance
}

/// What polynomials in x and y over the reach make of the matches.
struct Design {
    /// Of u in the first columns, of v in the others; rows as in [`noise_covariance`].
    of_monomials: DMatrix<f64>,
    /// What a row weighs: less where sigma is larger than usual, and no more where it is smaller, since what is left of the field
    /// weighs on all alike.
    weights: Vec<f64>,
    /// What the monomials make of the match in question beyond their value at its centre.
    own: [[f64; 2 * MAX_MONOMIALS]; 2],
    reach_px: f64,
}

impl Design {
    fn new(neighbours: &[Neighbour<'_>], own: usize, reach_px: f64) -> Self {
        let n = neighbours.len();
        let mut of_monomials = DMatrix::zeros(2 * n, 2 * MAX_MONOMIALS);
        for (i, neighbour) in neighbours.iter().enumerate() {
            let offset = neighbour.offset_px.map(|offset| offset / reach_px);
            for component in 0..2 {
                for axis in 0..2 {
                    let moments = scaled(&neighbour.response.moments[component][axis], reach_px);
                    let moved = moved(&moments, offset);
                    for (k, value) in moved.into_iter().enumerate() {
                        of_monomials[(2 * i + component, axis * MAX_MONOMIALS + k)] = value;
                    }
                }
            }
        }
        let variances: Vec<f64> =
            neighbours.iter().flat_map(|neighbour| neighbour.sigma_px.map(|sigma| sigma * sigma)).collect();
        let usual = variances.iter().sum::<f64>() / variances.len() as f64;
        let own = [0, 1].map(|component| {
            std::array::from_fn(|k| match k % MAX_MONOMIALS {
                0 => 0.0,
                _ => of_monomials[(2 * own + component, k)],
            })
        });
        let weights = variances.into_iter().map(|variance| (variance + usual).recip()).collect();
        Self { weights, own, of_monomials, reach_px }
    }

    /// What the second order makes of an affine subset of equal texture: the mean of x^2 and y^2 over its pixels.
    fn of_affine(&self, side_px: f64) -> [[f64; 2 * MAX_MONOMIALS]; 2] {
        let mean_square = (side_px * side_px - 1.0) / 12.0 / self.reach_px.powi(2);
        [0, 1].map(|component| {
            let mut of_monomials = [0.0; 2 * MAX_MONOMIALS];
            for square in [monomial(2, 0), monomial(0, 2)] {
                of_monomials[component * MAX_MONOMIALS + square] = mean_square;
            }
            of_monomials
        })
    }

    /// The least squares of the first monomials; `None` where the matches do not tell them.
    fn fit(&self, n_monomials: usize) -> Option<Fit> {
        let place = |k: usize| k / n_monomials * MAX_MONOMIALS + k % n_monomials;
        let columns: Vec<usize> = (0..2 * n_monomials).map(place).collect();
        let design = self.of_monomials.select_columns(&columns);
        let mut weighted = design.clone();
        for (mut row, weight) in weighted.row_iter_mut().zip(&self.weights) {
            row *= *weight;
        }
        let normal = design.tr_mul(&weighted).cholesky()?;
        Some(Fit { columns, weighted, normal })
    }
}

/// The normal equations of some monomials.
struct Fit {
    /// Where the monomials stand among all of u and v.
    columns: Vec<usize>,
    weighted: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
}

impl Fit {
    /// The weights of the matches in two sums of the coefficients; `None` where the matches do not tell them.
    fn functionals(&self, sums: &[[f64; 2 * MAX_MONOMIALS]; 2]) -> Option<DMatrix<f64>> {
        let sums = DMatrix::from_fn(self.columns.len(), 2, |k, component| sums[component][self.columns[k]]);
        let functionals = &self.weighted * self.normal.solve(&sums);
        functionals.iter().all(|weight| weight.is_finite()).then_some(functionals)
    }

    /// The coefficients of all monomials by what the matches displaced.
    fn coefficients(&self, displacements_px: &DVector<f64>) -> [[f64; MAX_MONOMIALS]; 2] {
        let found = self.normal.solve(&self.weighted.tr_mul(displacements_px));
        let mut coefficients = [[0.0; MAX_MONOMIALS]; 2];
        for (&column, &value) in self.columns.iter().zip(found.iter()) {
            coefficients[column / MAX_MONOMIALS][column % MAX_MONOMIALS] = value;
        }
        coefficients
    }
}

/// Moments of places in units of a length.
fn scaled(moments: &[f64; MAX_MONOMIALS], unit_px: f64) -> [f64; MAX_MONOMIALS] {
    let mut scaled = *moments;
    for_each_monomial(|i, j| scaled[monomial(i, j)] *= unit_px.powi(-((i + j) as i32)));
    scaled
}

/// Moments about a point from which the centre is offset: the mean of `(a + x)^i (b + y)^j`.
fn moved(moments: &[f64; MAX_MONOMIALS], [a, b]: [f64; 2]) -> [f64; MAX_MONOMIALS] {
    /// Pascal's triangle.
    const BINOMIALS: [[f64; 5]; 5] = [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 1.0, 0.0, 0.0, 0.0],
        [1.0, 2.0, 1.0, 0.0, 0.0],
        [1.0, 3.0, 3.0, 1.0, 0.0],
        [1.0, 4.0, 6.0, 4.0, 1.0],
    ];
    let powers = |x: f64| [1.0, x, x * x, x * x * x, x * x * x * x];
    let (a, b) = (powers(a), powers(b));
    let mut moved = [0.0; MAX_MONOMIALS];
    for_each_monomial(|i, j| {
        for p in 0..=i {
            for q in 0..=j {
                let factor = BINOMIALS[i][p] * a[i - p] * BINOMIALS[j][q] * b[j - q];
                moved[monomial(i, j)] += factor * moments[monomial(p, q)];
            }
        }
    });
    moved
}

fn for_each_monomial(mut visit: impl FnMut(usize, usize)) {
    for order in 0..=4 {
        for j in 0..=order {
            visit(order - j, j);
        }
    }
}
