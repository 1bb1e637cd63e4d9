//! The products of all residuals and their derivatives by what all of them share.

use std::num::NonZero;

use chainwave_measurement::map_in_parallel;
use nalgebra::{DMatrix, DVector};

/// Products of residuals and their derivatives by the shared unknowns: a symmetric matrix over these and, last, the residual itself. Only the
/// lower triangle is filled.
#[derive(Debug, Clone)]
pub(crate) struct SharedProducts {
    products: DMatrix<f64>,
}

/// Rows whose products are added up together, so that a column of the sums is fetched once for all of them.
const ROWS_TOGETHER: usize = 32;
/// Columns whose sums one thread makes: whatever their number, each sum is made in one order.
const COLUMNS_TOGETHER: usize = 16;

impl SharedProducts {
    pub(crate) fn new(n_shared: usize) -> Self {
        Self { products: DMatrix::zeros(n_shared + 1, n_shared + 1) }
    }

    /// Number of shared unknowns.
    pub(super) fn n_shared(&self) -> usize {
        self.products.nrows() - 1
    }

    /// Adds residuals of unit variance: the derivatives of each by the shared unknowns and, last, itself. What one does not depend on costs
    /// nothing.
    pub(crate) fn add_rows(&mut self, rows: &[&[f64]], n_threads: NonZero<usize>) {
        let width = self.products.nrows();
        let stripes = width.div_ceil(COLUMNS_TOGETHER);
        let sums = map_in_parallel(stripes, n_threads, |stripe| {
            let first = stripe * COLUMNS_TOGETHER;
            let columns = first..(first + COLUMNS_TOGETHER).min(width);
            let mut sums: Vec<Vec<f64>> = columns.clone().map(|i| vec![0.0; width - i]).collect();
            for together in rows.chunks(ROWS_TOGETHER) {
                for (i, sums) in columns.clone().zip(&mut sums) {
                    let (fours, rest) = together.as_chunks::<4>();
                    fours.iter().for_each(|four| add_products(sums, i, four));
                    rest.iter().for_each(|row| add_products(sums, i, &[*row]));
                }
            }
            sums
        });
        for (i, sums) in sums.into_iter().flatten().enumerate() {
            let column = &mut self.products.as_mut_slice()[i * width + i..(i + 1) * width];
            column.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
        }
    }

    /// Adds a row with a weight: a residual of that variance, or with a negative one what another unknown takes up.
    pub(super) fn add_weighted(&mut self, row: &[f64], weight: f64) {
        let width = self.products.nrows();
        let columns = self.products.as_mut_slice().chunks_exact_mut(width).enumerate();
        for (i, column) in columns.filter(|(i, _)| row[*i] != 0.0) {
            let share = weight * row[i];
            column[i..].iter_mut().zip(&row[i..]).for_each(|(sum, entry)| *sum += share * entry);
        }
    }

    /// Adds a residual of unit variance that depends on one unknown alone, or on none of these: a prior.
    pub(super) fn add_prior(&mut self, unknown: Option<usize>, residual: f64, slope: f64) {
        let last = self.n_shared();
        if let Some(unknown) = unknown {
            self.products[(unknown, unknown)] += slope * slope;
            self.products[(last, unknown)] += slope * residual;
        }
        self.products[(last, last)] += residual * residual;
    }

    /// Adds to the products of the residual with the unknowns and, last, with itself.
    pub(super) fn add_to_residual(&mut self, more: &DVector<f64>) {
        let last = self.n_shared();
        more.iter().enumerate().for_each(|(i, more)| self.products[(last, i)] += more);
    }

    /// Half of the first rise of the sum of squares along a step of the unknowns.
    pub(super) fn rise(&self, step: &DVector<f64>) -> f64 {
        let n = self.n_shared();
        self.products.view((n, 0), (1, n)).iter().zip(step).map(|(slope, step)| slope * step).sum()
    }

    /// The square of a step of the unknowns by their products.
    pub(super) fn length2(&self, step: &DVector<f64>) -> f64 {
        let n = self.n_shared();
        let below =
            |i: usize| self.products.view((i + 1, i), (n - i - 1, 1)).dot(&step.rows(i + 1, n - i - 1));
        (0..n).map(|i| step[i] * (self.products[(i, i)] * step[i] + 2.0 * below(i))).sum()
    }

    /// Sum of the squared residuals.
    pub(super) fn chi_squared(&self) -> f64 {
        self.products[(self.n_shared(), self.n_shared())]
    }

    /// All of the symmetric matrix, every diagonal entry but the residual's raised by the share `damping`.
    pub(super) fn damped(&self, damping: f64) -> DMatrix<f64> {
        let last = self.n_shared();
        let mut all = self.products.clone();
        all.fill_upper_triangle_with_lower_triangle();
        (0..last).for_each(|i| all[(i, i)] *= 1.0 + damping);
        all
    }
}

/// Adds the products of one entry of each of some rows with those from it on, so that each sum is fetched once for all of them.
fn add_products<const N: usize>(sums: &mut [f64], i: usize, rows: &[&[f64]; N]) {
    let factors = rows.map(|row| row[i]);
    if factors.iter().all(|factor| *factor == 0.0) {
        return;
    }
    let entries = rows.map(|row| &row[i..i + sums.len()]);
    for (k, sum) in sums.iter_mut().enumerate() {
        *sum += (0..N).map(|row| factors[row] * entries[row][k]).sum::<f64>();
    }
}
