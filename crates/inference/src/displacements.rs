//! Displacements of a motion's bodies against a chain model's: what the fit behind body 1 and the one to a release have in common.

use std::ops::Range;

use chainwave_measurement::ChainMotion;
use nalgebra::{DMatrix, DVector};

use crate::error::FitError;
use crate::excess::{degrees_of_freedom, reduced_chi_squared};
use crate::least_squares::NormalEquations;

/// The displacements that are compared.
pub(crate) struct Displacements<'a> {
    pub(crate) motion: &'a ChainMotion,
    /// Row and time of each.
    pub(crate) samples: Vec<(usize, usize)>,
}

impl<'a> Displacements<'a> {
    /// Least number of samples that a fit makes sense with.
    pub(crate) const LEAST: usize = 100;

    /// Those of some rows over some samples of time that were seen; refuses a model of another number of bodies, and too few.
    pub(crate) fn new(
        motion: &'a ChainMotion,
        n_bodies_of_model: usize,
        (rows, times): (Range<usize>, Range<usize>),
    ) -> Result<Self, FitError> {
        if n_bodies_of_model != motion.n_bodies() {
            let (expected, found) = (motion.n_bodies(), n_bodies_of_model);
            return Err(FitError::TooFew { what: "bodies in the model", expected, found });
        }
        let is_told = |at: &(usize, usize)| {
            motion.displacement_m[*at].is_some() && motion.independent_sigma_m[*at] > 0.0
        };
        let all = rows.flat_map(|row| times.clone().map(move |k| (row, k)));
        let samples: Vec<(usize, usize)> = all.filter(is_told).collect();
        match samples.len() {
            found if found < Self::LEAST => {
                Err(FitError::TooFew { what: "positions", expected: Self::LEAST, found })
            }
            _ => Ok(Self { motion, samples }),
        }
    }

    /// The equations of a prediction and its derivatives by the unknowns, in units of the samples' independent noise; priors are to be added.
    pub(crate) fn equations(&self, predicted: &DVector<f64>, columns: &[DVector<f64>]) -> NormalEquations {
        let mut equations = NormalEquations::new(columns.len());
        let mut row = vec![0.0; columns.len() + 1];
        for (i, sample) in self.samples.iter().enumerate() {
            let inverse_sigma = self.motion.independent_sigma_m[*sample].recip();
            let measured_m = self.motion.displacement_m[*sample].map_or(0.0, |x| x.value);
            row.iter_mut().zip(columns).for_each(|(entry, column)| *entry = inverse_sigma * column[i]);
            row[columns.len()] = inverse_sigma * (predicted[i] - measured_m);
            equations.add_row(&row);
        }
        equations
    }

    /// Sum of squared residuals, relative to the samples' total sigma, over their degrees of freedom; unknowns with a prior count with it.
    pub(crate) fn reduced_chi_squared(&self, predicted: &DVector<f64>, n_without_prior: usize) -> f64 {
        let residual = |(i, sample): (usize, &(usize, usize))| {
            let x = self.motion.displacement_m[*sample]?;
            Some(((x.value - predicted[i]) / x.sigma).powi(2))
        };
        let squares: f64 = self.samples.iter().enumerate().filter_map(residual).sum();
        reduced_chi_squared(squares, degrees_of_freedom(self.samples.len(), n_without_prior))
    }
}

/// How errors of the samples compared move the unknowns.
pub(crate) struct Shifts<'a> {
    of: &'a Displacements<'a>,
    covariance: &'a DMatrix<f64>,
    /// Derivatives by the unknowns over the samples' variances.
    weighted: DMatrix<f64>,
}

impl<'a> Shifts<'a> {
    pub(crate) fn new(
        of: &'a Displacements<'a>,
        covariance: &'a DMatrix<f64>,
        derivatives: &[DVector<f64>],
    ) -> Self {
        let mut weighted = DMatrix::from_columns(derivatives);
        for (mut row, sample) in weighted.row_iter_mut().zip(&of.samples) {
            row *= of.motion.independent_sigma_m[*sample].powi(-2);
        }
        Self { of, covariance, weighted }
    }

    /// What one standard deviation of one of the motion's error patterns makes of the samples, in metres.
    pub(crate) fn pattern_m(&self, pattern: usize) -> DVector<f64> {
        let pattern = &self.of.motion.modes.patterns()[pattern];
        DVector::from_fn(self.of.samples.len(), |i, _| pattern.at(self.of.samples[i]))
    }

    /// C J' W e.
    pub(crate) fn by(&self, error_m: &DVector<f64>) -> DVector<f64> {
        self.covariance * self.weighted.tr_mul(error_m)
    }

    /// The covariance with what the motion's modes do to the unknowns, from what each of its patterns does: all that the estimator does with an
    /// error is linear.
    pub(crate) fn with_modes(&self, of_patterns: &[Vec<f64>]) -> DMatrix<f64> {
        let mut total = self.covariance.clone();
        for shift in self.of.motion.modes.combined(of_patterns).map(DVector::from_vec) {
            total += &shift * shift.transpose();
        }
        total
    }
}
