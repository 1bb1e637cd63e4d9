//! The normal equations: a bordered block-diagonal matrix. Each recording's own unknowns make a block, the unknowns that all share
//! the border; eliminating the blocks leaves the Schur complement, a small dense system. Recordings whose readings share errors are tied by
//! the amplitudes of these, unknowns of unit variance that are eliminated behind the recordings' own.

mod block;
mod covariance;
mod joint;
mod shared;
mod tie;

use nalgebra::{DMatrix, DVector, Matrix2, SymmetricEigen, Vector2};

use super::problem::Unknowns;
use block::Eliminated;
pub(crate) use block::{Block, RestSums, Row};
pub(crate) use covariance::OwnCovariance;
pub(crate) use joint::{JointCovariance, Weights};
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
    pub(super) fn fall(&self, step: &Unknowns) -> f64 {
        let of_recordings = self.recordings.iter().zip(&step.own);
        let of_own: f64 = of_recordings.map(|(recording, own)| recording.rise(own)).sum();
        -self.shared.rise(&step.shared) - of_own
    }

    /// By how much a step from the minimum raises it, were the problem linear, the amplitudes of the errors that tied recordings share being held.
    pub(super) fn length2(&self, step: &Unknowns) -> f64 {
        let of_recordings = self.recordings.iter().zip(&step.own);
        let of_own: f64 = of_recordings.map(|(recording, own)| recording.length2(own, &step.shared)).sum();
        self.shared.length2(&step.shared) + of_own
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
mod tests {
    use super::*;

    /// The solution of one dense least squares: first the shared unknowns, later those of each recording.
    struct Dense {
        inverse: DMatrix<f64>,
        solution: DVector<f64>,
        /// Its sum of squares.
        least: f64,
        /// Amplitudes, which stand behind the shared unknowns.
        n_errors: usize,
        first_own: usize,
        /// A recording's own unknowns and its places at rest.
        n_of_recording: usize,
    }

    impl Dense {
        /// Where an unknown of a recording stands.
        fn place(&self, recording: usize, k: usize) -> usize {
            self.first_own + self.n_of_recording * recording + k
        }

        /// Variance of a sum of one of the recordings' own unknowns, each recording with its weight.
        fn variance(&self, k: usize, weights: &[f64]) -> f64 {
            let all = || weights.iter().enumerate();
            let pairs = all().flat_map(|(r, of_r)| all().map(move |(q, of_q)| (r, q, of_r * of_q)));
            pairs.map(|(r, q, weight)| weight * self.inverse[(self.place(r, k), self.place(q, k))]).sum()
        }

        /// Holds the variance of a sum of unknowns of all kinds against it.
        fn has_variance_of_sums(&self, joint: &JointCovariance, n_recordings: usize, tolerance: f64) {
            let n_shared = self.first_own - self.n_errors;
            let (of_all, of_second) = (Own::new(0.3, -0.7), Own::new(1.1, 0.4));
            let shared = DVector::from_fn(n_shared, |i, _| 0.5 - 0.8 * i as f64);
            let amplitudes = DVector::from_fn(self.n_errors, |i, _| 0.6 * i as f64 - 0.2);
            let mut weights = DVector::zeros(self.inverse.nrows());
            weights.rows_mut(0, n_shared).copy_from(&shared);
            weights.rows_mut(n_shared, self.n_errors).copy_from(&amplitudes);
            for r in 0..n_recordings {
                let own = if r == 1 { of_all + of_second } else { of_all };
                (0..N_OWN).for_each(|k| weights[self.place(r, k)] = own[k]);
            }
            let amplitudes = if self.n_errors > 0 { vec![amplitudes] } else { Vec::new() };
            let sum = Weights { of_all, of_each: &[(1, of_second)], amplitudes: &amplitudes, shared };
            let expected = weights.dot(&(&self.inverse * &weights));
            assert!((joint.variance(&sum) - expected).abs() < tolerance * expected.max(1.0));
        }

        /// Holds steps and covariances of the equations against it.
        fn is_found_by(&self, equations: &NormalEquations, n_recordings: usize, tolerance: f64) {
            let reduced = equations.reduced(0.0).unwrap();
            let system = reduced.system();
            let (step, covariance) = (system.step().unwrap(), system.covariance().unwrap());
            let own = reduced.own_steps(&step);
            let errors = OwnCovariance::of(&reduced, &covariance);
            let close = |found: f64, expected: f64| (found - expected).abs() < tolerance;
            // The recordings' scores, and what the prior of the amplitudes adds to them, are the gradient.
            let of_ties = equations.ties.iter().zip(&reduced.ties);
            let priors = of_ties.map(|(tie, behind)| behind.by_shared().tr_mul(&tie.amplitudes));
            let parts = reduced.scores().into_iter().chain(priors);
            let gradient = parts.fold(DVector::zeros(step.len()), |sum, one| sum + one);
            assert!((gradient + &system.side).amax() < tolerance);
            let whole = Unknowns { shared: step.clone(), own: own.clone() };
            assert!(close(equations.chi_squared() - equations.fall(&whole), self.least));
            // From the minimum back it rises by as much, and by more where amplitudes are held.
            let back = equations.length2(&whole) - equations.fall(&whole);
            assert!(if equations.ties.is_empty() { close(back, 0.0) } else { back > -tolerance });
            for i in 0..equations.n_shared() {
                assert!(close(step[i], self.solution[i]), "{} {}", step[i], self.solution[i]);
                assert!((0..equations.n_shared()).all(|j| close(covariance[(i, j)], self.inverse[(i, j)])));
            }
            self.has_variance_of_sums(&JointCovariance::of(&reduced, &covariance), n_recordings, tolerance);
            let mean = vec![1.0 / n_recordings as f64; n_recordings];
            for (r, own) in own.iter().enumerate() {
                let mut alone = vec![0.0; n_recordings];
                alone[r] = 1.0;
                let about_mean: Vec<f64> = alone.iter().zip(&mean).map(|(one, mean)| one - mean).collect();
                for (k, own) in own.iter().enumerate() {
                    assert!(close(*own, self.solution[self.place(r, k)]));
                    assert!(close(errors.of_each[r][(k, k)], self.variance(k, &alone)));
                    assert!(close(errors.about_mean[r][(k, k)], self.variance(k, &about_mean)));
                    assert!(close(errors.of_mean[(k, k)], self.variance(k, &mean)));
                }
            }
        }
    }

    /// Three recordings of one track each, and two shared unknowns, against the same least squares as one dense matrix with the
    /// places at rest among its unknowns.
    #[test]
    fn elimination_gives_the_dense_solution() {
        const N_SHARED: usize = 2;
        const N_RECORDINGS: usize = 3;
        let mut blocks: Vec<Block> = (0..N_RECORDINGS).map(|_| Block::new(N_SHARED, &[])).collect();
        let mut rests: Vec<RestSums> = (0..N_RECORDINGS).map(|_| RestSums::new(N_SHARED, 0)).collect();
        let n_unknowns = N_SHARED + 3 * N_RECORDINGS;
        let mut equations = NormalEquations::new(N_SHARED);
        let (mut rows, mut side) = (Vec::new(), Vec::new());
        for k in 0..36_u32 {
            let wave = |i: u32| ((1.7 + 0.37 * f64::from(i)) * f64::from(k) + 0.9 * f64::from(i * i)).sin();
            let recording = k as usize % N_RECORDINGS;
            let inverse_sigma = 1.0 + 0.5 * wave(6);
            let entries = &[wave(3), wave(4), wave(1), wave(2), wave(5)][..];
            let row = Row { entries, errors: Vec::new(), inverse_sigma };
            equations.add_row(&entries[N_OWN..]);
            blocks[recording].add_rows([row].into_iter(), &mut rests[recording]);
            let mut row = vec![0.0; n_unknowns];
            row[..N_SHARED].copy_from_slice(&[wave(1), wave(2)]);
            let first = N_SHARED + 3 * recording;
            row[first..first + 3].copy_from_slice(&[wave(3), wave(4), inverse_sigma]);
            rows.extend(row);
            side.push(-wave(5));
        }
        let dense = DMatrix::from_row_slice(36, n_unknowns, &rows);
        let inverse = (dense.transpose() * &dense).try_inverse().unwrap();
        let side = DVector::from_vec(side);
        let solution = &inverse * dense.transpose() * &side;
        let least = (&dense * &solution - side).norm_squared();
        for (recording, rest) in blocks.into_iter().zip(rests) {
            equations.add_recording(recording, &[rest]);
        }
        // Rounding, times a condition number of some tens.
        let dense = Dense { inverse, solution, least, n_errors: 0, first_own: N_SHARED, n_of_recording: 3 };
        dense.is_found_by(&equations, N_RECORDINGS, 1e-12);
    }

    /// Four recordings of two tracks each. The first three have two of three errors each: the first one in both tracks, the other one in the
    /// second alone. Against one dense least squares with the places at rest and the amplitudes among its unknowns.
    #[test]
    fn ties_give_the_dense_solution() {
        const N_SHARED: usize = 2;
        const N_RECORDINGS: usize = 4;
        const N_TIED: usize = 3;
        const N_ERRORS: usize = 3;
        let first_own = N_SHARED + N_ERRORS;
        let n_unknowns = first_own + 4 * N_RECORDINGS;
        let mut equations = NormalEquations::new(N_SHARED);
        let (mut rows, mut side) = (Vec::new(), Vec::new());
        for recording in 0..N_RECORDINGS {
            let is_tied = recording < N_TIED;
            let of_recording = [[0, 1], [1, 2], [0, 2], [0, 0]][recording];
            let of_recording = if is_tied { &of_recording[..] } else { &[] };
            let mut block = Block::new(N_SHARED, of_recording);
            let mut rests = Vec::new();
            for track in 0..2 {
                let places = 0..if is_tied { track + 1 } else { 0 };
                let mut rest = RestSums::new(N_SHARED, of_recording.len());
                for k in 0..12 {
                    let seed = f64::from(k) + 12.3 * track as f64 + 31.7 * recording as f64;
                    let wave = |i: usize| ((1.7 + 0.37 * i as f64) * seed + 0.9 * (i * i) as f64).sin();
                    let inverse_sigma = 1.0 + 0.5 * wave(6);
                    let entries = &[wave(3), wave(4), wave(1), wave(2), wave(5)][..];
                    let errors: Vec<(usize, f64)> =
                        places.clone().map(|place| (place, 3.0 * wave(7 + place))).collect();
                    let row = Row { entries, errors: errors.clone(), inverse_sigma };
                    equations.add_row(&entries[N_OWN..]);
                    block.add_rows([row].into_iter(), &mut rest);
                    let mut dense = vec![0.0; n_unknowns];
                    dense[..N_SHARED].copy_from_slice(&entries[2..4]);
                    for (place, slope) in errors {
                        dense[N_SHARED + of_recording[place]] = slope;
                    }
                    let own = first_own + 4 * recording;
                    dense[own..own + 2].copy_from_slice(&entries[..2]);
                    dense[own + 2 + track] = inverse_sigma;
                    rows.extend(dense);
                    side.push(-wave(5));
                }
                rests.push(rest);
            }
            equations.add_recording(block, &rests);
        }
        for error in 0..N_ERRORS {
            let mut prior = vec![0.0; n_unknowns];
            prior[N_SHARED + error] = 1.0;
            rows.extend(prior);
            side.push(0.0);
        }
        equations.tie(&(0..N_TIED).collect::<Vec<_>>(), N_ERRORS);
        let dense = DMatrix::from_row_slice(side.len(), n_unknowns, &rows);
        let side = DVector::from_vec(side);
        let inverse = (dense.transpose() * &dense).try_inverse().unwrap();
        let solution = &inverse * dense.transpose() * &side;
        let least = (&dense * &solution - &side).norm_squared();
        // Rounding, times a condition number of some hundreds.
        let tolerance = 1e-11;
        let solved = Dense { inverse, solution, least, n_errors: N_ERRORS, first_own, n_of_recording: 4 };
        solved.is_found_by(&equations, N_RECORDINGS, tolerance);
        let close = |found: f64, expected: f64| (found - expected).abs() < tolerance;
        let place = |r: usize, k: usize| solved.place(r, k);
        // The sum of squares is that of the amplitudes and places at rest that fit best, the other unknowns held.
        let free: Vec<usize> =
            (N_SHARED..first_own).chain((0..N_RECORDINGS).flat_map(|r| [place(r, 2), place(r, 3)])).collect();
        let part = dense.select_columns(&free);
        let best = (part.transpose() * &part).try_inverse().unwrap() * part.transpose() * &side;
        assert!(close(equations.chi_squared(), (&part * &best - &side).norm_squared()));
        let amplitudes = &equations.amplitudes()[0];
        assert!((0..N_ERRORS).all(|error| close(amplitudes[error], best[error])));
    }

    #[test]
    fn products_of_many_unknowns_are_held_once_for_all_recordings() {
        let held = |n_shared: usize, n_recordings: usize| {
            let mut equations = NormalEquations::new(n_shared);
            (0..n_recordings).for_each(|_| equations.add_recording(Block::new(n_shared, &[]), &[]));
            equations.n_held()
        };
        for (n_shared, n_recordings) in [(300, 22), (1000, 70)] {
            let of_recordings = held(n_shared, n_recordings) - held(n_shared, 0);
            // Two own unknowns and the residual, each with themselves and the unknowns that all share.
            assert!(of_recordings <= n_recordings * (N_OWN + 1) * (N_OWN + n_shared + 1), "{of_recordings}");
        }
    }

    #[test]
    fn sums_are_the_same_for_any_number_of_threads_and_those_of_the_rows_one_by_one() {
        const N_SHARED: usize = 37;
        let entry = |row: usize, i: usize| match (row / 5 + i).is_multiple_of(3) {
            true => 0.0,
            false => (1.3 * row as f64 + 0.7 * (i * i) as f64).sin(),
        };
        let rows: Vec<Vec<f64>> =
            (0..71).map(|row| (0..=N_SHARED).map(|i| entry(row, i)).collect()).collect();
        let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
        let summed = |n_threads: usize| {
            let mut products = SharedProducts::new(N_SHARED);
            products.add_rows(&rows, n_threads.try_into().unwrap());
            products.damped(0.0)
        };
        let all = summed(1);
        assert_eq!(all, summed(3));
        for i in 0..=N_SHARED {
            for j in 0..=N_SHARED {
                let expected: f64 = rows.iter().map(|row| row[i] * row[j]).sum();
                // Rounding of a sum of 71 numbers below one.
                assert!((all[(i, j)] - expected).abs() < 71.0 * 71.0 * f64::EPSILON);
            }
        }
    }

    #[test]
    fn recordings_without_information_are_singular() {
        assert!(Block::new(1, &[]).eliminated(0.0).is_none());
        let empty = NormalEquations::new(1).reduced(0.0).unwrap().system();
        assert!(empty.step().is_none());
        assert_eq!(empty.covariance(), Err(vec![0]));
    }

    #[test]
    fn unknowns_that_stand_for_each_other_are_named() {
        let mut equations = NormalEquations::new(3);
        for k in 0..20 {
            let x = f64::from(k);
            // The first and the third are one.
            equations.add_row(&[x, x.cos(), 2.0 * x, x.sin()]);
        }
        assert_eq!(equations.reduced(0.0).unwrap().system().covariance(), Err(vec![0, 2]));
    }
}
