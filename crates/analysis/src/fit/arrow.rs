use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix2, OMatrix, U2, Vector2};

/// A row of derivatives by the two unknowns that belong to one recording.
pub(super) type Own = Vector2<f64>;

/// Normal equations in which every recording has two unknowns of its own and all share a few: an arrow matrix, solved by
/// eliminating the recordings one by one (Schur complement).
#[derive(Debug, Clone)]
pub(super) struct ArrowEquations {
    shared: DMatrix<f64>,
    shared_side: DVector<f64>,
    recordings: Vec<Block>,
}

#[derive(Debug, Clone)]
struct Block {
    own: Matrix2<f64>,
    own_side: Own,
    /// Coupling of the shared unknowns (rows) with the recording's own.
    coupling: OMatrix<f64, Dyn, U2>,
}

/// A step in the shared unknowns and in each recording's own.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub(super) shared: DVector<f64>,
    pub(super) own: Vec<Own>,
}

/// What the equations say of the unknowns' errors.
pub(super) struct Covariance {
    /// Of the shared unknowns.
    pub(super) shared: DMatrix<f64>,
    /// Of each recording's own.
    pub(super) own: Vec<Matrix2<f64>>,
    /// Of the mean of the recordings' own.
    pub(super) mean_own: Matrix2<f64>,
}

impl ArrowEquations {
    pub(super) fn new(n_shared: usize, n_recordings: usize) -> Self {
        let block = Block {
            own: Matrix2::zeros(),
            own_side: Own::zeros(),
            coupling: OMatrix::<f64, Dyn, U2>::zeros(n_shared),
        };
        Self {
            shared: DMatrix::zeros(n_shared, n_shared),
            shared_side: DVector::zeros(n_shared),
            recordings: vec![block; n_recordings],
        }
    }

    /// Adds a residual of unit variance with its derivatives.
    pub(super) fn add(&mut self, recording: usize, residual: f64, shared: &DVector<f64>, own: &Own) {
        let block = &mut self.recordings[recording];
        self.shared.ger(1.0, shared, shared, 1.0);
        self.shared_side.axpy(-residual, shared, 1.0);
        block.own += own * own.transpose();
        block.own_side -= own * residual;
        block.coupling.ger(1.0, shared, own, 1.0);
    }

    /// Adds a residual of unit variance that depends on one shared unknown alone: a prior.
    pub(super) fn add_prior(&mut self, unknown: usize, residual: f64, slope: f64) {
        self.shared[(unknown, unknown)] += slope * slope;
        self.shared_side[unknown] -= slope * residual;
    }

    /// The step that solves the equations with every diagonal entry raised by the share `damping` (Marquardt 1963), and the
    /// square of its length in standard errors; `None` where the equations are singular.
    pub(super) fn solve(&self, damping: f64) -> Option<(Step, f64)> {
        let raised = self.raised(damping);
        let eliminated = raised.eliminated()?;
        let shared = eliminated.factor.solve(&eliminated.side);
        let own: Vec<Own> = raised
            .recordings
            .iter()
            .zip(&eliminated.inverses)
            .map(|(block, inverse)| inverse * (block.own_side - block.coupling.tr_mul(&shared)))
            .collect();
        let along = |block: &Block, own: &Own| block.own_side.dot(own);
        let length2 = self.shared_side.dot(&shared)
            + self.recordings.iter().zip(&own).map(|(block, own)| along(block, own)).sum::<f64>();
        Some((Step { shared, own }, length2))
    }

    /// The covariance of the unknowns; `None` where the equations are singular.
    pub(super) fn covariance(&self) -> Option<Covariance> {
        let eliminated = self.eliminated()?;
        let shared = eliminated.factor.inverse();
        let mut carried = OMatrix::<f64, U2, Dyn>::zeros(shared.nrows());
        let mut alone = Matrix2::zeros();
        let mut own = Vec::with_capacity(self.recordings.len());
        for (block, inverse) in self.recordings.iter().zip(&eliminated.inverses) {
            let by_shared = inverse * block.coupling.transpose();
            own.push(inverse + &by_shared * &shared * by_shared.transpose());
            carried += by_shared;
            alone += inverse;
        }
        let n = self.recordings.len() as f64;
        let mean_own = (alone + &carried * &shared * carried.transpose()) / (n * n);
        Some(Covariance { shared, own, mean_own })
    }

    fn raised(&self, damping: f64) -> Self {
        let mut raised = self.clone();
        let factor = 1.0 + damping;
        (0..raised.shared.nrows()).for_each(|i| raised.shared[(i, i)] *= factor);
        raised.recordings.iter_mut().for_each(|block| (0..2).for_each(|i| block.own[(i, i)] *= factor));
        raised
    }

    fn eliminated(&self) -> Option<Eliminated> {
        let (mut matrix, mut side) = (self.shared.clone(), self.shared_side.clone());
        let mut inverses = Vec::with_capacity(self.recordings.len());
        for block in &self.recordings {
            let inverse = block.own.cholesky()?.inverse();
            matrix -= &block.coupling * inverse * block.coupling.transpose();
            side -= &block.coupling * (inverse * block.own_side);
            inverses.push(inverse);
        }
        Some(Eliminated { factor: matrix.cholesky()?, side, inverses })
    }
}

/// The equations of the shared unknowns alone, and the inverse of each recording's own block.
struct Eliminated {
    factor: Cholesky<f64, Dyn>,
    side: DVector<f64>,
    inverses: Vec<Matrix2<f64>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three recordings and two shared unknowns, against the same least squares as one dense matrix.
    #[test]
    fn elimination_gives_the_dense_solution() {
        let (n_shared, n_recordings) = (2, 3);
        let mut arrow = ArrowEquations::new(n_shared, n_recordings);
        let mut rows = Vec::new();
        let mut side = Vec::new();
        for k in 0..24_u32 {
            let wave = |i: u32| ((1.7 + 0.37 * f64::from(i)) * f64::from(k) + 0.9 * f64::from(i * i)).sin();
            let recording = k as usize % n_recordings;
            let (shared, own) = (DVector::from_vec(vec![wave(1), wave(2)]), Own::new(wave(3), wave(4)));
            arrow.add(recording, wave(5), &shared, &own);
            let mut row = vec![0.0; n_shared + 2 * n_recordings];
            row[..2].copy_from_slice(shared.as_slice());
            row[2 + 2 * recording..4 + 2 * recording].copy_from_slice(own.as_slice());
            rows.extend(row);
            side.push(-wave(5));
        }
        let dense = DMatrix::from_row_slice(24, n_shared + 2 * n_recordings, &rows);
        let inverse = (dense.transpose() * &dense).try_inverse().unwrap();
        let expected = &inverse * dense.transpose() * DVector::from_vec(side);
        let (step, _) = arrow.solve(0.0).unwrap();
        let covariance = arrow.covariance().unwrap();
        let own = |unknown: usize| n_shared + unknown;
        // Rounding, times a condition number of some tens.
        for i in 0..n_shared {
            assert!((step.shared[i] - expected[i]).abs() < 1e-12);
            assert!((covariance.shared[(i, i)] - inverse[(i, i)]).abs() < 1e-12);
        }
        for r in 0..n_recordings {
            assert!((step.own[r][1] - expected[own(2 * r + 1)]).abs() < 1e-12);
            assert!((covariance.own[r][(0, 1)] - inverse[(own(2 * r), own(2 * r + 1))]).abs() < 1e-12);
        }
        let pairs = (0..n_recordings).flat_map(|r| (0..n_recordings).map(move |q| (own(2 * r), own(2 * q))));
        let mean: f64 = pairs.map(|at| inverse[at]).sum::<f64>() / 9.0;
        assert!((covariance.mean_own[(0, 0)] - mean).abs() < 1e-12);
    }
}
