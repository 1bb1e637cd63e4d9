//! The products of one recording's residuals and their derivatives.

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, U2};

use super::{N_OWN, Own};

/// Products of one recording's residuals and their derivatives: a symmetric matrix over the recording's own unknowns, the shared ones, the
/// residual itself, and the amplitudes of those errors that it shares with others. Only the lower triangle is filled.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    /// Which of its tie's errors it has, in the order of their columns.
    pub(super) errors: Vec<usize>,
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

/// Rows whose products are added up together, so that a column of the sums is fetched once for all of them.
const ROWS_TOGETHER: usize = 32;

/// One recording after elimination of its own unknowns.
#[derive(Debug, Clone)]
pub(super) struct Eliminated {
    /// Which of its tie's errors it has.
    pub(super) errors: Vec<usize>,
    /// Over the shared unknowns, the residual, and the amplitudes of its errors.
    pub(super) products: DMatrix<f64>,
    /// Of these with its own unknowns.
    coupling: DMatrix<f64>,
    pub(super) own_inverse: Matrix2<f64>,
}

impl RestSums {
    /// Over so many shared unknowns, and amplitudes of errors that the recording has.
    pub(crate) fn new(n_shared: usize, n_errors: usize) -> Self {
        Self { weighted: vec![0.0; N_OWN + n_shared + 1 + n_errors], weight: 0.0 }
    }
}

impl Block {
    /// Over so many shared unknowns, and the amplitudes of those of its tie's errors that the recording has.
    pub(crate) fn new(n_shared: usize, errors: &[usize]) -> Self {
        let width = N_OWN + n_shared + 1 + errors.len();
        Self { errors: errors.to_vec(), products: DMatrix::zeros(width, width) }
    }

    /// Adds rows of one track. What a row does not depend on costs nothing.
    pub(crate) fn add_rows<'a>(&mut self, rows: impl Iterator<Item = Row<'a>>, of_track: &mut RestSums) {
        let mut together: Vec<&[f64]> = Vec::with_capacity(ROWS_TOGETHER);
        let first_error = self.first_error();
        for Row { entries, errors, inverse_sigma } in rows {
            let weighted = of_track.weighted.iter_mut().zip(entries);
            weighted.for_each(|(sum, entry)| *sum += inverse_sigma * entry);
            of_track.weight += inverse_sigma * inverse_sigma;
            for (error, slope) in &errors {
                of_track.weighted[first_error + error] += inverse_sigma * slope;
                self.add_error(entries, &errors, (*error, *slope));
            }
            together.push(entries);
            if together.len() == ROWS_TOGETHER {
                self.add_together(&together);
                together.clear();
            }
        }
        self.add_together(&together);
    }

    fn add_together(&mut self, rows: &[&[f64]]) {
        let (width, first_error) = (self.products.nrows(), self.first_error());
        let columns = self.products.as_mut_slice().chunks_exact_mut(width);
        for (i, column) in columns.take(first_error).enumerate() {
            for row in rows.iter().filter(|row| row[i] != 0.0) {
                column[i..].iter_mut().zip(&row[i..]).for_each(|(sum, entry)| *sum += row[i] * entry);
            }
        }
    }

    /// Adds the products of one error's slope with a row's entries, and with the slopes of errors up to its own number.
    fn add_error(&mut self, entries: &[f64], errors: &[(usize, f64)], (error, slope): (usize, f64)) {
        let first_error = self.first_error();
        for (i, entry) in entries.iter().enumerate() {
            self.products[(first_error + error, i)] += slope * entry;
        }
        for (other, other_slope) in errors.iter().filter(|(other, _)| *other <= error) {
            self.products[(first_error + error, first_error + other)] += slope * other_slope;
        }
    }

    /// Frees a track's place at rest: the mean row, by weight, is taken out of all.
    pub(crate) fn free_rest(&mut self, of_track: &RestSums) {
        let RestSums { weighted, weight } = of_track;
        let width = self.products.nrows();
        let columns = self.products.as_mut_slice().chunks_exact_mut(width).enumerate();
        for (i, column) in columns.filter(|(i, _)| weighted[*i] != 0.0) {
            let share = weighted[i] / weight.max(f64::MIN_POSITIVE);
            column[i..].iter_mut().zip(&weighted[i..]).for_each(|(sum, entry)| *sum -= share * entry);
        }
    }

    /// Where the amplitudes begin.
    pub(super) fn first_error(&self) -> usize {
        self.residual() + 1
    }

    /// Where the residual stands.
    pub(super) fn residual(&self) -> usize {
        self.products.nrows() - self.errors.len() - 1
    }

    pub(super) fn product(&self, i: usize, j: usize) -> f64 {
        self.products[(i.max(j), i.min(j))]
    }

    /// Adds errors to the model, of these amplitudes of its tie's.
    pub(super) fn take_out(&mut self, amplitudes: &DVector<f64>) {
        let (first_error, residual) = (self.first_error(), self.residual());
        let amplitudes: Vec<f64> = self.errors.iter().map(|error| amplitudes[*error]).collect();
        let effect = |i: usize| -> f64 {
            let terms = amplitudes.iter().zip(first_error..);
            terms.map(|(amplitude, error)| amplitude * self.product(i, error)).sum()
        };
        let effects: Vec<f64> = (0..self.products.nrows()).map(effect).collect();
        let of_errors = amplitudes.iter().zip(&effects[first_error..]);
        let of_squares: f64 = of_errors.map(|(amplitude, effect)| amplitude * effect).sum();
        for (i, effect) in effects.iter().enumerate() {
            self.products[(i.max(residual), i.min(residual))] += effect;
        }
        self.products[(residual, residual)] += effects[residual] + of_squares;
    }

    /// Adds a residual of unit variance that depends on one own unknown alone: a prior.
    pub(crate) fn add_prior(&mut self, own: usize, residual: f64, slope: f64) {
        let last = self.residual();
        self.products[(own, own)] += slope * slope;
        self.products[(last, own)] += slope * residual;
        self.products[(last, last)] += residual * residual;
    }

    /// Sum of squared residuals.
    pub(crate) fn chi_squared(&self) -> f64 {
        self.product(self.residual(), self.residual())
    }

    pub(super) fn own_covariance(&self) -> Option<Matrix2<f64>> {
        Some(Matrix2::from_fn(|i, j| self.product(i, j)).cholesky()?.inverse())
    }

    /// Without the recording's own unknowns, every diagonal entry but the residual's raised by the share `damping`.
    pub(super) fn eliminated(&self, damping: f64) -> Option<Eliminated> {
        let (n, residual) = (self.products.nrows(), self.residual());
        let raised = |i: usize, j: usize| {
            let factor = if i == j && i != residual { 1.0 + damping } else { 1.0 };
            factor * self.product(i, j)
        };
        let own_inverse = Matrix2::from_fn(raised).cholesky()?.inverse();
        let coupling = DMatrix::from_fn(n - N_OWN, N_OWN, |i, j| raised(N_OWN + i, j));
        let rest = DMatrix::from_fn(n - N_OWN, n - N_OWN, |i, j| raised(N_OWN + i, N_OWN + j));
        let products = rest - &coupling * own_inverse * coupling.transpose();
        Some(Eliminated { errors: self.errors.clone(), products, coupling, own_inverse })
    }
}

/// A step of the shared unknowns as it multiplies the products over these and the residual.
pub(super) fn with_residual(shared: &DVector<f64>) -> DVector<f64> {
    shared.clone().push(1.0)
}

impl Eliminated {
    /// The step of its own unknowns that goes with one of the shared unknowns and of all amplitudes of its tie.
    pub(super) fn own_step(&self, shared: &DVector<f64>, amplitudes: &DVector<f64>) -> Own {
        let amplitudes = self.errors.iter().map(|error| amplitudes[*error]);
        let rest = DVector::from_iterator(
            self.coupling.nrows(),
            with_residual(shared).iter().copied().chain(amplitudes),
        );
        let side = self.coupling.tr_mul(&rest);
        -(self.own_inverse * Own::new(side[0], side[1]))
    }

    /// Derivatives of the own unknowns by the shared ones, the amplitudes held.
    pub(super) fn own_by_shared(&self) -> OMatrix<f64, U2, Dyn> {
        self.own_by(0..self.n_shared())
    }

    /// Derivatives of the own unknowns by the amplitudes of so many errors of its tie.
    pub(super) fn own_by_errors(&self, n_errors: usize) -> OMatrix<f64, U2, Dyn> {
        let mut by = OMatrix::<f64, U2, Dyn>::zeros(n_errors);
        let of_its_own = self.own_by(self.n_shared() + 1..self.coupling.nrows());
        self.errors.iter().zip(of_its_own.column_iter()).for_each(|(error, own)| by.set_column(*error, &own));
        by
    }

    fn own_by(&self, rest: std::ops::Range<usize>) -> OMatrix<f64, U2, Dyn> {
        -(self.own_inverse * self.coupling.rows_range(rest).transpose())
    }

    /// Number of shared unknowns.
    pub(super) fn n_shared(&self) -> usize {
        self.products.nrows() - self.errors.len() - 1
    }
}
