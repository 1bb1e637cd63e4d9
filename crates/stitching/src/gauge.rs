//! What the readings of a free chain leave open, and how the impact decides it.
//!
//! Readings are unchanged when drives and offsets are exchanged for `s' = alpha s + gamma s^2` and `tau' = tau - beta s - delta
//! s^2`, because each body's response may take up the difference: an earlier trigger and a drive that delays every body
//! look alike. What holds is that the first body starts at the impact and in proportion to the drive, so that at its onset S = X
//! and Q = 0. The mean motion over all drives does not depend on alpha, gamma and delta to second order in s; on beta it does,
//! by beta times the mean square of s, a time. So alpha and beta are exchanged, while gamma and delta follow the prior of the
//! curvatures, Q = S - X, which holds at the alpha and beta found (an exchange by noisy values would leave errors of third order).
//! What delta is then off counts among the errors of the offsets, and what alpha is among those of the drives, though not of the
//! motion.

use std::ops::Range;

use chainwave_measurement::Estimate;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use crate::body_response::BodyResponse;
use crate::drive_scatter::scale_of;
use crate::fitted_body::{FittedBody, FittedTime};
use crate::settings::FirstBody;
use crate::stated_response::{ONSET_SHARE, OnsetDeparture, StatedResponse};

/// What the first body's onset reads of (alpha, beta): there S = alpha (a X + b dX/dt) + beta dX/dt, with a and b by the stated chain, or 1 and 0.
#[derive(Debug, Clone)]
pub(crate) struct Onset {
    /// alpha, and beta in seconds.
    factors: Vector2<f64>,
    /// Their covariance.
    covariance: Matrix2<f64>,
    /// Their derivatives by the drives and offsets of all recordings.
    derivatives: DMatrix<f64>,
    /// Whether noise is no small part of what tells them.
    is_noisy: bool,
}

impl Onset {
    /// From the readings of the first body over time, by least squares of its slope against its motion and velocity, which have
    /// far less noise. A prescribed motion is in proportion to the drive from its beginning to its end.
    pub(crate) fn read(
        (of_body, first_body): (&FittedBody, FirstBody),
        model: Option<&StatedResponse>,
        drive: &[f64],
        errors: &ReadingErrors<'_>,
        interval_s: f64,
    ) -> OnsetTells<Self> {
        let furthest_m = furthest_m(of_body);
        let whole: Vec<FittedTime<'_>> = of_body.times().take(length(of_body, first_body)).collect();
        let moves = |at: &FittedTime<'_>| motion_m(at) > MOVING_SHARE * furthest_m;
        let ToldOnset { onset, read, inverse } = match told_beside(whole, moves, errors.noise.as_ref()) {
            OnsetTells::Of(told) => told,
            OnsetTells::Nothing => return OnsetTells::Nothing,
            OnsetTells::NothingButNoise => return OnsetTells::NothingButNoise,
        };
        let gains: Vec<Vector2<f64>> =
            onset.iter().map(|at| inverse * scaled_and_delayed(at.response)).collect();
        let departure = match first_body {
            FirstBody::Free => {
                let last_m = onset.last().map_or(0.0, |at| motion_m(at));
                let moving = onset.iter().filter(|at| moves(at)).count();
                let unknown = || OnsetDeparture::unknown(moving as f64 * interval_s);
                model.and_then(|model| model.departure(last_m)).unwrap_or_else(unknown)
            }
            FirstBody::Imposed => OnsetDeparture::none(),
        };
        // At the true drives S = a X + b dX/dt, where a and b are the departure; at drives s' and offsets tau', of which the true ones are
        // alpha s' and tau' - beta s', it is alpha a X + (alpha b + beta) dX/dt.
        let [a, b_s] = departure.factors.into();
        let exchange = Matrix2::new(1.0 / a, 0.0, -b_s / a, 1.0);
        let factors = exchange * read;
        let covariance = errors.covariance_of(&onset, &gains, drive) + departure.covariance;
        let covariance = exchange * covariance * exchange.transpose();
        let mut derivatives = DMatrix::zeros(2, 2 * drive.len());
        for (FittedTime { contributions, response }, gain) in onset.iter().zip(&gains) {
            for one in *contributions {
                let by_reading = exchange * gain * response.slope_gain(one, drive);
                let residual_slopes = response.residual_slopes(drive[one.recording]);
                for (unknown, by_unknown) in
                    [one.recording, drive.len() + one.recording].into_iter().zip(residual_slopes)
                {
                    let mut column = derivatives.column_mut(unknown);
                    column += by_reading * by_unknown;
                }
            }
        }
        OnsetTells::Of(Self { factors, covariance, derivatives, is_noisy: errors.noise.is_some() })
    }

    /// alpha.
    pub(crate) fn scale(&self) -> Estimate {
        Estimate::new(self.factors[0], self.covariance[(0, 0)].sqrt())
    }
}

/// What an onset tells of the exchange.
#[derive(Debug, Clone)]
pub(crate) enum OnsetTells<T> {
    /// There is none, or it tells no scale at all: nothing moves, or drives are all alike.
    Nothing,
    /// Motion and velocity are told apart by noise alone: where an onset grows exponentially, as that of a front that runs by itself, they are in proportion,
    /// and a trigger's offset is as good as a drive.
    NothingButNoise,
    /// This.
    Of(T),
}

impl<T> OnsetTells<T> {
    /// What it tells, if it does.
    pub(crate) fn ok(self) -> Option<T> {
        match self {
            Self::Of(told) => Some(told),
            Self::Nothing | Self::NothingButNoise => None,
        }
    }
}

/// A body moves from this share of its way on.
const MOVING_SHARE: f64 = 0.01;
/// Share of noise in any direction of the normal matrix up to which it counts as none: it draws the direction's value towards zero by as much, a tenth at most,
/// which is what a scale may be off anyway ([`crate::stated_response::DEPARTURE_OF_SCALE`]). Strikers leave some thousandths, and some hundredths in a first round.
const NO_SHARE: f64 = 0.1;
/// Share of noise from which on a direction is not told.
const MOST_NOISE: f64 = 0.5;
/// Times at rest that tell the noise of motion and velocity at least.
const LEAST_AT_REST: usize = 4;

/// What an onset tells of scale and delay.
struct ToldOnset<'a> {
    /// The times that tell it.
    onset: Vec<FittedTime<'a>>,
    /// Scale, and delay in seconds.
    read: Vector2<f64>,
    /// Inverse of the normal matrix without its noise.
    inverse: Matrix2<f64>,
}

/// Least squares beside noise of motion and velocity, whose mean products at one time are given where they are no small part of the matrix. Then moving times
/// alone count, without what their noise is expected to add (W. A. Fuller, Measurement Error Models, Wiley 1987, ch. 1).
fn told_beside<'a>(
    whole: Vec<FittedTime<'a>>,
    moves: impl Fn(&FittedTime<'a>) -> bool,
    noise: Option<&Matrix2<f64>>,
) -> OnsetTells<ToldOnset<'a>> {
    let told = |onset: Vec<FittedTime<'a>>, added: Matrix2<f64>| {
        let (normal, right_side) = normal_equations(onset.iter().copied());
        let inverse = (normal - added).try_inverse();
        let of_inverse = |inverse| OnsetTells::Of(ToldOnset { onset, read: inverse * right_side, inverse });
        inverse.map_or(OnsetTells::Nothing, of_inverse)
    };
    let Some(noise) = noise else { return told(whole, Matrix2::zeros()) };
    let moving: Vec<FittedTime<'_>> = whole.into_iter().filter(moves).collect();
    let added = noise * moving.len() as f64;
    match noise_share(&normal_equations(moving.iter().copied()).0, &added) {
        Some(share) if share <= MOST_NOISE => told(moving, added),
        _ => OnsetTells::NothingButNoise,
    }
}

/// Share of noise in the direction that holds most of it; `None` of a matrix that is not positive definite.
fn noise_share(normal: &Matrix2<f64>, noise: &Matrix2<f64>) -> Option<f64> {
    let factor = normal.cholesky()?.l();
    let left = factor.solve_lower_triangular(noise)?;
    let shares = factor.solve_lower_triangular(&left.transpose())?;
    Some((0.5 * (shares + shares.transpose())).symmetric_eigenvalues().max())
}

/// Mean products of a body's motion and velocity at one time as noise alone makes them, by the first times, at which it rests; `None` where that is a small part of
/// what tells its onset, or where too few times tell it. Times that do not move hold nothing else, and their squares would make any matrix look regular.
pub(crate) fn noise_that_counts(
    of_body: &FittedBody,
    first_body: FirstBody,
    n_at_rest: usize,
) -> Option<Matrix2<f64>> {
    let resting = of_body.times().take(n_at_rest).filter(|at| !at.contributions.is_empty());
    let n = resting.clone().count();
    let noise = normal_equations(resting).0 / n as f64;
    let n_onset = length(of_body, first_body);
    let onset = normal_equations(of_body.times().take(n_onset)).0;
    let counts = noise_share(&onset, &(noise * n_onset as f64)).is_some_and(|share| share >= NO_SHARE);
    (n >= LEAST_AT_REST && counts).then_some(noise)
}

/// Number of times until the onset is over.
fn length(of_body: &FittedBody, first_body: FirstBody) -> usize {
    let end_m = ONSET_SHARE * furthest_m(of_body);
    match first_body {
        FirstBody::Free => of_body.times().take_while(|at| motion_m(at) < end_m).count(),
        FirstBody::Imposed => of_body.responses.len(),
    }
}

fn furthest_m(of_body: &FittedBody) -> f64 {
    of_body.times().map(|at| motion_m(&at)).fold(0.0, f64::max)
}

fn motion_m(at: &FittedTime<'_>) -> f64 {
    at.response.motion_m.abs()
}

/// A body's slope in terms of its motion X and its velocity, S = alpha X + beta dX/dt, by least squares over the given times; with the
/// inverse of the normal matrix.
pub(crate) fn scale_and_delay<'a>(
    of_body: impl Iterator<Item = FittedTime<'a>>,
) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let (normal, right_side) = normal_equations(of_body);
    let inverse = normal.try_inverse()?;
    Some((inverse * right_side, inverse))
}

/// Normal matrix and right side of these least squares.
fn normal_equations<'a>(of_body: impl Iterator<Item = FittedTime<'a>>) -> (Matrix2<f64>, Vector2<f64>) {
    let (mut normal, mut right_side) = (Matrix2::zeros(), Vector2::zeros());
    for FittedTime { response, .. } in of_body {
        let columns = scaled_and_delayed(response);
        normal += columns * columns.transpose();
        right_side += columns * response.slope_m;
    }
    (normal, right_side)
}

fn scaled_and_delayed(response: &BodyResponse) -> Vector2<f64> {
    Vector2::new(response.motion_m, response.velocity_m_per_s)
}

/// Scales that drives may be put right by.
const SCALES: Range<f64> = 0.05..20.0;
/// Standard uncertainty below which a scale outside of those is told, and not noise: offsets are then so far off along the drives that the onset reads the
/// drives wrongly, and a delay that it reads leads nearer to them.
const FAR_SIGMA: f64 = 0.5;

/// The exchange of drives and offsets that makes the first body's onset proportional to the drive.
#[derive(Debug, Clone)]
pub(crate) struct Gauge {
    /// alpha.
    scale: f64,
    /// Whether that was read; else drives stay as they are for now.
    is_read: bool,
    /// beta.
    delay_s: f64,
    /// Variance of alpha.
    scale_variance: f64,
    /// Variance of beta.
    delay_variance_s2: f64,
    /// Derivatives of alpha and beta by the drives and offsets that they were found from.
    derivatives: DMatrix<f64>,
}

impl Gauge {
    /// What the onset reads, and what the stated scatter of the drives says with it (see [`scale_of`]). Nothing where that is no scale at all: too few samples, or
    /// drives all alike.
    pub(crate) fn told_by(onset: Onset, drive: &[f64], scatter: Option<f64>) -> OnsetTells<Self> {
        let untold = if onset.is_noisy { OnsetTells::NothingButNoise } else { OnsetTells::Nothing };
        let gauge = match scatter {
            Some(scatter) => Self::from_onset_and_scatter(onset, drive, scatter),
            None => Self::from_onset(onset),
        };
        gauge.map_or(untold, OnsetTells::Of)
    }

    fn from_onset(onset: Onset) -> Option<Self> {
        let Estimate { value: scale, sigma } = onset.scale();
        let is_read = SCALES.contains(&scale);
        (is_read || sigma < FAR_SIGMA).then(|| Self {
            scale: if is_read { scale } else { 1.0 },
            is_read,
            delay_s: onset.factors[1],
            scale_variance: onset.covariance[(0, 0)],
            delay_variance_s2: onset.covariance[(1, 1)],
            derivatives: onset.derivatives,
        })
    }

    fn from_onset_and_scatter(onset: Onset, drive: &[f64], scatter: f64) -> Option<Self> {
        let scale = scale_of(drive, scatter, onset.scale())?;
        let Onset { factors, covariance, mut derivatives, .. } = onset;
        // Of two quantities with a normal error, one as a function of the other.
        let slope_s = covariance[(0, 1)] / covariance[(0, 0)];
        let rest_s2 = covariance[(1, 1)] - slope_s * covariance[(0, 1)];
        let weight_of_onset = (scale.sigma.powi(2) / covariance[(0, 0)]).min(1.0);
        let squares: f64 = drive.iter().map(|s| s * s).sum();
        for unknown in 0..derivatives.ncols() {
            let by_scatter = drive.get(unknown).map_or(0.0, |s| -scale.value * s / squares);
            let change = (1.0 - weight_of_onset) * (by_scatter - derivatives[(0, unknown)]);
            derivatives[(0, unknown)] += change;
            derivatives[(1, unknown)] += slope_s * change;
        }
        Some(Self {
            scale: scale.value,
            is_read: true,
            delay_s: factors[1] + slope_s * (scale.value - factors[0]),
            scale_variance: scale.sigma.powi(2),
            delay_variance_s2: rest_s2 + (slope_s * scale.sigma).powi(2),
            derivatives,
        })
    }

    /// Whether what is left to exchange is a small part of its own error.
    pub(crate) fn is_settled(&self) -> bool {
        const SMALL: f64 = 0.02;
        let is_small = self.delay_s.abs() < SMALL * self.delay_variance_s2.sqrt();
        self.is_read && is_small && (self.scale - 1.0).abs() < 0.1 * SMALL
    }

    /// Exchanges drives and offsets.
    pub(crate) fn fix(&self, drive: &mut [f64], offsets_s: &mut [f64]) {
        for (s, offset_s) in drive.iter_mut().zip(offsets_s.iter_mut()) {
            *offset_s -= self.delay_s * *s;
            *s *= self.scale;
        }
        take_out_mean(drive);
        take_out_mean(offsets_s);
    }

    /// What the exchange does to errors of (s, tau), at the drives it led to.
    pub(crate) fn errors(&self, drive: &[f64], covariance: &DMatrix<f64>) -> Exchange {
        let n = drive.len();
        let closed =
            closed_directions(drive, covariance, 1).unwrap_or_else(|| DMatrix::identity(2 * n, 2 * n));
        let delayed = |row: usize| if row < n { 0.0 } else { self.delay_variance_s2.sqrt() * drive[row - n] };
        // Errors of the first body's recordings move alpha and beta, and so all the others.
        let by_drive = DVector::from_fn(2 * n, |row, _| if row < n { drive[row] } else { 0.0 });
        let by_delay = DVector::from_fn(2 * n, |row, _| if row < n { 0.0 } else { -drive[row - n] });
        let moved = DMatrix::identity(2 * n, 2 * n)
            + by_drive * self.derivatives.row(0)
            + by_delay * self.derivatives.row(1);
        Exchange {
            errors: moved * closed,
            delay_error: DVector::from_fn(2 * n, |row, _| delayed(row)),
            scale_sigma: Some(self.scale_variance.sqrt()),
        }
    }
}

/// What is known of the errors of one body's readings.
pub(crate) struct ReadingErrors<'a> {
    /// Of the place at rest in each recording, in metres, over its whole length; zero where it did not see the body.
    pub(crate) rest_sigma_m: &'a [f64],
    /// Readings' scatter over what their sigma lets expect.
    pub(crate) scatter_ratio: f64,
    /// Mean products of the body's motion and velocity by noise alone, at one time, where that counts.
    pub(crate) noise: Option<Matrix2<f64>>,
}

impl ReadingErrors<'_> {
    /// Covariance of two sums of slopes with the given gains. The noise of frames is independent, and is that of the frames where
    /// readings between them are summed up over many, of those that share a frame together; a place at rest is one error for all times.
    fn covariance_of(&self, onset: &[FittedTime<'_>], gains: &[Vector2<f64>], drive: &[f64]) -> Matrix2<f64> {
        let mut noise = Matrix2::zeros();
        let mut of_rest = vec![Vector2::zeros(); self.rest_sigma_m.len()];
        for (FittedTime { contributions, response }, gain) in onset.iter().zip(gains) {
            for one in *contributions {
                let by_reading = gain * response.slope_gain(one, drive);
                let sigma_m = one.read.sigma * self.scatter_ratio;
                noise += by_reading * by_reading.transpose() * (sigma_m.powi(2) * one.n_shared);
                of_rest[one.recording] += by_reading * self.rest_sigma_m[one.recording];
            }
        }
        noise + of_rest.iter().map(|error| error * error.transpose()).sum::<Matrix2<f64>>()
    }
}

/// What fixing the gauge does to errors of (s, tau).
pub(crate) struct Exchange {
    /// The linear map of errors before to errors after; the open directions, where only priors spoke, are taken out.
    pub(crate) errors: DMatrix<f64>,
    /// One standard deviation of beta, the open direction that moves the mean motion, as an error of (s, tau).
    pub(crate) delay_error: DVector<f64>,
    /// Standard deviation of alpha, a relative error of all drives that leaves the mean motion as it is; `None` where nothing tells it.
    pub(crate) scale_sigma: Option<f64>,
}

impl Exchange {
    /// No exchange: the priors are all that tells the open directions, and their share of the covariance stays.
    pub(crate) fn none(n_recordings: usize) -> Self {
        let n = 2 * n_recordings;
        Self { errors: DMatrix::identity(n, n), delay_error: DVector::zeros(n), scale_sigma: None }
    }

    /// No exchange where there should be one: a delay by the drive is known as well as triggers were before, whatever the priors of responses make of it.
    pub(crate) fn untold(drive: &[f64], trigger_prior_s: f64) -> Self {
        let n = drive.len();
        let length = drive.iter().map(|s| s * s).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let delayed = |row: usize| if row < n { 0.0 } else { trigger_prior_s * drive[row - n] / length };
        Self { delay_error: DVector::from_fn(2 * n, |row, _| delayed(row)), ..Self::none(n) }
    }
}

/// The projection of errors onto those that leave the powers of s up to the given one out of drives and offsets alike, along what the
/// covariance ties to them; `None` where the drives do not scatter.
pub(crate) fn closed_directions(
    drive: &[f64],
    covariance: &DMatrix<f64>,
    powers: usize,
) -> Option<DMatrix<f64>> {
    let n = drive.len();
    let shapes: Vec<Vec<f64>> = (1..=powers as i32)
        .map(|power| {
            let mut shape: Vec<f64> = drive.iter().map(|s| s.powi(power)).collect();
            take_out_mean(&mut shape);
            shape
        })
        .collect();
    let directions = DMatrix::from_fn(2 * n, 2 * powers, |row, k| {
        let (of_offsets, shape) = (k / powers == 1, &shapes[k % powers]);
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
