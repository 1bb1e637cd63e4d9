//! What one recording has of its own in the equations: unknowns, amplitudes of errors, and the residual.

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, U2};

use super::{N_OWN, Own};

/// Products of what one recording has of its own with everything. Those of derivatives by shared unknowns with each other are summed up over
/// all recordings ([`SharedProducts`](super::SharedProducts)): of all products these are most where there are many unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    /// Which of its tie's errors it has, in the order of their columns.
    pub(super) errors: Vec<usize>,
    /// One column for each own unknown, then for the residual, then for each error's amplitude; in each the products with the own unknowns, the
    /// shared ones, the residual, and the amplitudes.
    products: DMatrix<f64>,
}

/// A residual in units of its sigma, with what it depends on.
pub(crate) struct Row<'a> {
    /// Its derivatives by own and shared unknowns, and last itself.
    pub(crate) entries: &'a [f64],
    /// Its derivatives by the amplitudes of errors, by their places among those of its recording, as far as it depends on them.
    pub(crate) errors: Vec<(usize, f64)>,
    pub(crate) inverse_sigma: f64,
}

/// The weighted sums of the rows of one body's track, which its place at rest takes up.
#[derive(Debug, Clone)]
pub(crate) struct RestSums {
    weighted: Vec<f64>,
    weight: f64,
}

/// Columns of a block before those of amplitudes: of the own unknowns and the residual.
const N_ALWAYS: usize = N_OWN + 1;

/// One recording after elimination of its own unknowns.
#[derive(Debug, Clone)]
pub(super) struct Eliminated {
    /// Which of its tie's errors it has.
    pub(super) errors: Vec<usize>,
    /// Of its own unknowns with the shared ones, the residual, and the amplitudes.
    coupling: DMatrix<f64>,
    pub(super) own_inverse: Matrix2<f64>,
    /// Of the residual and of each amplitude with the same, behind the elimination.
    rest: DMatrix<f64>,
}

impl RestSums {
    /// Over so many shared unknowns, and amplitudes of errors that the recording has.
    pub(crate) fn new(n_shared: usize, n_errors: usize) -> Self {
        Self { weighted: vec![0.0; N_OWN + n_shared + 1 + n_errors], weight: 0.0 }
    }

    /// What takes the mean row out of the products over the shared unknowns and the residual: a row, and its weight.
    pub(super) fn shared(&self, n_shared: usize) -> (&[f64], f64) {
        (&self.weighted[N_OWN..=N_OWN + n_shared], -self.weight.max(f64::MIN_POSITIVE).recip())
    }
}

impl Block {
    /// Over so many shared unknowns, and the amplitudes of those of its tie's errors that the recording has.
    pub(crate) fn new(n_shared: usize, errors: &[usize]) -> Self {
        let n = errors.len();
        Self { errors: errors.to_vec(), products: DMatrix::zeros(N_OWN + n_shared + 1 + n, N_ALWAYS + n) }
    }

    /// Adds rows of one track.
    pub(crate) fn add_rows<'a>(&mut self, rows: impl Iterator<Item = Row<'a>>, of_track: &mut RestSums) {
        let (residual, first_error) = (self.residual(), self.first_error());
        for Row { entries, errors, inverse_sigma } in rows {
            let weighted = of_track.weighted.iter_mut().zip(entries);
            weighted.for_each(|(sum, entry)| *sum += inverse_sigma * entry);
            of_track.weight += inverse_sigma * inverse_sigma;
            for (column, factor) in [entries[0], entries[1], entries[residual]].into_iter().enumerate() {
                self.add_to_column(column, factor, (entries, &errors));
            }
            for (error, slope) in &errors {
                of_track.weighted[first_error + error] += inverse_sigma * slope;
                self.add_to_column(N_ALWAYS + error, *slope, (entries, &errors));
            }
        }
    }

    /// Adds the products of one factor with all that a row has.
    fn add_to_column(&mut self, column: usize, factor: f64, (entries, errors): (&[f64], &[(usize, f64)])) {
        let n = self.products.nrows();
        let first_error = self.first_error();
        let sums = &mut self.products.as_mut_slice()[column * n..(column + 1) * n];
        sums.iter_mut().zip(entries).for_each(|(sum, entry)| *sum += factor * entry);
        errors.iter().for_each(|(error, slope)| sums[first_error + error] += factor * slope);
    }

    /// Frees a track's place at rest: the mean row, by weight, is taken out of all.
    pub(crate) fn free_rest(&mut self, of_track: &RestSums) {
        let RestSums { weighted, weight } = of_track;
        for column in 0..self.products.ncols() {
            let share = weighted[self.place(column)] / weight.max(f64::MIN_POSITIVE);
            let sums = self.products.column_mut(column).into_iter().zip(weighted);
            sums.for_each(|(sum, entry)| *sum -= share * entry);
        }
    }

    /// Where what a column stands for has its row.
    fn place(&self, column: usize) -> usize {
        match column {
            own if own < N_OWN => own,
            of_rest => self.residual() + of_rest - N_OWN,
        }
    }

    /// Where the amplitudes have their rows.
    fn first_error(&self) -> usize {
        self.residual() + 1
    }

    /// Where the residual has its row.
    fn residual(&self) -> usize {
        self.products.nrows() - self.errors.len() - 1
    }

    /// Products of the amplitudes of its errors with the residual.
    pub(super) fn errors_by_residual(&self) -> DVector<f64> {
        self.products.view((self.first_error(), N_OWN), (self.errors.len(), 1)).column(0).into_owned()
    }

    /// The same with each other.
    pub(super) fn errors_by_errors(&self) -> DMatrix<f64> {
        let n = self.errors.len();
        self.products.view((self.first_error(), N_ALWAYS), (n, n)).into_owned()
    }

    /// Adds errors to the model, of these amplitudes of its tie's; and what that adds to the products of the residual with the shared unknowns and,
    /// last, with itself.
    pub(super) fn take_out(&mut self, amplitudes: &DVector<f64>) -> DVector<f64> {
        let (n, residual) = (self.errors.len(), self.residual());
        let amplitudes = DVector::from_iterator(n, self.errors.iter().map(|error| amplitudes[*error]));
        let effect = self.products.columns(N_ALWAYS, n) * &amplitudes;
        for column in 0..self.products.ncols() {
            self.products[(residual, column)] += effect[self.place(column)];
        }
        // The square has the effect once for each of its factors, and the effect's own square.
        let of_square = effect[residual] + effect.rows(self.first_error(), n).dot(&amplitudes);
        let mut more = effect;
        let in_row = more[residual];
        more[residual] = of_square;
        let mut column = self.products.column_mut(N_OWN);
        column += &more;
        more[residual] += in_row;
        more.rows(N_OWN, residual + 1 - N_OWN).into_owned()
    }

    /// Adds a residual of unit variance that depends on one own unknown alone: a prior.
    pub(super) fn add_prior(&mut self, own: usize, value: f64, slope: f64) {
        let residual = self.residual();
        self.products[(own, own)] += slope * slope;
        self.products[(residual, own)] += slope * value;
        self.products[(own, N_OWN)] += slope * value;
        self.products[(residual, N_OWN)] += value * value;
    }

    /// Half of the first rise of the sum of squares along a step of its own unknowns.
    pub(super) fn rise(&self, own: &Own) -> f64 {
        self.products.view((0, N_OWN), (N_OWN, 1)).column(0).dot(own)
    }

    /// What a step of its own unknowns adds to the square of one of the shared ones.
    pub(super) fn length2(&self, own: &Own, shared: &DVector<f64>) -> f64 {
        let by_shared = self.products.view((N_OWN, 0), (shared.len(), N_OWN));
        own.dot(&(self.own(0.0) * own)) + 2.0 * shared.dot(&(by_shared * own))
    }

    /// Sum of squared residuals.
    pub(super) fn chi_squared(&self) -> f64 {
        self.products[(self.residual(), N_OWN)]
    }

    /// Numbers that it holds.
    #[cfg(test)]
    pub(super) fn n_held(&self) -> usize {
        self.products.len()
    }

    pub(super) fn own_covariance(&self) -> Option<Matrix2<f64>> {
        Some(self.own(0.0).cholesky()?.inverse())
    }

    /// Products of the own unknowns, the diagonal raised by the share `damping`.
    fn own(&self, damping: f64) -> Matrix2<f64> {
        Matrix2::from_fn(|i, j| self.products[(i, j)] * if i == j { 1.0 + damping } else { 1.0 })
    }

    /// Without the recording's own unknowns, every diagonal entry but the residual's raised by the share `damping`.
    pub(super) fn eliminated(&self, damping: f64) -> Option<Eliminated> {
        let own_inverse = self.own(damping).cholesky()?.inverse();
        let (n_rest, n) = (self.products.nrows() - N_OWN, self.errors.len());
        let coupling = self.products.view((N_OWN, 0), (n_rest, N_OWN)).into_owned();
        let mut rest = self.products.view((N_OWN, N_OWN), (n_rest, 1 + n)).into_owned();
        let (residual, first_error) = (n_rest - n - 1, n_rest - n);
        (0..n).for_each(|error| rest[(first_error + error, 1 + error)] *= 1.0 + damping);
        rest -= &coupling * own_inverse * coupling.rows(residual, 1 + n).transpose();
        Some(Eliminated { errors: self.errors.clone(), coupling, own_inverse, rest })
    }
}

/// A step of the shared unknowns as it multiplies the products over these and the residual.
pub(super) fn with_residual(shared: &DVector<f64>) -> DVector<f64> {
    shared.clone().push(1.0)
}

impl Eliminated {
    /// What its own unknowns take out of the products over the shared unknowns and the residual.
    pub(super) fn taken_out(&self) -> DMatrix<f64> {
        let coupling = self.coupling.rows(0, self.n_shared() + 1);
        coupling * self.own_inverse * coupling.transpose()
    }

    /// Products of its residual with the shared unknowns.
    pub(super) fn score(&self) -> DVector<f64> {
        self.rest.view((0, 0), (self.n_shared(), 1)).column(0).into_owned()
    }

    /// Products of the amplitudes of its errors with its residual.
    pub(super) fn errors_by_residual(&self) -> DVector<f64> {
        self.rest.view((self.n_shared() + 1, 0), (self.errors.len(), 1)).column(0).into_owned()
    }

    /// Products of the amplitudes of its errors, a row each, with the shared unknowns and the residual.
    pub(super) fn errors_by_shared(&self) -> DMatrix<f64> {
        self.rest.view((0, 1), (self.n_shared() + 1, self.errors.len())).transpose()
    }

    /// The same with each other.
    pub(super) fn errors_by_errors(&self) -> DMatrix<f64> {
        let n = self.errors.len();
        self.rest.view((self.n_shared() + 1, 1), (n, n)).into_owned()
    }

    /// The step of its own unknowns that goes with one of the shared unknowns and of all amplitudes of its tie.
    pub(super) fn own_step(&self, shared: &DVector<f64>, amplitudes: &DVector<f64>) -> Own {
        let amplitudes = self.errors.iter().map(|error| amplitudes[*error]);
        let rest = shared.iter().copied().chain([1.0]).chain(amplitudes);
        let side = self.coupling.tr_mul(&DVector::from_iterator(self.coupling.nrows(), rest));
        -(self.own_inverse * Own::new(side[0], side[1]))
    }

    /// Derivatives of the own unknowns by the shared ones, the amplitudes held.
    pub(super) fn own_by_shared(&self) -> OMatrix<f64, U2, Dyn> {
        self.own_by(0, self.n_shared())
    }

    /// Derivatives of the own unknowns by the amplitudes of so many errors of its tie.
    pub(super) fn own_by_errors(&self, n_errors: usize) -> OMatrix<f64, U2, Dyn> {
        let mut by = OMatrix::<f64, U2, Dyn>::zeros(n_errors);
        let of_its_own = self.own_by(self.n_shared() + 1, self.errors.len());
        self.errors.iter().zip(of_its_own.column_iter()).for_each(|(error, own)| by.set_column(*error, &own));
        by
    }

    fn own_by(&self, first: usize, n: usize) -> OMatrix<f64, U2, Dyn> {
        -(self.own_inverse * self.coupling.rows(first, n).transpose())
    }

    /// Number of shared unknowns.
    fn n_shared(&self) -> usize {
        self.coupling.nrows() - self.errors.len() - 1
    }
}
