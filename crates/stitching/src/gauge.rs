//! What the readings of a free chain leave open, and how the impact decides it.
//!
//! Readings are unchanged when drives and offsets are exchanged for `s' = alpha s + gamma s^2` and `tau' = tau - beta s - delta
//! s^2`, because each body's response may take up the difference: a later trigger and a drive that delays every body look
//! alike. What holds is that the first body starts at the impact and in proportion to the drive, so that at its onset S = X
//! and Q = 0. The mean motion over all drives does not depend on alpha, gamma and delta to second order in s; on beta it does,
//! by beta times the mean square of s, a time. So alpha and beta are exchanged, while gamma and delta stay as the priors set
//! them, near a small Q (an exchange by noisy values would leave errors of third order).

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use crate::align::Response;

/// The first body's onset ends when it has moved this share of its way. The response of a softening chain leaves proportion
/// after it: at a tenth, beta is 8 us off on the paper's chain (and known to about 10 us), which shifts the mean motion by
/// 3 ns at a drive scatter of 2 %.
const ONSET_SHARE: f64 = 0.1;

/// The exchange of drives and offsets that makes the first body's onset proportional to the drive: there S = alpha X + beta
/// dX/dt.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gauge {
    /// alpha.
    scale: f64,
    /// beta.
    delay_s: f64,
    /// Variance of beta.
    delay_variance_s2: f64,
}

impl Gauge {
    /// The gauge from the first body's responses over time, by least squares of its slope against its motion and velocity, which
    /// have far less noise; `None` where the onset does not tell.
    pub(crate) fn from_onset<'a>(responses: impl Iterator<Item = &'a Response> + Clone) -> Option<Self> {
        let furthest_m = responses.clone().map(|response| response.motion_m.abs()).fold(0.0, f64::max);
        let onset = responses.take_while(|response| response.motion_m.abs() < ONSET_SHARE * furthest_m);
        let columns = |response: &Response| Vector2::new(response.motion_m, response.velocity_m_per_s);
        let (mut normal, mut right_side) = (Matrix2::zeros(), Vector2::zeros());
        for response in onset.clone() {
            normal += columns(response) * columns(response).transpose();
            right_side += columns(response) * response.slope_m;
        }
        let inverse = normal.try_inverse()?;
        let factors = inverse * right_side;
        let residual_m = |response: &Response| response.slope_m - factors.dot(&columns(response));
        let freedom = onset.clone().count().checked_sub(2).filter(|freedom| *freedom > 0)?;
        let variance = onset.map(|response| residual_m(response).powi(2)).sum::<f64>() / freedom as f64;
        let (scale, delay_s) = (factors[0], factors[1]);
        // Far from 1 the onset holds too few samples to tell.
        (0.3..3.0).contains(&scale).then_some(Self {
            scale,
            delay_s,
            delay_variance_s2: inverse[(1, 1)] * variance,
        })
    }

    /// Exchanges drives and offsets, and says what becomes of their errors.
    pub(crate) fn fix(
        &self,
        drive: &mut [f64],
        offsets_s: &mut [f64],
        covariance: &DMatrix<f64>,
    ) -> Exchange {
        let n = drive.len();
        let derivative = DMatrix::from_fn(2 * n, 2 * n, |row, column| match (row < n, column < n) {
            (true, true) if row == column => self.scale,
            (false, false) if row == column => 1.0,
            (false, true) if row - n == column => -self.delay_s,
            _ => 0.0,
        });
        for (s, offset_s) in drive.iter_mut().zip(offsets_s.iter_mut()) {
            *offset_s -= self.delay_s * *s;
            *s *= self.scale;
        }
        take_out_mean(drive);
        take_out_mean(offsets_s);
        let transformed = &derivative * covariance * derivative.transpose();
        let closed =
            closed_directions(drive, &transformed).unwrap_or_else(|| DMatrix::identity(2 * n, 2 * n));
        let delayed = |row: usize| if row < n { 0.0 } else { self.delay_variance_s2.sqrt() * drive[row - n] };
        Exchange { errors: closed * derivative, delay_error: DVector::from_fn(2 * n, |row, _| delayed(row)) }
    }
}

/// What fixing the gauge does to errors of (s, tau).
pub(crate) struct Exchange {
    /// The linear map of errors before to errors after; the open directions, where only priors spoke, are taken out.
    pub(crate) errors: DMatrix<f64>,
    /// One standard deviation of beta, the open direction that moves the mean motion, as an error of (s, tau).
    pub(crate) delay_error: DVector<f64>,
}

impl Exchange {
    /// No exchange.
    pub(crate) fn none(n_recordings: usize) -> Self {
        let n = 2 * n_recordings;
        Self { errors: DMatrix::identity(n, n), delay_error: DVector::zeros(n) }
    }
}

/// The projection of errors onto those that leave s and s^2 out of drives and offsets alike, along what the covariance ties to
/// them; `None` where the drives do not scatter.
pub(crate) fn closed_directions(drive: &[f64], covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = drive.len();
    let mut squares: Vec<f64> = drive.iter().map(|s| s * s).collect();
    take_out_mean(&mut squares);
    let shapes = [drive, &squares];
    let directions = DMatrix::from_fn(2 * n, 4, |row, k| {
        let (of_offsets, shape) = (k / 2 == 1, shapes[k % 2]);
        if (row >= n) == of_offsets { shape[row % n] } else { 0.0 }
    });
    let readings = (directions.transpose() * &directions).try_inverse()? * directions.transpose();
    let open = (&readings * covariance * readings.transpose()).try_inverse()?;
    Some(DMatrix::identity(2 * n, 2 * n) - covariance * readings.transpose() * open * readings)
}

fn take_out_mean(values: &mut [f64]) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|value| *value -= mean);
}
