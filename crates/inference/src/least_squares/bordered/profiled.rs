//! Some unknowns with others at their best for each of their values.

use nalgebra::{DMatrix, DVector};

use super::SharedSystem;

/// The equations of some shared unknowns, with others following them to where the sum of squares is least: their Schur complement.
#[derive(Debug, Clone)]
pub(crate) struct Profiled {
    pub(crate) matrix: DMatrix<f64>,
    pub(crate) side: DVector<f64>,
    /// How far each of the others goes with each of them.
    pub(crate) followed: DMatrix<f64>,
}

impl SharedSystem {
    /// `None` where the others are open.
    pub(crate) fn profiled(&self, of: &[usize], others: &[usize]) -> Option<Profiled> {
        let block = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| self.matrix[(rows[i], columns[j])])
        };
        let scale = DVector::from_fn(others.len(), |i, _| self.matrix[(others[i], others[i])].sqrt().recip());
        let scaled = DMatrix::from_diagonal(&scale);
        let factor = (&scaled * block(others, others) * &scaled).cholesky()?;
        let followed = -(&scaled * factor.solve(&(&scaled * block(others, of))));
        let side_of = |places: &[usize]| DVector::from_fn(places.len(), |i, _| self.side[places[i]]);
        Some(Profiled {
            matrix: block(of, of) + block(of, others) * &followed,
            side: side_of(of) + followed.tr_mul(&side_of(others)),
            followed,
        })
    }
}
