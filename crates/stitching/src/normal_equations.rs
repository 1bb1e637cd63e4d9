//! Least squares for the drives and trigger offsets of all recordings, with the bodies' responses eliminated (variable projection).

use nalgebra::{DMatrix, DVector};

use crate::body_response::Contribution;
use crate::fitted_body::{FittedBody, FittedTime};

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
///
/// The responses that the derivatives are made of are fitted to the readings, noise and all, so that squares of them hold the noise's
/// square at every sample, before the wave as well as behind it. Where the readings hardly tell a direction (a view that shares with the
/// others a body's onset alone, which grows alike under a stronger drive and an earlier trigger) that is most of what is there: steps
/// would be too short to arrive, and the covariance too small. So its expectation is subtracted, as it is from a regression with errors
/// in its variables (W. A. Fuller, Measurement Error Models, Wiley 1987, ch. 1 and 3); the right side needs none of that, as a residual
/// does not correlate with the response that was fitted to the same readings.
pub(crate) struct NormalEquations {
    n_recordings: usize,
    matrix: DMatrix<f64>,
    /// What noise in the responses adds to the matrix.
    noise: DMatrix<f64>,
    right_side: DVector<f64>,
}

/// Least share of the matrix that is taken for the readings' own in a direction: what is less is not told from noise.
const LEAST_SHARE: f64 = 0.1;
/// The same where a step is made: half of the way, for the readings bend.
const LEAST_SHARE_OF_STEP: f64 = 0.5;
/// Share of noise that changes a standard uncertainty by less than a hundredth.
const NO_SHARE: f64 = 0.02;

impl NormalEquations {
    pub(crate) fn new(n_recordings: usize) -> Self {
        let n = 2 * n_recordings;
        let noise = DMatrix::zeros(n_recordings, n_recordings);
        Self { n_recordings, matrix: DMatrix::zeros(n, n), noise, right_side: DVector::zeros(n) }
    }

    /// Adds the readings of one body at one time, fitted by `response` at the present drives and offsets.
    pub(crate) fn add(&mut self, FittedTime { contributions, response }: FittedTime<'_>, drive: &[f64]) {
        for one in contributions {
            let s = drive[one.recording];
            let residual_m = one.read.value - response.at(s);
            let one_slopes = response.residual_slopes(s);
            let beside = response.beside(one, drive);
            for other in contributions {
                let other_slopes = response.residual_slopes(drive[other.recording]);
                let free = beside.free_weight(other, drive);
                self.noise[(one.recording, other.recording)] +=
                    free * beside.slope_noise(drive[other.recording]);
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
    pub(crate) fn solve(mut self, drive: &[f64], offsets_s: &[f64], prior: Prior) -> Option<Solved> {
        let n = self.n_recordings;
        for r in 0..n {
            self.matrix[(r, r)] += prior.drive.powi(-2);
            self.right_side[r] -= drive[r] * prior.drive.powi(-2);
            self.matrix[(n + r, n + r)] += prior.offset_s.powi(-2);
            self.right_side[n + r] -= offsets_s[r] * prior.offset_s.powi(-2);
        }
        // Offsets are microseconds and drives per cent: unit diagonal before factoring.
        let scale = self.matrix.diagonal().map(|entry| entry.sqrt().recip());
        let scaled = |matrix: &DMatrix<f64>| {
            DMatrix::from_fn(2 * n, 2 * n, |row, column| scale[row] * matrix[(row, column)] * scale[column])
        };
        let mut noise = DMatrix::zeros(2 * n, 2 * n);
        noise.view_mut((0, 0), (n, n)).copy_from(&self.noise);
        let without = Without::noise(&scaled(&self.matrix), &scaled(&noise))?;
        let covariance = scaled(&without.covariance);
        let right_side = self.right_side.component_mul(&scale);
        let solution = (without.inverse_of_step * right_side).component_mul(&scale);
        let centring = centring(n);
        Some(Solved {
            solution: &centring * solution,
            covariance: &centring * covariance * &centring,
            matrix: self.matrix,
        })
    }
}

/// A step of the alignment.
pub(crate) struct Solved {
    /// Corrections of the drives, then of the offsets in seconds, with their means taken out.
    pub(crate) solution: DVector<f64>,
    /// Their covariance.
    pub(crate) covariance: DMatrix<f64>,
    /// The matrix of the normal equations, noise and all.
    pub(crate) matrix: DMatrix<f64>,
}

impl Solved {
    /// An upper bound of the length of a step in standard uncertainties.
    pub(crate) fn length(&self, step: &DVector<f64>) -> f64 {
        (step.transpose() * &self.matrix * step)[0].max(0.0).sqrt()
    }
}

/// What is left of a positive definite matrix M with noise N in it.
struct Without {
    /// `(M - N)^-1 M (M - N)^-1`: the right side scatters by all of the matrix.
    covariance: DMatrix<f64>,
    /// `(M - N)^-1`, of which a step is made.
    inverse_of_step: DMatrix<f64>,
}

impl Without {
    /// No direction keeps less than [`LEAST_SHARE`] of M in the covariance, and [`LEAST_SHARE_OF_STEP`] in the step. `None` of a matrix
    /// that is not positive definite.
    fn noise(matrix: &DMatrix<f64>, noise: &DMatrix<f64>) -> Option<Self> {
        let is_below = |share: f64| (matrix * share - noise).cholesky().is_some();
        if is_below(NO_SHARE) {
            let inverse = (matrix - noise).cholesky()?.inverse();
            return Some(Self { covariance: inverse.clone(), inverse_of_step: inverse });
        }
        if is_below(1.0 - LEAST_SHARE_OF_STEP) {
            let inverse = (matrix - noise).cholesky()?.inverse();
            return Some(Self { covariance: &inverse * matrix * &inverse, inverse_of_step: inverse });
        }
        // With M = L L^T the noise's share in each direction is an eigenvalue of L^-1 N L^-T.
        let factor = matrix.clone().cholesky()?.l();
        let left = factor.solve_lower_triangular(noise)?;
        let shares = factor.solve_lower_triangular(&left.transpose())?;
        let eigen = (0.5 * (&shares + shares.transpose())).symmetric_eigen();
        let back = factor.transpose().solve_upper_triangular(&eigen.eigenvectors)?;
        let with = |of_share: &dyn Fn(f64) -> f64| {
            &back * DMatrix::from_diagonal(&eigen.eigenvalues.map(of_share)) * back.transpose()
        };
        let kept = |share: f64, least: f64| (1.0 - share).clamp(least, 1.0);
        Some(Self {
            covariance: with(&|share| kept(share, LEAST_SHARE).powi(-2)),
            inverse_of_step: with(&|share| kept(share, LEAST_SHARE_OF_STEP).recip()),
        })
    }
}

/// What a constant error of one body's readings does to the right side of the normal equations: column r is the derivative by
/// the error of recording r.
pub(crate) fn offset_sensitivity<'a>(
    of_body: impl Iterator<Item = FittedTime<'a>>,
    drive: &[f64],
) -> DMatrix<f64> {
    let n = drive.len();
    let mut sensitivity = DMatrix::zeros(2 * n, n);
    for FittedTime { contributions, response } in of_body {
        for one in contributions {
            let slopes = response.residual_slopes(drive[one.recording]);
            let beside = response.beside(one, drive);
            for other in contributions {
                let free = beside.free_weight(other, drive);
                for (kind, slope) in slopes.iter().enumerate() {
                    sensitivity[(kind * n + one.recording, other.recording)] -= slope * free;
                }
            }
        }
    }
    sensitivity
}

/// What errors of one body's readings, in metres by recording and time, do to the right side of the normal equations.
pub(crate) fn error_sensitivity(
    of_body: &FittedBody,
    drive: &[f64],
    error_m: impl Fn(usize, usize) -> f64,
) -> DVector<f64> {
    let n = drive.len();
    let mut sensitivity = DVector::zeros(2 * n);
    for (time, FittedTime { contributions, response }) in of_body.times().enumerate() {
        for one in contributions {
            let beside = response.beside(one, drive);
            let of_pair =
                |other: &Contribution| beside.free_weight(other, drive) * error_m(other.recording, time);
            let weighted: f64 = contributions.iter().map(of_pair).sum();
            for (kind, slope) in response.residual_slopes(drive[one.recording]).iter().enumerate() {
                sensitivity[kind * n + one.recording] -= slope * weighted;
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
