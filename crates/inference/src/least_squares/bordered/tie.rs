//! Recordings that are tied by errors which their readings share: the amplitudes of these, of unit variance each.

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, U2};

use super::block::{Block, Eliminated, with_residual};

/// Recordings whose readings share errors, where the unknowns are.
#[derive(Debug, Clone)]
pub(super) struct Tie {
    recordings: Vec<usize>,
    /// How large the errors are, all other unknowns held.
    pub(super) amplitudes: DVector<f64>,
    /// How many of them the readings tell and their prior does not.
    pub(super) n_told: f64,
}

/// The errors of a tie behind the elimination of their amplitudes.
#[derive(Debug, Clone)]
pub(super) struct TiedErrors {
    tie: Tie,
    /// Step of the amplitudes by the shared unknowns and, last, without any of these.
    by_rest: DMatrix<f64>,
    /// Covariance of the amplitudes, the shared unknowns held.
    covariance: DMatrix<f64>,
    /// Products over the shared unknowns and last the residual.
    products: DMatrix<f64>,
}

impl Tie {
    /// Of recordings that have some of so many errors each.
    pub(super) fn of(blocks: &[&Block], recordings: Vec<usize>, n: usize) -> Self {
        let (mut matrix, mut side) = (DMatrix::identity(n, n), DVector::zeros(n));
        for block in blocks {
            let errors = || block.errors.iter().zip(block.first_error()..);
            for (error, i) in errors() {
                side[*error] -= block.product(i, block.residual());
                errors().for_each(|(other, j)| matrix[(*error, *other)] += block.product(i, j));
            }
        }
        // Unit variances beside sums of squares are positive definite; what is no number stays none.
        let inverse = matrix
            .cholesky()
            .map_or_else(|| DMatrix::from_element(n, n, f64::NAN), |factor| factor.inverse());
        Self { recordings, amplitudes: &inverse * side, n_told: n as f64 - inverse.trace() }
    }

    /// What their prior adds to the sum of squares.
    pub(super) fn chi_squared(&self) -> f64 {
        self.amplitudes.norm_squared()
    }

    /// Eliminates the amplitudes behind the recordings' own unknowns, each recording with its weight.
    pub(super) fn eliminated(
        &self,
        recordings: &[Eliminated],
        n_shared: usize,
        weight: impl Fn(usize) -> f64,
    ) -> TiedErrors {
        let n = self.amplitudes.len();
        let n_rest = n_shared + 1;
        let mut rest = DMatrix::zeros(n_rest, n_rest);
        let mut coupling = DMatrix::zeros(n, n_rest);
        let mut of_errors = DMatrix::identity(n, n);
        coupling.set_column(n_shared, &self.amplitudes);
        for r in &self.recordings {
            let (Eliminated { errors, products, .. }, weight) = (&recordings[*r], weight(*r));
            rest += products.view((0, 0), (n_rest, n_rest)) * weight;
            for (error, i) in errors.iter().zip(n_rest..) {
                let mut row = coupling.row_mut(*error);
                row += products.view((i, 0), (1, n_rest)) * weight;
                for (other, j) in errors.iter().zip(n_rest..) {
                    of_errors[(*error, *other)] += weight * products[(i, j)];
                }
            }
        }
        let covariance = of_errors
            .cholesky()
            .map_or_else(|| DMatrix::from_element(n, n, f64::NAN), |factor| factor.inverse());
        let by_rest = -(&covariance * &coupling);
        TiedErrors {
            tie: self.clone(),
            products: rest + coupling.transpose() * &by_rest,
            by_rest,
            covariance,
        }
    }
}

impl TiedErrors {
    /// The recordings that share them.
    pub(super) fn recordings(&self) -> &[usize] {
        &self.tie.recordings
    }

    pub(super) fn n_errors(&self) -> usize {
        self.covariance.nrows()
    }

    /// Their products, each recording with its weight.
    pub(super) fn weighted_products(
        &self,
        recordings: &[Eliminated],
        weight: impl Fn(usize) -> f64,
    ) -> DMatrix<f64> {
        match self.recordings().iter().all(|r| weight(*r).to_bits() == 1.0_f64.to_bits()) {
            true => self.products.clone(),
            false => self.tie.eliminated(recordings, self.products.nrows() - 1, weight).products,
        }
    }

    /// Derivatives of the amplitudes by the shared unknowns.
    pub(super) fn by_shared(&self) -> DMatrix<f64> {
        self.by_rest.columns(0, self.by_rest.ncols() - 1).into_owned()
    }

    /// The step of the amplitudes that goes with one of the shared unknowns.
    pub(super) fn amplitude_steps(&self, shared: &DVector<f64>) -> DVector<f64> {
        &self.by_rest * with_residual(shared)
    }

    /// Covariance that the amplitudes' own errors carry into what depends on them.
    pub(super) fn carried(&self, by: &OMatrix<f64, U2, Dyn>) -> Matrix2<f64> {
        by * &self.covariance * by.transpose()
    }
}
