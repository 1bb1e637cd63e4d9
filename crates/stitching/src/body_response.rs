//! One body at one time as a function of the drive: motion, slope and curvature by weighted least squares with priors.

use nalgebra::{Matrix3, RowVector3, Vector3};

use crate::resample::Interpolated;

/// What one recording contributes at one body and time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contribution {
    /// Row of the recording in the alignment.
    pub(crate) recording: usize,
    pub(crate) read: Interpolated,
    /// How many times of the common base share a frame's noise, 1 where frames are no longer than the base's interval.
    pub(crate) n_shared: f64,
}

impl Contribution {
    /// What it tells over the inverse of its variance: sums over all times count the noise of a frame once, however many of them share it.
    pub(crate) fn weight(&self) -> f64 {
        self.read.sigma.powi(-2) / self.n_shared
    }
}

/// How far a body's response to the drive may stray from plain scaling, as standard deviations in metres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ResponsePrior {
    /// Of S - X.
    pub(crate) slope_m: f64,
    /// Of the curvature.
    pub(crate) curvature: CurvaturePrior,
}

/// What is known of the curvature Q, as a standard deviation in metres.
#[derive(Debug, Clone, Copy)]
pub(crate) enum CurvaturePrior {
    /// Of Q, at drives of any scale.
    Small(f64),
    /// Of Q - (S - X), at drives of their true scale. Where a motion is a power series of the drive `a`, a phi_1 + a^2 phi_2 + ...,
    /// the second term alone makes Q = S - X: what is left of their difference begins with the third.
    WeakNonLinearity(f64),
}

impl CurvaturePrior {
    /// The sum of X, S and Q that is near zero, over its standard deviation.
    fn row(self) -> Vector3<f64> {
        match self {
            Self::Small(sigma_m) => Vector3::new(0.0, 0.0, 1.0) / sigma_m,
            Self::WeakNonLinearity(sigma_m) => Vector3::new(1.0, -1.0, 1.0) / sigma_m,
        }
    }
}

/// One body at one time as a function of the drive's deviation s: `X + s S + s^2 Q`, from the recordings that saw it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BodyResponse {
    /// Mean of the fitted motion over the drives of all recordings, metres.
    pub(crate) motion_m: f64,
    /// X_n(t): the fitted motion at s = 0, metres.
    origin_m: f64,
    /// S_n(t), metres.
    pub(crate) slope_m: f64,
    /// Q_n(t), metres.
    pub(crate) curvature_m: f64,
    /// Velocity at s = 0, metres per second.
    pub(crate) velocity_m_per_s: f64,
    /// Its derivative by s.
    velocity_slope_m_per_s: f64,
    /// Covariance of (X, S, Q) in square metres.
    covariance: Matrix3<f64>,
    /// That of their values at one time, by the readings' noise alone, without the priors'.
    noise: Matrix3<f64>,
    /// Covariance of the mean motion with (X, S, Q), in square metres.
    mean_covariance: RowVector3<f64>,
    /// What one standard deviation of the priors of slope and curvature makes of the mean motion, in metres.
    prior_errors_m: [f64; 2],
}

impl BodyResponse {
    /// Weighted least squares with the priors S = X and that of the curvature: where the trials' drives are too alike to tell the
    /// response, the motion scales with the drive, within the prior's uncertainty. `None` where readings and priors leave a direction
    /// undetermined: there is no motion then, and no sigma that could stand beside it.
    ///
    /// The curvature's prior is about `usual_curvature_m`.
    pub(crate) fn fit(
        contributions: &[Contribution],
        drive: &[f64],
        prior: ResponsePrior,
        usual_curvature_m: f64,
    ) -> Option<Self> {
        let scaled = Vector3::new(-1.0, 1.0, 0.0) / prior.slope_m;
        let curved = prior.curvature.row();
        let known = scaled * scaled.transpose() + curved * curved.transpose();
        let (mut told, mut noise) = (Matrix3::zeros(), Matrix3::zeros());
        let mut right_side = Vector3::zeros();
        let mut right_side_rate = Vector3::zeros();
        for contribution in contributions {
            let basis = basis(drive[contribution.recording]);
            told += basis * basis.transpose() * contribution.weight();
            noise += basis * basis.transpose() * (contribution.weight() / contribution.n_shared);
            let straight_m = contribution.read.value - usual_curvature_m * basis[2];
            right_side += basis * (contribution.weight() * straight_m);
            right_side_rate += basis * (contribution.weight() * contribution.read.rate);
        }
        let covariance = inverse_of(known + told)?;
        let fitted = covariance * right_side + Vector3::new(0.0, 0.0, usual_curvature_m);
        let rates = covariance * right_side_rate;
        let mean_basis = drive.iter().map(|s| basis(*s)).sum::<Vector3<f64>>() / drive.len() as f64;
        let mean_covariance = mean_basis.transpose() * covariance;
        Some(Self {
            motion_m: mean_basis.dot(&fitted),
            origin_m: fitted[0],
            slope_m: fitted[1],
            curvature_m: fitted[2],
            velocity_m_per_s: rates[0],
            velocity_slope_m_per_s: rates[1],
            covariance,
            noise: covariance * noise * covariance,
            mean_covariance,
            prior_errors_m: [scaled, curved].map(|known| (mean_covariance * known)[0]),
        })
    }

    /// Velocity at s = 0 and its derivative by s, in metres per second.
    pub(crate) fn velocity(&self) -> [f64; 2] {
        [self.velocity_m_per_s, self.velocity_slope_m_per_s]
    }

    /// Takes another velocity.
    pub(crate) fn set_velocity(&mut self, velocity: [f64; 2]) {
        [self.velocity_m_per_s, self.velocity_slope_m_per_s] = velocity;
    }

    /// The fitted displacement at a drive deviation.
    pub(crate) fn at(&self, drive: f64) -> f64 {
        self.origin_m + drive * (self.slope_m + drive * self.curvature_m)
    }

    /// What one standard deviation of the priors of slope and curvature makes of the mean motion, in metres.
    pub(crate) fn prior_errors_m(&self) -> [f64; 2] {
        self.prior_errors_m
    }

    /// Derivative of the mean motion by the reading of one recording.
    pub(crate) fn gain(&self, contribution: &Contribution, drive: &[f64]) -> f64 {
        let basis = basis(drive[contribution.recording]);
        contribution.weight() * (self.mean_covariance * basis)[0]
    }

    /// Derivative of the slope by the reading of one recording.
    pub(crate) fn slope_gain(&self, contribution: &Contribution, drive: &[f64]) -> f64 {
        contribution.weight() * (self.covariance * basis(drive[contribution.recording]))[1]
    }

    /// Part of a recording's own reading in its fitted value.
    pub(crate) fn leverage(&self, contribution: &Contribution, drive: &[f64]) -> f64 {
        let weight = contribution.weight();
        self.beside(contribution, drive).taken_weight(contribution, drive) / weight
    }

    /// A reading among the others at its time.
    pub(crate) fn beside(&self, one: &Contribution, drive: &[f64]) -> ReadingBeside {
        let s = drive[one.recording];
        ReadingBeside {
            recording: one.recording,
            weight: one.weight(),
            of_fit: basis(s).transpose() * self.covariance,
            slope_noise: by_drive(s).transpose() * self.noise,
        }
    }

    /// Derivatives of a recording's residual by its drive deviation and its trigger offset.
    pub(crate) fn residual_slopes(&self, drive: f64) -> [f64; 2] {
        let velocity_m_per_s = self.velocity_m_per_s + drive * self.velocity_slope_m_per_s;
        [-(self.slope_m + 2.0 * drive * self.curvature_m), velocity_m_per_s]
    }
}

/// One reading of a body at a time among the others there.
pub(crate) struct ReadingBeside {
    recording: usize,
    weight: f64,
    /// Covariance of its fitted value with (X, S, Q), in square metres.
    of_fit: RowVector3<f64>,
    /// Covariance of its residual's derivative by its drive with (X, S, Q), as the readings' noise makes it, in square metres.
    slope_noise: RowVector3<f64>,
}

impl ReadingBeside {
    /// What fitting the response takes from the weight matrix of the readings, for it and another one.
    fn taken_weight(&self, other: &Contribution, drive: &[f64]) -> f64 {
        self.weight * other.weight() * (self.of_fit * basis(drive[other.recording]))[0]
    }

    /// Weight matrix of the readings once the response is fitted, for it and another one.
    pub(crate) fn free_weight(&self, other: &Contribution, drive: &[f64]) -> f64 {
        let same = if self.recording == other.recording { self.weight } else { 0.0 };
        same - self.taken_weight(other, drive)
    }

    /// What the readings' noise makes of the product of its residual's derivative and another one's by their drive deviations, in square metres.
    pub(crate) fn slope_noise(&self, other_drive: f64) -> f64 {
        (self.slope_noise * by_drive(other_drive))[0]
    }
}

fn basis(drive: f64) -> Vector3<f64> {
    Vector3::new(1.0, drive, drive * drive)
}

/// Derivative of that by the drive.
fn by_drive(drive: f64) -> Vector3<f64> {
    Vector3::new(0.0, 1.0, 2.0 * drive)
}

/// A pivot below this share of its own diagonal is rounding's: what it stands for is not determined.
const LEAST_PIVOT: f64 = 1e-13;

/// The inverse of a symmetric matrix that is positive definite to within rounding; `None` of any other.
fn inverse_of(normal: Matrix3<f64>) -> Option<Matrix3<f64>> {
    let scale = normal.diagonal().map(|entry| entry.sqrt().recip());
    let is_sound = scale.iter().all(|factor| factor.is_finite() && *factor > 0.0);
    let correlation = |i: usize, j: usize| normal[(i, j)] * scale[i] * scale[j];
    let [a, b, c] = [correlation(0, 1), correlation(0, 2), correlation(1, 2)];
    let second = 1.0 - a * a;
    let third = 1.0 - b * b - (c - a * b).powi(2) / second;
    if is_sound && second > LEAST_PIVOT && third > LEAST_PIVOT { normal.try_inverse() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contribution(recording: usize, value: f64, sigma: f64) -> Contribution {
        let read = Interpolated { value, rate: 0.0, sigma, noise_gain: 1.0, interval_s: 1.0 };
        Contribution { recording, read, n_shared: 1.0 }
    }

    const WEAK: ResponsePrior =
        ResponsePrior { slope_m: 1.0, curvature: CurvaturePrior::WeakNonLinearity(0.5) };

    #[test]
    fn one_trial_and_the_priors_tell_a_motion() {
        let response = BodyResponse::fit(&[contribution(0, 2e-3, 1e-6)], &[0.0], WEAK, 0.0).unwrap();
        assert!(
            (response.motion_m - 2e-3).abs() < 1e-12
                && (response.covariance[(0, 0)].sqrt() / 1e-6 - 1.0).abs() < 1e-6
        );
        // The slope is told by its prior alone.
        assert!((response.covariance[(1, 1)].sqrt() - 1.0).abs() < 1e-3, "{}", response.covariance);
    }

    #[test]
    fn what_nothing_determines_is_no_motion_with_a_sigma_of_zero() {
        // At a drive of nothing, s = -1, the priors S = X and Q = S - X say what the reading says: X - S + Q = X.
        let singular = BodyResponse::fit(&[contribution(0, 0.0, 1e-6)], &[-1.0], WEAK, 0.0);
        assert!(singular.is_none(), "{singular:?}");
        assert!(BodyResponse::fit(&[], &[0.0], WEAK, 0.0).is_none());
        assert!(BodyResponse::fit(&[contribution(0, 1.0, 0.0)], &[0.0], WEAK, 0.0).is_none());
        let no_scale = ResponsePrior { slope_m: 0.0, ..WEAK };
        assert!(BodyResponse::fit(&[contribution(0, 1.0, 1e-6)], &[0.0], no_scale, 0.0).is_none());
    }
}
