//! What the readings of a free chain leave open, and how the impact decides it.
//!
//! Readings are unchanged when drives and offsets are exchanged for `s' = alpha s + gamma s^2` and `tau' = tau - beta s - delta
//! s^2`, because each body's response may take up the difference: a later trigger and a drive that delays every body look
//! alike. What holds is that the first body starts at the impact and in proportion to the drive, so that at its onset S = X
//! and Q = 0. The mean motion over all drives does not depend on alpha, gamma and delta to second order in s; on beta it does,
//! by beta times the mean square of s, a time. So alpha and beta are exchanged, while gamma and delta stay as the priors set
//! them, near a small Q (an exchange by noisy values would leave errors of third order). What delta is then off counts among the
//! errors of the offsets, and what alpha is among those of the drives, though not of the motion.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use crate::align::{Contribution, Response};

/// The first body's onset ends when it has moved this share of its way. A shorter one knows beta worse, and the other bodies' do not
/// begin in proportion to the drive.
const ONSET_SHARE: f64 = 0.1;
/// Standard deviation of what the response of a softening chain leaves of proportion within the onset, as an error of beta over
/// the onset's length: on the paper's chain beta is 9 us off, of 0.7 ms.
const DEPARTURE: f64 = 0.013;

/// The same as a relative error of alpha, and so of the drives' scale: on the paper's chain alpha is 0.913 at 2.73 m/s and 0.967 at
/// 0.83 m/s.
const DEPARTURE_OF_SCALE: f64 = 0.1;

/// What the variance of alpha adds to that of beta, relative to it: drives that noise makes too large leave both too small by the same
/// factor, so that beta's error is z / (1 - a z) for a normal z and alpha's standard deviation a, whose variance is 1 + 9 a^2 to second
/// order.
const OF_SCALE: f64 = 9.0;

/// The exchange of drives and offsets that makes the first body's onset proportional to the drive: there S = alpha X + beta
/// dX/dt.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gauge {
    /// alpha.
    scale: f64,
    /// beta.
    delay_s: f64,
    /// Variance of alpha.
    scale_variance: f64,
    /// Variance of beta.
    delay_variance_s2: f64,
}

impl Gauge {
    /// The gauge from the readings of the first body over time, by least squares of its slope against its motion and velocity, which
    /// have far less noise; `None` where the onset does not tell.
    pub(crate) fn from_onset(
        of_body: &[(Vec<Contribution>, Response)],
        drive: &[f64],
        errors: &ReadingErrors<'_>,
        interval_s: f64,
    ) -> Option<Self> {
        let motion_m = |(_, response): &(Vec<Contribution>, Response)| response.motion_m.abs();
        let furthest_m = of_body.iter().map(motion_m).fold(0.0, f64::max);
        let n_onset = of_body.iter().take_while(|one| motion_m(one) < ONSET_SHARE * furthest_m).count();
        let onset = &of_body[..n_onset];
        let columns = |response: &Response| Vector2::new(response.motion_m, response.velocity_m_per_s);
        let (mut normal, mut right_side) = (Matrix2::zeros(), Vector2::zeros());
        for (_, response) in onset {
            normal += columns(response) * columns(response).transpose();
            right_side += columns(response) * response.slope_m;
        }
        let inverse = normal.try_inverse()?;
        let factors = inverse * right_side;
        let (scale, delay_s) = (factors[0], factors[1]);
        let variance_of = |factor: usize| {
            let gains = onset.iter().map(|(_, response)| (inverse * columns(response))[factor]);
            errors.variance_of(onset, gains, drive)
        };
        let moving = onset.iter().filter(|one| motion_m(one) > 0.01 * furthest_m).count();
        let departure_s = DEPARTURE * moving as f64 * interval_s;
        let [of_scale, of_delay_s2] = [0, 1].map(variance_of);
        // Beyond this the onset holds too few samples to tell.
        (0.05..20.0).contains(&scale).then(|| Self {
            scale,
            delay_s,
            scale_variance: of_scale + DEPARTURE_OF_SCALE.powi(2),
            delay_variance_s2: of_delay_s2 * (1.0 + OF_SCALE * of_scale) + departure_s.powi(2),
        })
    }

    /// Whether what is left to exchange is a small part of its own error.
    pub(crate) fn is_settled(&self) -> bool {
        const SMALL: f64 = 0.02;
        self.delay_s.abs() < SMALL * self.delay_variance_s2.sqrt() && (self.scale - 1.0).abs() < 0.1 * SMALL
    }

    /// Exchanges drives and offsets; returns what becomes of their errors.
    pub(crate) fn fix(&self, drive: &mut [f64], offsets_s: &mut [f64]) -> DMatrix<f64> {
        let n = drive.len();
        for (s, offset_s) in drive.iter_mut().zip(offsets_s.iter_mut()) {
            *offset_s -= self.delay_s * *s;
            *s *= self.scale;
        }
        take_out_mean(drive);
        take_out_mean(offsets_s);
        DMatrix::from_fn(2 * n, 2 * n, |row, column| match (row < n, column < n) {
            (true, true) if row == column => self.scale,
            (false, false) if row == column => 1.0,
            (false, true) if row - n == column => -self.delay_s,
            _ => 0.0,
        })
    }

    /// What the exchanges did to errors of (s, tau) in all, of which `derivative` is the product, at the drives they led to.
    pub(crate) fn errors(
        &self,
        drive: &[f64],
        derivative: DMatrix<f64>,
        covariance: &DMatrix<f64>,
    ) -> Exchange {
        let n = drive.len();
        let transformed = &derivative * covariance * derivative.transpose();
        let closed =
            closed_directions(drive, &transformed).unwrap_or_else(|| DMatrix::identity(2 * n, 2 * n));
        let delayed = |row: usize| if row < n { 0.0 } else { self.delay_variance_s2.sqrt() * drive[row - n] };
        Exchange {
            errors: closed * derivative,
            delay_error: DVector::from_fn(2 * n, |row, _| delayed(row)),
            scale_sigma: self.scale_variance.sqrt(),
        }
    }
}

/// What is known of the errors of one body's readings.
pub(crate) struct ReadingErrors<'a> {
    /// Of the place at rest in each recording, in metres, over its whole length; zero where it did not see the body.
    pub(crate) rest_sigma_m: &'a [f64],
    /// Readings' scatter over what their sigma lets expect.
    pub(crate) scatter_ratio: f64,
}

impl ReadingErrors<'_> {
    /// Variance of a sum of slopes with the given gains. The noise of frames is independent, and is that of the frames where readings
    /// between them are summed up over many; a place at rest is one error for all times.
    fn variance_of(
        &self,
        onset: &[(Vec<Contribution>, Response)],
        gains: impl Iterator<Item = f64>,
        drive: &[f64],
    ) -> f64 {
        let mut noise = 0.0;
        let mut of_rest_m = vec![0.0; self.rest_sigma_m.len()];
        for ((contributions, response), gain) in onset.iter().zip(gains) {
            for one in contributions {
                let by_reading = gain * response.slope_gain(one, drive);
                noise += (by_reading * one.read.sigma * self.scatter_ratio).powi(2);
                of_rest_m[one.recording] += by_reading * self.rest_sigma_m[one.recording];
            }
        }
        noise + of_rest_m.iter().map(|error| error.powi(2)).sum::<f64>()
    }
}

/// What fixing the gauge does to errors of (s, tau).
pub(crate) struct Exchange {
    /// The linear map of errors before to errors after; the open directions, where only priors spoke, are taken out.
    pub(crate) errors: DMatrix<f64>,
    /// One standard deviation of beta, the open direction that moves the mean motion, as an error of (s, tau).
    pub(crate) delay_error: DVector<f64>,
    /// Standard deviation of alpha, a relative error of all drives that leaves the mean motion as it is.
    pub(crate) scale_sigma: f64,
}

impl Exchange {
    /// No exchange: the priors are all that tells the open directions, and their share of the covariance stays.
    pub(crate) fn none(n_recordings: usize) -> Self {
        let n = 2 * n_recordings;
        Self { errors: DMatrix::identity(n, n), delay_error: DVector::zeros(n), scale_sigma: 0.0 }
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
