//! Recordings that are tied by errors which their readings share: the amplitudes of these, of unit variance each.

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, U2};

use super::block::{Block, Eliminated};

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
    /// Of recordings whose blocks have the same errors.
    pub(super) fn of(blocks: &[&Block], recordings: Vec<usize>) -> Self {
        let n = blocks.first().map_or(0, |block| block.n_errors);
        let (mut matrix, mut side) = (DMatrix::identity(n, n), DVector::zeros(n));
        for block in blocks {
            let first = block.first_error();
            for i in 0..n {
                side[i] -= block.product(first + i, first - 1);
                for j in 0..n {
                    matrix[(i, j)] += block.product(first + i, first + j);
                }
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
    pub(super) fn eliminated(&self, recordings: &[Eliminated], weight: impl Fn(usize) -> f64) -> TiedErrors {
        let n = self.amplitudes.len();
        let width = self.recordings.first().map_or(n + 1, |r| recordings[*r].products.nrows());
        let mut all = DMatrix::zeros(width, width);
        self.recordings.iter().for_each(|r| all += &recordings[*r].products * weight(*r));
        let (first, last) = (width - 1 - n, width - 1);
        for (k, amplitude) in self.amplitudes.iter().enumerate() {
            all[(first + k, first + k)] += 1.0;
            all[(first + k, last)] += amplitude;
            all[(last, first + k)] += amplitude;
        }
        let kept = |i: usize| if i < first { i } else { last };
        let covariance = all.view((first, first), (n, n)).into_owned().cholesky();
        let covariance =
            covariance.map_or_else(|| DMatrix::from_element(n, n, f64::NAN), |factor| factor.inverse());
        let coupling = DMatrix::from_fn(n, first + 1, |k, i| all[(first + k, kept(i))]);
        let by_rest = -(&covariance * &coupling);
        let rest = DMatrix::from_fn(first + 1, first + 1, |i, j| all[(kept(i), kept(j))]);
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
            false => self.tie.eliminated(recordings, weight).products,
        }
    }

    /// Derivatives of the amplitudes by the shared unknowns.
    pub(super) fn by_shared(&self) -> DMatrix<f64> {
        self.by_rest.columns(0, self.by_rest.ncols() - 1).into_owned()
    }

    /// A step of the shared unknowns, and of the amplitudes with them.
    pub(super) fn with_errors(&self, shared: &DVector<f64>) -> DVector<f64> {
        let step = &self.by_rest * shared.clone().push(1.0);
        DVector::from_iterator(shared.len() + step.len(), shared.iter().chain(step.iter()).copied())
    }

    /// Covariance that the amplitudes' own errors carry into what depends on them.
    pub(super) fn carried(&self, by: &OMatrix<f64, U2, Dyn>) -> Matrix2<f64> {
        by * &self.covariance * by.transpose()
    }
}
