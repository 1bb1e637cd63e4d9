//! How well sums of unknowns of all kinds are known: of the recordings' own, of amplitudes, and of those that all share.

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, U2};

use super::{Own, Reduced};

/// The covariance of all unknowns, in the parts that are independent: what each recording's residuals leave open of its own, what is left of the
/// amplitudes, and the shared unknowns, with the rates at which the former go with the latter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointCovariance {
    recordings: Vec<OfRecording>,
    ties: Vec<OfTie>,
    shared: DMatrix<f64>,
    /// Sums over all recordings.
    all: OfRecording,
    /// Of all recordings of each tie.
    all_by_errors: Vec<OMatrix<f64, U2, Dyn>>,
}

#[derive(Debug, Clone, PartialEq)]
struct OfRecording {
    own: Matrix2<f64>,
    /// The amplitudes going with these.
    by_shared: OMatrix<f64, U2, Dyn>,
    by_errors: Option<(usize, OMatrix<f64, U2, Dyn>)>,
}

#[derive(Debug, Clone, PartialEq)]
struct OfTie {
    covariance: DMatrix<f64>,
    by_shared: DMatrix<f64>,
}

/// The weights of a sum of unknowns.
pub(crate) struct Weights<'a> {
    /// Of every recording's own.
    pub(crate) of_all: Own,
    /// The same of some recordings, by their numbers, beside that.
    pub(crate) of_each: &'a [(usize, Own)],
    /// Of amplitudes, tie by tie.
    pub(crate) amplitudes: &'a [DVector<f64>],
    /// Of the shared unknowns.
    pub(crate) shared: DVector<f64>,
}

impl JointCovariance {
    /// Of unknowns the shared ones of which have the given covariance.
    pub(crate) fn of(reduced: &Reduced, shared: &DMatrix<f64>) -> Self {
        let n_shared = shared.nrows();
        let of_recording = |r: usize| OfRecording {
            own: reduced.recordings[r].own_inverse,
            by_shared: reduced.own_by_shared(r),
            by_errors: reduced.own_by_errors(r),
        };
        let recordings: Vec<OfRecording> = (0..reduced.recordings.len()).map(of_recording).collect();
        let ties: Vec<OfTie> = reduced
            .ties
            .iter()
            .map(|tie| OfTie { covariance: tie.covariance().clone(), by_shared: tie.by_shared() })
            .collect();
        let mut all = OfRecording {
            own: Matrix2::zeros(),
            by_shared: OMatrix::<f64, U2, Dyn>::zeros(n_shared),
            by_errors: None,
        };
        let mut all_by_errors: Vec<_> =
            ties.iter().map(|tie| OMatrix::<f64, U2, Dyn>::zeros(tie.covariance.nrows())).collect();
        for one in &recordings {
            all.own += one.own;
            all.by_shared += &one.by_shared;
            if let Some((tie, by_errors)) = &one.by_errors {
                all_by_errors[*tie] += by_errors;
            }
        }
        Self { recordings, ties, shared: shared.clone(), all, all_by_errors }
    }

    /// The variance of a sum of unknowns, in units of the residuals' variance.
    pub(crate) fn variance(&self, weights: &Weights<'_>) -> f64 {
        let Weights { of_all, of_each, amplitudes, shared } = weights;
        let square = |own: &Matrix2<f64>, weight: &Own| weight.dot(&(own * weight));
        let mut by_shared = shared + self.all.by_shared.tr_mul(of_all);
        let mut variance = square(&self.all.own, of_all);
        let of_ties = self.all_by_errors.iter().zip(*amplitudes);
        let mut by_errors: Vec<DVector<f64>> =
            of_ties.map(|(all, amplitudes)| amplitudes + all.tr_mul(of_all)).collect();
        for (r, weight) in *of_each {
            let one = &self.recordings[*r];
            variance += square(&one.own, &(of_all + weight)) - square(&one.own, of_all);
            by_shared += one.by_shared.tr_mul(weight);
            if let Some((tie, of_tie)) = &one.by_errors {
                by_errors[*tie] += of_tie.tr_mul(weight);
            }
        }
        for ((tie, by_errors), amplitudes) in self.ties.iter().zip(&by_errors).zip(*amplitudes) {
            variance += by_errors.dot(&(&tie.covariance * by_errors));
            by_shared += tie.by_shared.tr_mul(amplitudes);
        }
        variance + by_shared.dot(&(&self.shared * &by_shared))
    }
}
