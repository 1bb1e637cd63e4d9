//! How much of errors of a known shape the readings show: what the bodies that several recordings saw say of it.

use chainwave_measurement::SharedReadingError;
use nalgebra::{DMatrix, DVector};

use crate::body_response::Contribution;
use crate::error::StitchingError;
use crate::fitted::Fitted;
use crate::fitted_body::FittedTime;
use crate::normal_equations::error_sensitivity;
use crate::reading_error::{RowError, on_time_base};
use crate::state::AlignmentState;

/// What one body says of the amplitudes of the errors that were asked for ([`crate::Settings::asked_errors`]).
///
/// Over all bodies, the sum of `matrix` times the amplitudes is the sum of `right_side`: normal equations from which motion, drives and
/// triggers are eliminated, in units of 1 over the variance of the noise that the readings state. An amplitude of 1 is the error as it was given.
/// Bodies that one recording saw, or several at the same place of their pictures, say nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownByBody {
    /// The body's number, from 1.
    pub body: usize,
    /// Square, a row for each error.
    pub matrix: DMatrix<f64>,
    /// One for each error.
    pub right_side: DVector<f64>,
}

impl AlignmentState<'_> {
    /// What each body that any of the errors moves shows of them.
    ///
    /// # Errors
    /// [`StitchingError::Singular`] where the alignment cannot be solved.
    pub(crate) fn shown(&self, field: &Fitted) -> Result<Vec<ShownByBody>, StitchingError> {
        let asked = &self.settings.asked_errors;
        if asked.is_empty() {
            return Ok(Vec::new());
        }
        let of_error = |error: &SharedReadingError| {
            on_time_base(error, self.observations, &self.offsets_s, &self.times_s)
        };
        let of_errors: Vec<Vec<RowError>> = asked.iter().map(of_error).collect();
        let at = |k: usize, row: usize| of_errors[k].iter().find(|one| one.row == row);
        // How an error moves drives and offsets, which follow it.
        let sensitivity = |row: usize| -> DMatrix<f64> {
            let column = |k: usize| match at(k, row) {
                Some(error) => error_sensitivity(&field[row], &self.drive, |r, i| error.at(r, i)),
                None => DVector::zeros(2 * self.drive.len()),
            };
            DMatrix::from_columns(&(0..asked.len()).map(column).collect::<Vec<_>>())
        };
        let rows: Vec<usize> =
            (0..field.len()).filter(|row| (0..asked.len()).any(|k| at(k, *row).is_some())).collect();
        let of_rows: Vec<DMatrix<f64>> = rows.iter().map(|row| sensitivity(*row)).collect();
        let Some(whole) = of_rows.iter().cloned().reduce(|sum, one| sum + one) else { return Ok(Vec::new()) };
        // By the whole matrix, noise in the responses and all: what is left of an error then is never less than nothing.
        let singular = || StitchingError::Singular { n_recordings: self.drive.len() };
        let followed = self.solved(field)?.matrix.cholesky().ok_or_else(singular)?.solve(&whole);
        let shows = |(row, own): (&usize, &DMatrix<f64>)| {
            let (matrix, right_side, of_alignment) =
                self.own_equations(field, *row, asked.len(), |k, r, i| {
                    at(k, *row).map_or(0.0, |error| error.at(r, i))
                });
            ShownByBody {
                body: row + 1,
                matrix: matrix - own.transpose() * &followed,
                right_side: right_side - followed.transpose() * of_alignment,
            }
        };
        Ok(rows.iter().zip(&of_rows).map(shows).collect())
    }

    /// The equations of the amplitudes alone, from the residuals of one body, and the right side of the alignment's from the same.
    fn own_equations(
        &self,
        field: &Fitted,
        row: usize,
        n_errors: usize,
        error_m: impl Fn(usize, usize, usize) -> f64,
    ) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
        let n = self.drive.len();
        let mut matrix = DMatrix::zeros(n_errors, n_errors);
        let (mut right_side, mut of_alignment) = (DVector::zeros(n_errors), DVector::zeros(2 * n));
        let of_several = field[row].times().enumerate().filter(|(_, at)| at.contributions.len() > 1);
        for (i, FittedTime { contributions, response }) in of_several {
            for one in contributions {
                let s = self.drive[one.recording];
                let residual = one.weight() * (one.read.value - response.at(s));
                let beside = response.beside(one, &self.drive);
                for k in 0..n_errors {
                    let own_m = error_m(k, one.recording, i);
                    right_side[k] += own_m * residual;
                    for l in 0..n_errors {
                        let free = |other: &Contribution| {
                            beside.free_weight(other, &self.drive) * error_m(l, other.recording, i)
                        };
                        matrix[(k, l)] += own_m * contributions.iter().map(free).sum::<f64>();
                    }
                }
                for (kind, slope) in response.residual_slopes(s).iter().enumerate() {
                    of_alignment[kind * n + one.recording] -= slope * residual;
                }
            }
        }
        (matrix, right_side, of_alignment)
    }
}
