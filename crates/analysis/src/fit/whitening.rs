use chainwave_measurement::ChainMotion;
use nalgebra::{DMatrix, DVector};
use ndarray::Array2;

use super::FitError;

/// Turns a strain field into residual units: independent, of unit variance.
///
/// The errors of the strain have the covariance B + U U^T. B holds the bodies' independent errors: at one time it is tridiagonal
/// over the gaps, because neighbours share a body. U holds the motion's error modes. First B's Cholesky factor whitens, gap by
/// gap at each time; then, with W the modes whitened so, (I + W W^T)^(-1/2) = I - V (1 - (1 + lambda)^(-1/2)) V^T with the
/// orthonormal V and the eigenvalues lambda of W W^T, found from the small matrix W^T W.
pub(super) struct FieldWhitening {
    pitch_m: f64,
    entries: Vec<Entry>,
    directions: DMatrix<f64>,
    shrinking: DVector<f64>,
}

/// One measured strain: gap row and time index, and its row of the Cholesky factor.
struct Entry {
    gap: usize,
    time: usize,
    diagonal: f64,
    /// Factor's element to the left, where the gap before it was measured too.
    left: f64,
}

impl FieldWhitening {
    pub(super) fn new(motion: &ChainMotion, pitch_m: f64) -> Result<Self, FitError> {
        const LEAST_STRAINS: usize = 100;
        let entries = entries(motion, pitch_m)?;
        if entries.len() < LEAST_STRAINS {
            return Err(FitError::TooFew { what: "strains", expected: LEAST_STRAINS, found: entries.len() });
        }
        let mut whitening =
            Self { pitch_m, entries, directions: DMatrix::zeros(0, 0), shrinking: DVector::zeros(0) };
        whitening.add_modes(motion);
        Ok(whitening)
    }

    /// The strains of a displacement field at the measured places, in their order.
    pub(super) fn strain_of(&self, displacement_m: impl Fn(usize, usize) -> Option<f64>) -> Vec<f64> {
        let strain = |entry: &Entry| {
            let near = displacement_m(entry.gap, entry.time).unwrap_or(0.0);
            let far = displacement_m(entry.gap + 1, entry.time).unwrap_or(0.0);
            (far - near) / self.pitch_m
        };
        self.entries.iter().map(strain).collect()
    }

    /// Whitens a strain field given in the order of [`FieldWhitening::strain_of`].
    pub(super) fn whiten(&self, strain: &[f64]) -> DVector<f64> {
        let mut white = self.whiten_independent(strain);
        if self.directions.ncols() > 0 {
            let along = self.directions.tr_mul(&white).component_mul(&self.shrinking);
            white -= &self.directions * along;
        }
        white
    }

    fn whiten_independent(&self, strain: &[f64]) -> DVector<f64> {
        let mut before = 0.0;
        let whitened = self.entries.iter().zip(strain).map(|(entry, value)| {
            before = (value - entry.left * before) / entry.diagonal;
            before
        });
        DVector::from_iterator(strain.len(), whitened)
    }

    fn add_modes(&mut self, motion: &ChainMotion) {
        let columns: Vec<DVector<f64>> = motion
            .modes
            .iter()
            .map(|mode| {
                self.whiten_independent(&self.strain_of(|row, i| Some(mode.displacement_m[(row, i)])))
            })
            .collect();
        if columns.is_empty() {
            return;
        }
        let modes = DMatrix::from_columns(&columns);
        let eigen = modes.tr_mul(&modes).symmetric_eigen();
        // A mode that moves no strain has no direction of its own.
        let kept: Vec<usize> = (0..columns.len()).filter(|k| eigen.eigenvalues[*k] > 1e-9).collect();
        let direction = |k: &usize| &modes * eigen.eigenvectors.column(*k) / eigen.eigenvalues[*k].sqrt();
        let directions: Vec<DVector<f64>> = kept.iter().map(direction).collect();
        if !directions.is_empty() {
            self.directions = DMatrix::from_columns(&directions);
            let shrinking = kept.iter().map(|k| 1.0 - (1.0 + eigen.eigenvalues[*k]).sqrt().recip());
            self.shrinking = DVector::from_iterator(kept.len(), shrinking);
        }
    }
}

/// The measured strains, time by time, with the Cholesky factor of their independent errors.
fn entries(motion: &ChainMotion, pitch_m: f64) -> Result<Vec<Entry>, FitError> {
    let mut entries: Vec<Entry> = Vec::new();
    for time in 0..motion.times_s.len() {
        for gap in 0..motion.n_bodies().saturating_sub(1) {
            let seen = |row: usize| motion.displacement_m[(row, time)].is_some();
            if !(seen(gap) && seen(gap + 1)) {
                continue;
            }
            let variance = |row: usize| (motion.independent_sigma_m[(row, time)] / pitch_m).powi(2);
            let neighbour = entries.last().filter(|last| last.time == time && last.gap + 1 == gap);
            let left = neighbour.map_or(0.0, |last| -variance(gap) / last.diagonal);
            let diagonal = (variance(gap) + variance(gap + 1) - left * left).sqrt();
            if diagonal.is_nan() || diagonal <= 0.0 {
                return Err(FitError::SingularCovariance { what: "strain field" });
            }
            entries.push(Entry { gap, time, diagonal, left });
        }
    }
    Ok(entries)
}

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
