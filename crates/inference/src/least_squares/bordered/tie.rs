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
    recordings: Vec<usize>,
    /// Products of the amplitudes with the shared unknowns and, last, the residual.
    coupling: DMatrix<f64>,
    /// Step of the amplitudes by the shared unknowns and, last, without any of these.
    by_rest: DMatrix<f64>,
    /// Covariance of the amplitudes, the shared unknowns held.
    covariance: DMatrix<f64>,
}

impl Tie {
    /// Of recordings that have some of so many errors each.
    pub(super) fn of(blocks: &[&Block], recordings: Vec<usize>, n: usize) -> Self {
        let (mut matrix, mut side) = (DMatrix::identity(n, n), DVector::zeros(n));
        for block in blocks {
            let (by_residual, by_errors) = (block.errors_by_residual(), block.errors_by_errors());
            for (i, error) in block.errors.iter().enumerate() {
                side[*error] -= by_residual[i];
                let others = block.errors.iter().enumerate();
                others.for_each(|(j, other)| matrix[(*error, *other)] += by_errors[(i, j)]);
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

    /// Eliminates the amplitudes behind the recordings' own unknowns.
    pub(super) fn eliminated(&self, recordings: &[Eliminated], n_shared: usize) -> TiedErrors {
        let n = self.amplitudes.len();
        let mut coupling = DMatrix::zeros(n, n_shared + 1);
        let mut of_errors = DMatrix::identity(n, n);
        coupling.set_column(n_shared, &self.amplitudes);
        for recording in self.recordings.iter().map(|r| &recordings[*r]) {
            let (by_shared, by_errors) = (recording.errors_by_shared(), recording.errors_by_errors());
            for (i, error) in recording.errors.iter().enumerate() {
                let mut row = coupling.row_mut(*error);
                row += by_shared.row(i);
                let others = recording.errors.iter().enumerate();
                others.for_each(|(j, other)| of_errors[(*error, *other)] += by_errors[(i, j)]);
            }
        }
        let covariance = of_errors
            .cholesky()
            .map_or_else(|| DMatrix::from_element(n, n, f64::NAN), |factor| factor.inverse());
        let by_rest = -(&covariance * &coupling);
        TiedErrors { recordings: self.recordings.clone(), coupling, by_rest, covariance }
    }
}

impl TiedErrors {
    /// The recordings that share them.
    pub(super) fn recordings(&self) -> &[usize] {
        &self.recordings
    }

    pub(super) fn n_errors(&self) -> usize {
        self.covariance.nrows()
    }

    /// What the amplitudes take out of the products over the shared unknowns and the residual.
    pub(super) fn taken_out(&self) -> DMatrix<f64> {
        -(self.coupling.transpose() * &self.by_rest)
    }

    /// Products of a recording's residual with the shared unknowns, the amplitudes going with these.
    pub(super) fn score(&self, recording: &Eliminated) -> DVector<f64> {
        let by_residual = recording.errors_by_residual();
        let of_errors = recording.errors.iter().zip(&by_residual);
        let of_its_own = recording.score();
        of_errors.fold(of_its_own, |score, (error, by_residual)| {
            let by_shared = self.by_rest.row(*error).transpose();
            score + by_shared.rows(0, by_shared.len() - 1) * *by_residual
        })
    }

    /// Derivatives of the amplitudes by the shared unknowns.
    pub(super) fn by_shared(&self) -> DMatrix<f64> {
        self.by_rest.columns(0, self.by_rest.ncols() - 1).into_owned()
    }

    /// The step of the amplitudes that goes with one of the shared unknowns.
    pub(super) fn amplitude_steps(&self, shared: &DVector<f64>) -> DVector<f64> {
        &self.by_rest * with_residual(shared)
    }

    /// Covariance of the amplitudes: their own, and what the shared unknowns, of the given covariance, carry into them.
    pub(super) fn amplitude_covariance(&self, shared: &DMatrix<f64>) -> DMatrix<f64> {
        let by_shared = self.by_shared();
        &self.covariance + &by_shared * shared * by_shared.transpose()
    }

    /// Covariance of the amplitudes, the shared unknowns held.
    pub(super) fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// Covariance that the amplitudes' own errors carry into what depends on them.
    pub(super) fn carried(&self, by: &OMatrix<f64, U2, Dyn>) -> Matrix2<f64> {
        by * &self.covariance * by.transpose()
    }
}
