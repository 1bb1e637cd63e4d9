//! The normal equations: a bordered block-diagonal matrix. Each recording's own unknowns make a block, the unknowns that all share
//! the border; eliminating the blocks leaves the Schur complement, a small dense system. Recordings whose readings share errors are tied by
//! the amplitudes of these, unknowns of unit variance that are eliminated behind the recordings' own.

mod block;
mod covariance;
mod joint;
mod profiled;
mod shared;
mod tie;

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, SymmetricEigen, U2, Vector2};

use block::Eliminated;
pub(crate) use block::{Block, RestSums, Row};
pub(crate) use covariance::OwnCovariance;
pub(crate) use joint::{JointCovariance, Weights};
pub(crate) use profiled::Profiled;
pub(crate) use shared::SharedProducts;
use tie::{Tie, TiedErrors};

/// A pair of numbers for the two unknowns that belong to one recording.
pub(crate) type Own = Vector2<f64>;

/// Unknowns that belong to one recording.
pub(crate) const N_OWN: usize = 2;

/// Eigenvalues of the matrix with unit diagonal below this are rounding: nothing is known along their vectors.
const SINGULAR: f64 = 1e-14;
/// An unknown takes part in such a vector with at least this share.
const PART: f64 = 0.1;

/// Products of all residuals and their derivatives, summed up.
#[derive(Debug, Clone)]
pub(crate) struct NormalEquations {
    /// Of all residuals, over what they share.
    shared: SharedProducts,
    recordings: Vec<Block>,
    ties: Vec<Tie>,
}

impl NormalEquations {
    pub(crate) fn new(n_shared: usize) -> Self {
        Self::of(SharedProducts::new(n_shared))
    }

    /// Of residuals whose products over what they share are summed up; recordings that have more of their own follow.
    pub(crate) fn of(shared: SharedProducts) -> Self {
        Self { shared, recordings: Vec::new(), ties: Vec::new() }
    }

    /// Number of shared unknowns.
    pub(crate) fn n_shared(&self) -> usize {
        self.shared.n_shared()
    }

    /// Adds a residual of unit variance that depends on shared unknowns alone: its derivatives by them, and the residual.
    pub(crate) fn add_row(&mut self, row: &[f64]) {
        self.shared.add_weighted(row, 1.0);
    }

    /// Adds a residual of unit variance that depends on one shared unknown alone: a prior.
    pub(crate) fn add_prior(&mut self, unknown: usize, residual: f64, slope: f64) {
        self.shared.add_prior(Some(unknown), residual, slope);
    }

    /// Adds what a recording has of its own, its residuals being among those that are summed up, and frees its tracks' places at rest.
    pub(crate) fn add_recording(&mut self, mut recording: Block, rests: &[RestSums]) {
        for rest in rests {
            recording.free_rest(rest);
            let (row, weight) = rest.shared(self.n_shared());
            self.shared.add_weighted(row, weight);
        }
        self.recordings.push(recording);
    }

    /// Adds a residual of unit variance that depends on one own unknown of a recording alone: a prior.
    pub(crate) fn add_own_prior(&mut self, recording: usize, own: usize, residual: f64, slope: f64) {
        self.recordings[recording].add_prior(own, residual, slope);
        self.shared.add_prior(None, residual, slope);
    }

    /// Ties recordings of these numbers, whose readings share so many errors: finds how large these are where the unknowns are, and takes them
    /// out of the residuals.
    pub(crate) fn tie(&mut self, recordings: &[usize], n_errors: usize) {
        let blocks: Vec<&Block> = recordings.iter().map(|r| &self.recordings[*r]).collect();
        let tie = Tie::of(&blocks, recordings.to_vec(), n_errors);
        for r in recordings {
            let more = self.recordings[*r].take_out(&tie.amplitudes);
            self.shared.add_to_residual(&more);
        }
        self.ties.push(tie);
    }

    /// Amplitudes of the errors that tied recordings share, tie by tie.
    pub(crate) fn amplitudes(&self) -> Vec<DVector<f64>> {
        self.ties.iter().map(|tie| tie.amplitudes.clone()).collect()
    }

    /// How many of these amplitudes the readings tell and their prior does not.
    pub(crate) fn n_told(&self) -> f64 {
        self.ties.iter().map(|tie| tie.n_told).sum()
    }

    /// Sum of squared residuals, priors included.
    pub(crate) fn chi_squared(&self) -> f64 {
        self.shared.chi_squared() + self.ties.iter().map(Tie::chi_squared).sum::<f64>()
    }

    /// Half of what the sum of squares falls by along a step, at its first steepness: all of the fall where the step leads to the minimum of a problem
    /// that is linear.
    pub(super) fn fall(&self, shared: &DVector<f64>, own: &[Own]) -> f64 {
        let of_recordings = self.recordings.iter().zip(own);
        let of_own: f64 = of_recordings.map(|(recording, own)| recording.rise(own)).sum();
        -self.shared.rise(shared) - of_own
    }

    /// By how much a step from the minimum raises it, were the problem linear, the amplitudes of the errors that tied recordings share being held.
    pub(super) fn length2(&self, shared: &DVector<f64>, own: &[Own]) -> f64 {
        let of_recordings = self.recordings.iter().zip(own);
        let of_own: f64 = of_recordings.map(|(recording, own)| recording.length2(own, shared)).sum();
        self.shared.length2(shared) + of_own
    }

    /// The same of one recording.
    pub(crate) fn chi_squared_of(&self, recording: usize) -> f64 {
        self.recordings[recording].chi_squared()
    }

    /// Covariance of a recording's own unknowns, the shared ones held; `None` where it leaves them open.
    pub(crate) fn own_covariance(&self, recording: usize) -> Option<Matrix2<f64>> {
        self.recordings[recording].own_covariance()
    }

    /// The equations without the recordings' own unknowns, every diagonal entry raised by the share `damping` (Marquardt); `None` where
    /// a recording does not determine its own.
    pub(crate) fn reduced(&self, damping: f64) -> Option<Reduced> {
        let recordings = self.recordings.iter().map(|recording| recording.eliminated(damping));
        let recordings: Vec<Eliminated> = recordings.collect::<Option<_>>()?;
        let of_tie = |tie: &Tie| tie.eliminated(&recordings, self.n_shared());
        let ties: Vec<TiedErrors> = self.ties.iter().map(of_tie).collect();
        let mut shared = self.shared.damped(damping);
        recordings.iter().for_each(|recording| shared -= recording.taken_out());
        ties.iter().for_each(|tie| shared -= tie.taken_out());
        Some(Reduced { shared, recordings, ties })
    }

    /// Numbers that it holds.
    #[cfg(test)]
    fn n_held(&self) -> usize {
        (self.n_shared() + 1).pow(2) + self.recordings.iter().map(Block::n_held).sum::<usize>()
    }
}

/// The equations after elimination of the recordings' own unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Reduced {
    /// Over the shared unknowns and, last, the residual.
    shared: DMatrix<f64>,
    recordings: Vec<Eliminated>,
    ties: Vec<TiedErrors>,
}

impl Reduced {
    /// The equations of the shared unknowns.
    pub(crate) fn system(&self) -> SharedSystem {
        let n = self.shared.nrows() - 1;
        SharedSystem {
            matrix: self.shared.view((0, 0), (n, n)).into_owned(),
            side: -self.shared.view((0, n), (n, 1)).column(0).into_owned(),
        }
    }

    /// What each recording adds to the sum of squares' gradient by the shared unknowns, its own ones and the amplitudes going with these; half
    /// of it, as the equations have it.
    pub(crate) fn scores(&self) -> Vec<DVector<f64>> {
        let score = |(r, recording): (usize, &Eliminated)| match self.tie_of(r) {
            Some(tie) => self.ties[tie].score(recording),
            None => recording.score(),
        };
        self.recordings.iter().enumerate().map(score).collect()
    }

    /// Which of the ties a recording belongs to.
    fn tie_of(&self, recording: usize) -> Option<usize> {
        self.ties.iter().position(|tie| tie.recordings().contains(&recording))
    }

    /// The tie of a recording, if it has one, and the derivatives of its own unknowns by the amplitudes of the tie.
    fn own_by_errors(&self, recording: usize) -> Option<(usize, OMatrix<f64, U2, Dyn>)> {
        let tie = self.tie_of(recording)?;
        Some((tie, self.recordings[recording].own_by_errors(self.ties[tie].n_errors())))
    }

    /// The derivatives of a recording's own unknowns by the shared ones, with which the amplitudes go.
    fn own_by_shared(&self, recording: usize) -> OMatrix<f64, U2, Dyn> {
        let alone = self.recordings[recording].own_by_shared();
        match self.own_by_errors(recording) {
            None => alone,
            Some((tie, by_errors)) => alone + by_errors * self.ties[tie].by_shared(),
        }
    }

    /// Steps of all recordings' own unknowns that go with a step of the shared ones.
    pub(crate) fn own_steps(&self, shared: &DVector<f64>) -> Vec<Own> {
        let amplitudes: Vec<DVector<f64>> = self.ties.iter().map(|tie| tie.amplitude_steps(shared)).collect();
        let none = DVector::zeros(0);
        let step = |(r, recording): (usize, &Eliminated)| {
            recording.own_step(shared, self.tie_of(r).map_or(&none, |tie| &amplitudes[tie]))
        };
        self.recordings.iter().enumerate().map(step).collect()
    }

    /// Covariances of the amplitudes of the errors that tied recordings share, tie by tie, the shared unknowns having the given one.
    pub(crate) fn amplitude_covariances(&self, shared: &DMatrix<f64>) -> Vec<DMatrix<f64>> {
        self.ties.iter().map(|tie| tie.amplitude_covariance(shared)).collect()
    }

    /// Square of the length in standard errors, the shared unknowns held, of those steps.
    pub(super) fn own_length2(&self, shared: &DVector<f64>) -> f64 {
        let length2 = |(recording, step): (&Eliminated, Own)| {
            recording.own_inverse.try_inverse().map_or(0.0, |own| step.dot(&(own * step)))
        };
        self.recordings.iter().zip(self.own_steps(shared)).map(length2).sum()
    }
}

/// The equations of the shared unknowns alone: the Schur complement.
#[derive(Debug, Clone)]
pub(crate) struct SharedSystem {
    matrix: DMatrix<f64>,
    side: DVector<f64>,
}

impl SharedSystem {
    /// Holds an unknown at its value.
    pub(crate) fn hold(&mut self, unknown: usize) {
        self.matrix.row_mut(unknown).fill(0.0);
        self.matrix.column_mut(unknown).fill(0.0);
        self.matrix[(unknown, unknown)] = 1.0;
        self.side[unknown] = 0.0;
    }

    /// The step; `None` where the equations are singular.
    pub(crate) fn step(&self) -> Option<DVector<f64>> {
        let scale = self.scale();
        let factor = self.scaled().cholesky()?;
        Some(factor.solve(&self.side.component_mul(&scale)).component_mul(&scale))
    }

    /// Covariance of the unknowns in units of the residuals' variance, or those that have none.
    pub(crate) fn covariance(&self) -> Result<DMatrix<f64>, Vec<usize>> {
        let scale = self.scale();
        let unknown: Vec<usize> = (0..scale.len()).filter(|i| !scale[*i].is_finite()).collect();
        if !unknown.is_empty() {
            return Err(unknown);
        }
        let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(self.scaled());
        let open: Vec<usize> = (0..scale.len()).filter(|k| eigenvalues[*k] < SINGULAR).collect();
        if !open.is_empty() {
            let takes_part = |i: &usize| open.iter().any(|k| eigenvectors[(*i, *k)].abs() > PART);
            return Err((0..scale.len()).filter(takes_part).collect());
        }
        let inverse = self.scaled().cholesky().map(|factor| factor.inverse());
        let inverse = inverse.ok_or_else(|| (0..scale.len()).collect::<Vec<_>>())?;
        Ok(DMatrix::from_fn(scale.len(), scale.len(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
    }

    /// Square of a step's length in standard errors.
    pub(crate) fn length2(&self, step: &DVector<f64>) -> f64 {
        self.side.dot(step)
    }

    /// Dampings are thousandths and factors near one: unit diagonal before factoring.
    fn scale(&self) -> DVector<f64> {
        self.matrix.diagonal().map(|entry| entry.sqrt().recip())
    }

    fn scaled(&self) -> DMatrix<f64> {
        let scale = self.scale();
        DMatrix::from_fn(scale.len(), scale.len(), |i, j| self.matrix[(i, j)] * scale[i] * scale[j])
    }
}

#[cfg(test)]
mod tests;
