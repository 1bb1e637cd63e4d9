//! How well each recording's own unknowns are known, and how well against their mean.

use nalgebra::{DMatrix, Dyn, Matrix2, OMatrix, U2};

use super::Reduced;

/// Covariances of the recordings' own unknowns.
pub(crate) struct OwnCovariance {
    /// Of each recording's.
    pub(crate) of_each: Vec<Matrix2<f64>>,
    /// Of each recording's less the mean over all.
    pub(crate) about_mean: Vec<Matrix2<f64>>,
    /// Of that mean.
    pub(crate) of_mean: Matrix2<f64>,
}

impl OwnCovariance {
    /// What the recordings' own residuals leave open, what the errors that they share do, and what the shared unknowns, of the given covariance,
    /// carry into them.
    pub(crate) fn of(reduced: &Reduced, shared: &DMatrix<f64>) -> Self {
        let recordings = &reduced.recordings;
        let n = recordings.len() as f64;
        let n_shared = shared.nrows();
        let ties: Vec<Option<usize>> = (0..recordings.len()).map(|r| reduced.tie_of(r)).collect();
        let by_errors = |r: usize, tie: usize| recordings[r].own_by_errors(reduced.ties[tie].n_errors());
        // The amplitudes have errors of their own beside what goes with the shared unknowns.
        let by_shared: Vec<OMatrix<f64, U2, Dyn>> =
            (0..recordings.len()).map(|r| reduced.own_by_shared(r)).collect();
        let mut mean = OMatrix::<f64, U2, Dyn>::zeros(n_shared);
        by_shared.iter().for_each(|one| mean += one / n);
        let carried = |by: &OMatrix<f64, U2, Dyn>| by * shared * by.transpose();
        let alone = recordings.iter().map(|recording| recording.own_inverse).sum::<Matrix2<f64>>() / (n * n);
        let means: Vec<OMatrix<f64, U2, Dyn>> = reduced
            .ties
            .iter()
            .enumerate()
            .map(|(k, tie)| {
                let zero = OMatrix::<f64, U2, Dyn>::zeros(tie.n_errors());
                tie.recordings().iter().fold(zero, |sum, r| sum + by_errors(*r, k) / n)
            })
            .collect();
        let of_errors = |tie: usize, by: &OMatrix<f64, U2, Dyn>| reduced.ties[tie].carried(by);
        let of_mean_errors: Vec<Matrix2<f64>> =
            (0..means.len()).map(|tie| of_errors(tie, &means[tie])).collect();
        let all_errors = of_mean_errors.iter().sum::<Matrix2<f64>>();
        let own_errors =
            |r: usize| ties[r].map_or_else(Matrix2::zeros, |tie| of_errors(tie, &by_errors(r, tie)));
        let errors_about_mean = |r: usize| match ties[r] {
            None => all_errors,
            Some(tie) => {
                all_errors - of_mean_errors[tie] + of_errors(tie, &(by_errors(r, tie) - &means[tie]))
            }
        };
        let all = || recordings.iter().zip(&by_shared).enumerate();
        Self {
            of_each: all().map(|(r, (one, by))| one.own_inverse + own_errors(r) + carried(by)).collect(),
            about_mean: all()
                .map(|(r, (one, by))| {
                    let own = one.own_inverse * (1.0 - 2.0 / n) + alone;
                    own + errors_about_mean(r) + carried(&(by - &mean))
                })
                .collect(),
            of_mean: alone + all_errors + carried(&mean),
        }
    }
}
