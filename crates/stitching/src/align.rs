use nalgebra::{DMatrix, DVector, Matrix3, RowVector3, Vector3};

use crate::resample::Interpolated;

/// What one recording contributes at one body and time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contribution {
    /// Row of the recording in the alignment.
    pub(crate) recording: usize,
    pub(crate) read: Interpolated,
}

impl Contribution {
    pub(crate) fn weight(&self) -> f64 {
        self.read.sigma.powi(-2)
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
pub(crate) struct Response {
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
    /// Covariance of the mean motion with (X, S, Q), in square metres.
    mean_covariance: RowVector3<f64>,
    /// What one standard deviation of the priors of slope and curvature makes of the mean motion, in metres.
    prior_errors_m: [f64; 2],
}

impl Response {
    /// Weighted least squares with the priors S = X and that of the curvature: where the trials' drives are too alike to tell the
    /// response, the motion scales with the drive, within the prior's uncertainty.
    pub(crate) fn fit(contributions: &[Contribution], drive: &[f64], prior: ResponsePrior) -> Self {
        let scaled = Vector3::new(-1.0, 1.0, 0.0) / prior.slope_m;
        let curved = prior.curvature.row();
        let mut normal = scaled * scaled.transpose() + curved * curved.transpose();
        let mut right_side = Vector3::zeros();
        let mut right_side_rate = Vector3::zeros();
        for contribution in contributions {
            let basis = basis(drive[contribution.recording]);
            normal += basis * basis.transpose() * contribution.weight();
            right_side += basis * (contribution.weight() * contribution.read.value);
            right_side_rate += basis * (contribution.weight() * contribution.read.rate);
        }
        let covariance = normal.try_inverse().unwrap_or_default();
        let fitted = covariance * right_side;
        let rates = covariance * right_side_rate;
        let mean_basis = drive.iter().map(|s| basis(*s)).sum::<Vector3<f64>>() / drive.len() as f64;
        let mean_covariance = mean_basis.transpose() * covariance;
        Self {
            motion_m: mean_basis.dot(&fitted),
            origin_m: fitted[0],
            slope_m: fitted[1],
            curvature_m: fitted[2],
            velocity_m_per_s: rates[0],
            velocity_slope_m_per_s: rates[1],
            covariance,
            mean_covariance,
            prior_errors_m: [scaled, curved].map(|known| (mean_covariance * known)[0]),
        }
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
        self.shared_weight(contribution, contribution, drive) / contribution.weight()
    }

    /// What fitting the response takes from the weight matrix of the readings, for a pair of them.
    fn shared_weight(&self, one: &Contribution, other: &Contribution, drive: &[f64]) -> f64 {
        let (left, right) = (basis(drive[one.recording]), basis(drive[other.recording]));
        one.weight() * other.weight() * (left.transpose() * self.covariance * right)[0]
    }

    /// Weight matrix of the readings once the response is fitted, for a pair of them.
    fn free_weight(&self, one: &Contribution, other: &Contribution, drive: &[f64]) -> f64 {
        let same = if one.recording == other.recording { one.weight() } else { 0.0 };
        same - self.shared_weight(one, other, drive)
    }

    /// Derivatives of a recording's residual by its drive deviation and its trigger offset.
    pub(crate) fn residual_slopes(&self, drive: f64) -> [f64; 2] {
        let velocity_m_per_s = self.velocity_m_per_s + drive * self.velocity_slope_m_per_s;
        [-(self.slope_m + 2.0 * drive * self.curvature_m), velocity_m_per_s]
    }
}

fn basis(drive: f64) -> Vector3<f64> {
    Vector3::new(1.0, drive, drive * drive)
}

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
pub(crate) struct NormalEquations {
    n_recordings: usize,
    matrix: DMatrix<f64>,
    right_side: DVector<f64>,
}

impl NormalEquations {
    pub(crate) fn new(n_recordings: usize) -> Self {
        let n = 2 * n_recordings;
        Self { n_recordings, matrix: DMatrix::zeros(n, n), right_side: DVector::zeros(n) }
    }

    /// Adds the readings of one body at one time, fitted by `response` at the present drives and offsets.
    pub(crate) fn add(&mut self, contributions: &[Contribution], response: &Response, drive: &[f64]) {
        for one in contributions {
            let s = drive[one.recording];
            let residual_m = one.read.value - response.at(s);
            let one_slopes = response.residual_slopes(s);
            for other in contributions {
                let other_slopes = response.residual_slopes(drive[other.recording]);
                let free = response.free_weight(one, other, drive);
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
    pub(crate) fn solve(
        mut self,
        drive: &[f64],
        offsets_s: &[f64],
        prior: Prior,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let n = self.n_recordings;
        for r in 0..n {
            self.matrix[(r, r)] += prior.drive.powi(-2);
            self.right_side[r] -= drive[r] * prior.drive.powi(-2);
            self.matrix[(n + r, n + r)] += prior.offset_s.powi(-2);
            self.right_side[n + r] -= offsets_s[r] * prior.offset_s.powi(-2);
        }
        // Offsets are microseconds and drives per cent: unit diagonal before factoring.
        let scale = self.matrix.diagonal().map(|entry| entry.sqrt().recip());
        let scaling = DMatrix::from_diagonal(&scale);
        let inverse = (&scaling * self.matrix * &scaling).cholesky()?.inverse();
        let covariance = &scaling * inverse * &scaling;
        let solution = &covariance * self.right_side;
        let centring = centring(n);
        Some((&centring * solution, &centring * covariance * &centring))
    }
}

/// What a constant error of one body's readings does to the right side of the normal equations: column r is the derivative by
/// the error of recording r.
pub(crate) fn offset_sensitivity(of_body: &[(Vec<Contribution>, Response)], drive: &[f64]) -> DMatrix<f64> {
    let n = drive.len();
    let mut sensitivity = DMatrix::zeros(2 * n, n);
    for (contributions, response) in of_body {
        for one in contributions {
            let slopes = response.residual_slopes(drive[one.recording]);
            for other in contributions {
                let free = response.free_weight(one, other, drive);
                for (kind, slope) in slopes.iter().enumerate() {
                    sensitivity[(kind * n + one.recording, other.recording)] -= slope * free;
                }
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
