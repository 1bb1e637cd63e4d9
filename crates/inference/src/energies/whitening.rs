//! Whitening of a few values by their covariance.

use nalgebra::{DMatrix, DVector};
use ndarray::Array2;

use crate::error::FitError;

/// The whitening of a short vector by the Cholesky factor of its covariance.
pub(super) fn cholesky_whitening(
    covariance: &Array2<f64>,
    what: &'static str,
) -> Result<impl Fn(Vec<f64>) -> DVector<f64>, FitError> {
    let matrix = DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |i, j| covariance[(i, j)]);
    let factor = matrix.cholesky().ok_or(FitError::SingularCovariance { what })?.l();
    Ok(move |values: Vec<f64>| {
        let values = DVector::from_vec(values);
        factor.solve_lower_triangular(&values).unwrap_or(values)
    })
}
