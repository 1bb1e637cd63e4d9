//! The products of one recording's residuals and their derivatives.

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, U2};

use super::{N_OWN, Own};

/// Products of one recording's residuals and their derivatives: a symmetric matrix over the recording's own unknowns, the shared ones, the residual itself, and the
/// amplitudes of errors that it shares with others. Only the lower triangle is filled.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    pub(super) n_errors: usize,
    products: DMatrix<f64>,
}

/// A residual in units of its sigma, with what it depends on.
pub(crate) struct Row<'a> {
    /// Its derivatives by own and shared unknowns, and last itself.
    pub(crate) entries: &'a [f64],
    /// Its derivatives by the amplitudes of errors, by their numbers, as far as it depends on them.
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
    /// Over the shared unknowns, the amplitudes of errors and, last, the residual.
    pub(super) products: DMatrix<f64>,
    pub(super) coupling: DMatrix<f64>,
    pub(super) own_inverse: Matrix2<f64>,
}

impl RestSums {
    /// Over so many shared unknowns and amplitudes of errors.
    pub(crate) fn new(n_shared: usize, n_errors: usize) -> Self {
        Self { weighted: vec![0.0; N_OWN + n_shared + 1 + n_errors], weight: 0.0 }
    }
}

impl Block {
    /// Over so many shared unknowns, and amplitudes of errors that the recording shares with others.
    pub(crate) fn new(n_shared: usize, n_errors: usize) -> Self {
        let width = N_OWN + n_shared + 1 + n_errors;
        Self { n_errors, products: DMatrix::zeros(width, width) }
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

    /// Where the amplitudes begin, behind the residual.
    pub(super) fn first_error(&self) -> usize {
        self.products.nrows() - self.n_errors
    }

    pub(super) fn product(&self, i: usize, j: usize) -> f64 {
        self.products[(i.max(j), i.min(j))]
    }

    /// Adds errors of these amplitudes to the model.
    pub(super) fn take_out(&mut self, amplitudes: &DVector<f64>) {
        let (first_error, residual) = (self.first_error(), self.first_error() - 1);
        let effect = |i: usize| -> f64 {
            let terms = amplitudes.iter().enumerate();
            terms.map(|(k, amplitude)| amplitude * self.product(i, first_error + k)).sum()
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
        let last = self.first_error() - 1;
        self.products[(own, own)] += slope * slope;
        self.products[(last, own)] += slope * residual;
        self.products[(last, last)] += residual * residual;
    }

    /// Sum of squared residuals.
    pub(crate) fn chi_squared(&self) -> f64 {
        let last = self.first_error() - 1;
        self.products[(last, last)]
    }

    pub(super) fn own_covariance(&self) -> Option<Matrix2<f64>> {
        Some(Matrix2::from_fn(|i, j| self.product(i, j)).cholesky()?.inverse())
    }

    /// Without the recording's own unknowns: over the shared ones, the amplitudes and last the residual.
    pub(super) fn eliminated(&self, damping: f64) -> Option<Eliminated> {
        let (n, first_error) = (self.products.nrows(), self.first_error());
        let n_unknowns = first_error - 1;
        let place = |i: usize| match i {
            _ if i < n_unknowns => i,
            _ if i + 1 < n => i + 1,
            _ => n_unknowns,
        };
        let full = DMatrix::from_fn(n, n, |i, j| {
            let raised = if i == j && i < n_unknowns { 1.0 + damping } else { 1.0 };
            raised * self.product(place(i), place(j))
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

impl Eliminated {
    pub(super) fn own_step(&self, shared: &DVector<f64>) -> Own {
        let extended = shared.clone().push(1.0);
        let side = self.coupling.tr_mul(&extended);
        -(self.own_inverse * Own::new(side[0], side[1]))
    }

    /// Derivatives of the own unknowns by the shared ones and the amplitudes of errors.
    pub(super) fn own_by_rest(&self) -> OMatrix<f64, U2, Dyn> {
        -(self.own_inverse * self.coupling.rows(0, self.coupling.nrows() - 1).transpose())
    }
}
