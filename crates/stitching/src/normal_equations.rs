//! Least squares for the drives and trigger offsets of all recordings, with the bodies' responses eliminated (variable projection).

use nalgebra::{DMatrix, DVector};

use crate::body_response::{BodyResponse, Contribution, FittedTime};

/// How far trigger offsets and drives may stray, as standard deviations: this decides only what the data leave open.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prior {
    pub(crate) offset_s: f64,
    pub(crate) drive: f64,
}

/// The normal equations for corrections to the drive deviations s_r and the trigger offsets tau_r of all recordings, with
/// every X_n(t), S_n(t) and Q_n(t) eliminated: variable projection (Golub and Pereyra 1973) with Kaufman's derivative.
///
/// Unknown `r` corrects s_r and unknown `n_recordings + r` corrects tau_r.
pub(crate) struct NormalEquations {
    n_recordings: usize,
    matrix: DMatrix<f64>,
    right_side: DVector<f64>,
}

impl NormalEquations {
    pub(crate) fn new(n_recordings: usize) -> Self {
        let n = 2 * n_recordings;
        Self { n_recordings, matrix: DMatrix::zeros(n, n), right_side: DVector::zeros(n) }
    }

    /// Adds the readings of one body at one time, fitted by `response` at the present drives and offsets.
    pub(crate) fn add(&mut self, contributions: &[Contribution], response: &BodyResponse, drive: &[f64]) {
        for one in contributions {
            let s = drive[one.recording];
            let residual_m = one.read.value - response.at(s);
            let one_slopes = response.residual_slopes(s);
            for other in contributions {
                let other_slopes = response.residual_slopes(drive[other.recording]);
                let free = response.free_weight(one, other, drive);
                for (kind, slope) in one_slopes.iter().enumerate() {
                    for (other_kind, other_slope) in other_slopes.iter().enumerate() {
                        let row = kind * self.n_recordings + one.recording;
                        let column = other_kind * self.n_recordings + other.recording;
                        self.matrix[(row, column)] += slope * other_slope * free;
                    }
                }
            }
            for (kind, slope) in one_slopes.iter().enumerate() {
                self.right_side[kind * self.n_recordings + one.recording] -=
                    slope * one.weight() * residual_m;
            }
        }
    }

    /// Solves for the corrections and their covariance, both with the means over the recordings taken out.
    pub(crate) fn solve(
        mut self,
        drive: &[f64],
        offsets_s: &[f64],
        prior: Prior,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let n = self.n_recordings;
        for r in 0..n {
            self.matrix[(r, r)] += prior.drive.powi(-2);
            self.right_side[r] -= drive[r] * prior.drive.powi(-2);
            self.matrix[(n + r, n + r)] += prior.offset_s.powi(-2);
            self.right_side[n + r] -= offsets_s[r] * prior.offset_s.powi(-2);
        }
        // Offsets are microseconds and drives per cent: unit diagonal before factoring.
        let scale = self.matrix.diagonal().map(|entry| entry.sqrt().recip());
        let scaling = DMatrix::from_diagonal(&scale);
        let inverse = (&scaling * self.matrix * &scaling).cholesky()?.inverse();
        let covariance = &scaling * inverse * &scaling;
        let solution = &covariance * self.right_side;
        let centring = centring(n);
        Some((&centring * solution, &centring * covariance * &centring))
    }
}

/// What a constant error of one body's readings does to the right side of the normal equations: column r is the derivative by
/// the error of recording r.
pub(crate) fn offset_sensitivity(of_body: &[FittedTime], drive: &[f64]) -> DMatrix<f64> {
    let n = drive.len();
    let mut sensitivity = DMatrix::zeros(2 * n, n);
    for (contributions, response) in of_body {
        for one in contributions {
            let slopes = response.residual_slopes(drive[one.recording]);
            for other in contributions {
                let free = response.free_weight(one, other, drive);
                for (kind, slope) in slopes.iter().enumerate() {
                    sensitivity[(kind * n + one.recording, other.recording)] -= slope * free;
                }
            }
        }
    }
    sensitivity
}

/// The projection that takes the mean out of the drives and out of the offsets.
fn centring(n_recordings: usize) -> DMatrix<f64> {
    DMatrix::from_fn(2 * n_recordings, 2 * n_recordings, |row, column| {
        let same_kind = (row < n_recordings) == (column < n_recordings);
        f64::from(u8::from(row == column)) - f64::from(u8::from(same_kind)) / n_recordings as f64
    })
}
