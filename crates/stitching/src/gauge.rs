//! What the readings of a free chain leave open, and how the impact decides it.
//!
//! Readings are unchanged when drives and offsets are exchanged for `s' = alpha s + gamma s^2` and `tau' = tau - beta s - delta
//! s^2`, because each body's response may take up the difference: a later trigger and a drive that delays every body look
//! alike. What holds is that the first body starts at the impact and in proportion to the drive, so that at its onset S = X
//! and Q = 0. The mean motion over all drives does not depend on alpha, gamma and delta to second order in s; on beta it does,
//! by beta times the mean square of s, a time. So alpha and beta are exchanged, while gamma and delta stay as the priors set
//! them, near a small Q.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use crate::align::Response;

/// The first body's onset ends when it has moved this share of its way. The response of a softening chain leaves proportion
/// after it: at a tenth, beta is 8 us off on the paper's chain (and known to about 10 us), which shifts the mean motion by
/// 3 ns at a drive scatter of 2 %.
const ONSET_SHARE: f64 = 0.1;

/// The exchange of drives and offsets that makes the first body's onset proportional to the drive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gauge {
    /// alpha and beta, in seconds: S = alpha X + beta dX/dt at the onset.
    slope: Proportion,
    /// gamma and delta, in seconds: Q = gamma X + delta dX/dt at the onset.
    curvature: Proportion,
}

/// A response as a multiple of motion and velocity, with the variances of both factors.
#[derive(Debug, Clone, Copy)]
struct Proportion {
    factors: Vector2<f64>,
    variances: Vector2<f64>,
}

impl Gauge {
    /// The gauge from the first body's responses over time; `None` where its onset does not tell.
    pub(crate) fn from_onset<'a>(responses: impl Iterator<Item = &'a Response> + Clone) -> Option<Self> {
        let furthest_m = responses.clone().map(|response| response.motion_m.abs()).fold(0.0, f64::max);
        let onset = responses.take_while(|response| response.motion_m.abs() < ONSET_SHARE * furthest_m);
        let slope = Proportion::fit(onset.clone(), |response| response.slope_m)?;
        let curvature = Proportion::fit(onset, |response| response.curvature_m)?;
        // Far from 1 the onset holds too few samples to tell.
        (0.3..3.0).contains(&slope.factors[0]).then_some(Self { slope, curvature })
    }

    /// Exchanges drives and offsets, and gives their covariance with the open directions as well known as the onset tells.
    pub(crate) fn fix(
        &self,
        drive: &mut [f64],
        offsets_s: &mut [f64],
        covariance: DMatrix<f64>,
    ) -> DMatrix<f64> {
        let n = drive.len();
        let [alpha, beta_s] = self.slope.factors.into();
        let derivative = DMatrix::from_fn(2 * n, 2 * n, |row, column| match (row < n, column < n) {
            (true, true) if row == column => alpha,
            (false, false) if row == column => 1.0,
            (false, true) if row - n == column => -beta_s,
            _ => 0.0,
        });
        for (s, offset_s) in drive.iter_mut().zip(offsets_s.iter_mut()) {
            *offset_s -= beta_s * *s;
            *s *= alpha;
        }
        take_out_mean(drive);
        take_out_mean(offsets_s);
        let transformed = &derivative * covariance * derivative.transpose();
        self.condition(drive, transformed)
    }

    /// Replaces the covariance along the open directions, where only priors speak, by what the onset tells.
    fn condition(&self, drive: &[f64], covariance: DMatrix<f64>) -> DMatrix<f64> {
        let n = drive.len();
        let mut squares: Vec<f64> = drive.iter().map(|s| s * s).collect();
        take_out_mean(&mut squares);
        let shapes = [drive, &squares];
        let directions = DMatrix::from_fn(2 * n, 4, |row, k| {
            let (of_offsets, shape) = (k / 2 == 1, shapes[k % 2]);
            if (row >= n) == of_offsets { shape[row % n] } else { 0.0 }
        });
        let Some(inverse) = (directions.transpose() * &directions).try_inverse() else { return covariance };
        let readings = inverse * directions.transpose();
        let Some(open) = (&readings * &covariance * readings.transpose()).try_inverse() else {
            return covariance;
        };
        let along = &covariance * readings.transpose();
        // gamma and delta are told but not exchanged: an exchange by noisy values would leave errors of third order.
        let left = self.curvature.variances + self.curvature.factors.map(|factor| factor * factor);
        let told =
            DVector::from_vec(vec![self.slope.variances[0], left[0], self.slope.variances[1], left[1]]);
        let known = &directions * DMatrix::from_diagonal(&told) * directions.transpose();
        let conditional = covariance - &along * open * along.transpose() + known;
        // Rounding leaves it unsymmetric by parts in 1e12, which the eigenvectors would feel.
        (&conditional + conditional.transpose()) * 0.5
    }
}

impl Proportion {
    /// Least squares of a response against motion and velocity, which have far less noise than it.
    fn fit<'a>(
        onset: impl Iterator<Item = &'a Response> + Clone,
        value: impl Fn(&Response) -> f64,
    ) -> Option<Self> {
        let columns = |response: &Response| Vector2::new(response.motion_m, response.velocity_m_per_s);
        let (mut normal, mut right_side) = (Matrix2::zeros(), Vector2::zeros());
        for response in onset.clone() {
            normal += columns(response) * columns(response).transpose();
            right_side += columns(response) * value(response);
        }
        let inverse = normal.try_inverse()?;
        let factors = inverse * right_side;
        let residuals = onset.clone().map(|response| value(response) - factors.dot(&columns(response)));
        let freedom = onset.count().checked_sub(2).filter(|freedom| *freedom > 0)?;
        let variance = residuals.map(|residual| residual * residual).sum::<f64>() / freedom as f64;
        Some(Self { factors, variances: inverse.diagonal() * variance })
    }
}

fn take_out_mean(values: &mut [f64]) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|value| *value -= mean);
}
