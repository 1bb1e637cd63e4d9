use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, U2, Vector2};

/// A pair of numbers for the two unknowns that belong to one recording.
pub(super) type Own = Vector2<f64>;

/// Unknowns that belong to one recording.
pub(super) const N_OWN: usize = 2;

/// Products of one recording's residuals and their derivatives, summed up: a symmetric matrix over the recording's own unknowns, the
/// shared ones, and last the residual itself. Only the upper triangle is filled.
#[derive(Debug, Clone)]
pub(super) struct Sums {
    products: DMatrix<f64>,
}

/// The same of one body's track, less what its place at rest takes up.
pub(super) struct TrackSums {
    products: Vec<f64>,
    weighted: Vec<f64>,
    weight: f64,
    n: usize,
}

impl TrackSums {
    pub(super) fn new(n_shared: usize) -> Self {
        let width = N_OWN + n_shared + 1;
        Self { products: vec![0.0; width * width], weighted: vec![0.0; width], weight: 0.0, n: 0 }
    }

    /// Adds a row (own, shared, residual) in units of the residual's sigma.
    pub(super) fn add(&mut self, row: &[f64], inverse_sigma: f64) {
        let width = row.len();
        for (i, left) in row.iter().enumerate() {
            let line = &mut self.products[i * width + i..(i + 1) * width];
            line.iter_mut().zip(&row[i..]).for_each(|(sum, right)| *sum += left * right);
            self.weighted[i] += inverse_sigma * left;
        }
        self.weight += inverse_sigma * inverse_sigma;
        self.n += 1;
    }

    /// Residuals less the one that the place at rest takes up.
    pub(super) fn freedom(&self) -> f64 {
        self.n.saturating_sub(1) as f64
    }
}

impl Sums {
    pub(super) fn new(n_shared: usize) -> Self {
        let width = N_OWN + n_shared + 1;
        Self { products: DMatrix::zeros(width, width) }
    }

    /// Adds a track whose place at rest is free: the mean row, by weight, is taken out of all.
    pub(super) fn add_track(&mut self, track: &TrackSums) {
        let width = self.products.nrows();
        for i in 0..width {
            for j in i..width {
                let mean = track.weighted[i] * track.weighted[j] / track.weight.max(f64::MIN_POSITIVE);
                self.products[(i, j)] += track.products[i * width + j] - mean;
            }
        }
    }

    /// Adds a residual of unit variance that depends on one own unknown alone: a prior.
    pub(super) fn add_prior(&mut self, own: usize, residual: f64, slope: f64) {
        let last = self.products.nrows() - 1;
        self.products[(own, own)] += slope * slope;
        self.products[(own, last)] += slope * residual;
        self.products[(last, last)] += residual * residual;
    }

    /// Sum of squared residuals.
    pub(super) fn chi_squared(&self) -> f64 {
        let last = self.products.nrows() - 1;
        self.products[(last, last)]
    }

    /// The recording with its own unknowns eliminated, every diagonal entry raised by the share `damping`; `None` where it does not
    /// determine them.
    pub(super) fn eliminated(&self, damping: f64) -> Option<Eliminated> {
        let full = DMatrix::from_fn(self.products.nrows(), self.products.ncols(), |i, j| {
            let raised = if i == j && i + 1 < self.products.nrows() { 1.0 + damping } else { 1.0 };
            raised * self.products[(i.min(j), i.max(j))]
        });
        let n_rest = full.nrows() - N_OWN;
        let own: Matrix2<f64> = full.fixed_view::<N_OWN, N_OWN>(0, 0).into_owned();
        let own_inverse = own.cholesky()?.inverse();
        let coupling = full.view((N_OWN, 0), (n_rest, N_OWN)).into_owned();
        let rest = full.view((N_OWN, N_OWN), (n_rest, n_rest)).into_owned();
        let products = rest - &coupling * own_inverse * coupling.transpose();
        Some(Eliminated { products, coupling, own_inverse })
    }
}

/// One recording after elimination of its own unknowns.
#[derive(Debug, Clone)]
pub(super) struct Eliminated {
    /// Over the shared unknowns and, last, the residual.
    products: DMatrix<f64>,
    coupling: DMatrix<f64>,
    own_inverse: Matrix2<f64>,
}

impl Eliminated {
    /// Step of the recording's own unknowns that goes with a step of the shared ones.
    fn own_step(&self, shared: &DVector<f64>) -> Own {
        let extended = shared.clone().push(1.0);
        let side = self.coupling.tr_mul(&extended);
        -(self.own_inverse * Own::new(side[0], side[1]))
    }

    /// Square of a step's length in standard errors, the shared unknowns held.
    pub(super) fn own_length2(&self, step: &Own) -> f64 {
        self.own_inverse.try_inverse().map_or(0.0, |own| step.dot(&(own * step)))
    }

    /// Derivatives of the own unknowns by the shared ones.
    fn own_by_shared(&self) -> OMatrix<f64, U2, Dyn> {
        -(self.own_inverse * self.coupling.rows(0, self.coupling.nrows() - 1).transpose())
    }
}

/// The equations of the shared unknowns, to which recordings are added with a weight.
#[derive(Debug, Clone)]
pub(super) struct SharedEquations {
    matrix: DMatrix<f64>,
    side: DVector<f64>,
}

impl SharedEquations {
    pub(super) fn new(n_shared: usize) -> Self {
        Self { matrix: DMatrix::zeros(n_shared, n_shared), side: DVector::zeros(n_shared) }
    }

    pub(super) fn add(&mut self, recording: &Eliminated, weight: f64) {
        let n = self.side.len();
        self.matrix += recording.products.view((0, 0), (n, n)) * weight;
        self.side -= recording.products.view((0, n), (n, 1)) * weight;
    }

    /// Adds a residual of unit variance that depends on one unknown alone: a prior. Its diagonal entry is raised like the others'.
    pub(super) fn add_prior(&mut self, unknown: usize, residual: f64, slope: f64, damping: f64) {
        self.matrix[(unknown, unknown)] += slope * slope * (1.0 + damping);
        self.side[unknown] -= slope * residual;
    }

    /// Holds an unknown at its value.
    pub(super) fn hold(&mut self, unknown: usize) {
        self.matrix.row_mut(unknown).fill(0.0);
        self.matrix.column_mut(unknown).fill(0.0);
        self.matrix[(unknown, unknown)] = 1.0;
        self.side[unknown] = 0.0;
    }

    /// The step; `None` where the equations are singular.
    pub(super) fn step(&self) -> Option<DVector<f64>> {
        Some(self.scaled()?.1.component_mul(&self.scale()))
    }

    /// Covariance of the unknowns; `None` where the equations are singular.
    pub(super) fn covariance(&self) -> Option<DMatrix<f64>> {
        let scale = self.scale();
        let inverse = self.scaled()?.0;
        Some(DMatrix::from_fn(scale.len(), scale.len(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
    }

    /// Square of a step's length in standard errors.
    pub(super) fn length2(&self, step: &DVector<f64>) -> f64 {
        self.side.dot(step)
    }

    /// Dampings are thousandths and factors near one: unit diagonal before factoring.
    fn scale(&self) -> DVector<f64> {
        self.matrix.diagonal().map(|entry| entry.sqrt().recip())
    }

    fn scaled(&self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let scale = self.scale();
        let matrix =
            DMatrix::from_fn(scale.len(), scale.len(), |i, j| self.matrix[(i, j)] * scale[i] * scale[j]);
        let factor = matrix.cholesky()?;
        let step = factor.solve(&self.side.component_mul(&scale));
        Some((factor.inverse(), step))
    }
}

/// Steps of all recordings' own unknowns.
pub(super) fn own_steps(recordings: &[Eliminated], shared: &DVector<f64>) -> Vec<Own> {
    recordings.iter().map(|recording| recording.own_step(shared)).collect()
}

/// Covariances of the recordings' own unknowns.
pub(super) struct OwnCovariance {
    /// Of each recording's.
    pub(super) of_each: Vec<Matrix2<f64>>,
    /// Of each recording's less the mean over all.
    pub(super) about_mean: Vec<Matrix2<f64>>,
    /// Of that mean.
    pub(super) of_mean: Matrix2<f64>,
}

impl OwnCovariance {
    /// What the recordings' own residuals leave open, and what the shared unknowns, of the given covariance, carry into them.
    pub(super) fn of(recordings: &[Eliminated], shared: &DMatrix<f64>) -> Self {
        let n = recordings.len() as f64;
        let by_shared: Vec<OMatrix<f64, U2, Dyn>> =
            recordings.iter().map(Eliminated::own_by_shared).collect();
        let mut mean = OMatrix::<f64, U2, Dyn>::zeros(shared.nrows());
        by_shared.iter().for_each(|one| mean += one / n);
        let carried = |by: &OMatrix<f64, U2, Dyn>| by * shared * by.transpose();
        let alone = recordings.iter().map(|recording| recording.own_inverse).sum::<Matrix2<f64>>() / (n * n);
        let pairs = || recordings.iter().zip(&by_shared);
        Self {
            of_each: pairs().map(|(one, by)| one.own_inverse + carried(by)).collect(),
            about_mean: pairs()
                .map(|(one, by)| one.own_inverse * (1.0 - 2.0 / n) + alone + carried(&(by - &mean)))
                .collect(),
            of_mean: alone + carried(&mean),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three recordings of one track each, and two shared unknowns, against the same least squares as one dense matrix with the
    /// places at rest among its unknowns.
    #[test]
    fn elimination_gives_the_dense_solution() {
        const N_SHARED: usize = 2;
        const N_RECORDINGS: usize = 3;
        let mut tracks: Vec<TrackSums> = (0..N_RECORDINGS).map(|_| TrackSums::new(N_SHARED)).collect();
        let n_unknowns = N_SHARED + 3 * N_RECORDINGS;
        let (mut rows, mut side) = (Vec::new(), Vec::new());
        for k in 0..36_u32 {
            let wave = |i: u32| ((1.7 + 0.37 * f64::from(i)) * f64::from(k) + 0.9 * f64::from(i * i)).sin();
            let recording = k as usize % N_RECORDINGS;
            let inverse_sigma = 1.0 + 0.5 * wave(6);
            tracks[recording].add(&[wave(3), wave(4), wave(1), wave(2), wave(5)], inverse_sigma);
            let mut row = vec![0.0; n_unknowns];
            row[..N_SHARED].copy_from_slice(&[wave(1), wave(2)]);
            let first = N_SHARED + 3 * recording;
            row[first..first + 3].copy_from_slice(&[wave(3), wave(4), inverse_sigma]);
            rows.extend(row);
            side.push(-wave(5));
        }
        let dense = DMatrix::from_row_slice(36, n_unknowns, &rows);
        let inverse = (dense.transpose() * &dense).try_inverse().unwrap();
        let expected = &inverse * dense.transpose() * DVector::from_vec(side);
        let mut equations = SharedEquations::new(N_SHARED);
        let recordings: Vec<Eliminated> = tracks
            .iter()
            .map(|track| {
                let mut sums = Sums::new(N_SHARED);
                sums.add_track(track);
                sums.eliminated(0.0).unwrap()
            })
            .collect();
        recordings.iter().for_each(|recording| equations.add(recording, 1.0));
        let (step, covariance) = (equations.step().unwrap(), equations.covariance().unwrap());
        let own = own_steps(&recordings, &step);
        let errors = OwnCovariance::of(&recordings, &covariance);
        let place = |r: usize, k: usize| N_SHARED + 3 * r + k;
        // Rounding, times a condition number of some tens.
        let close = |found: f64, expected: f64| (found - expected).abs() < 1e-12;
        for i in 0..N_SHARED {
            assert!(close(step[i], expected[i]));
            assert!((0..N_SHARED).all(|j| close(covariance[(i, j)], inverse[(i, j)])));
        }
        for k in 0..N_OWN {
            let variance = |weight: &dyn Fn(usize) -> f64| -> f64 {
                let pairs = (0..N_RECORDINGS).flat_map(|r| (0..N_RECORDINGS).map(move |q| (r, q)));
                pairs.map(|(r, q)| weight(r) * weight(q) * inverse[(place(r, k), place(q, k))]).sum()
            };
            for r in 0..N_RECORDINGS {
                assert!(close(own[r][k], expected[place(r, k)]));
                let is_this = |q: usize| f64::from(u8::from(q == r));
                assert!(close(errors.of_each[r][(k, k)], variance(&is_this)));
                assert!(close(errors.about_mean[r][(k, k)], variance(&|q| is_this(q) - 1.0 / 3.0)));
            }
            assert!(close(errors.of_mean[(k, k)], variance(&|_| 1.0 / 3.0)));
        }
    }

    #[test]
    fn recordings_without_information_are_singular() {
        assert!(Sums::new(1).eliminated(0.0).is_none());
        assert!(SharedEquations::new(1).step().is_none());
    }
}
