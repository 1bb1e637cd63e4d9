use ndarray::Array2;

use crate::Estimate;

/// A motion known exactly (computed by a model or prescribed), sampled at common times.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Sample times in seconds, increasing.
    pub times_s: Vec<f64>,
    /// Displacement from rest, shape `[body, time]`, in metres.
    pub displacement_m: Array2<f64>,
    /// Velocity, shape `[body, time]`, in metres per second.
    pub velocity_m_per_s: Array2<f64>,
}

/// The measured motion of a chain: x_n(t) on one time base with its uncertainty.
///
/// The error of a sample is the sum of a part that is independent from sample to sample (standard deviation
/// [`ChainMotion::independent_sigma_m`]) and of the shared [`ErrorMode`]s, each with a random amplitude of unit variance.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainMotion {
    /// Sample times in seconds after the trigger, increasing and equally spaced.
    pub times_s: Vec<f64>,
    /// Displacement from rest in metres with its total standard uncertainty, shape `[body, time]`; `None` where no trial
    /// saw the body.
    pub displacement_m: Array2<Option<Estimate>>,
    /// Standard uncertainty of the independent part, in metres, shape `[body, time]`; zero where nothing was measured.
    pub independent_sigma_m: Array2<f64>,
    /// Errors that many samples share.
    pub modes: Vec<ErrorMode>,
    /// Number of trials behind each sample, shape `[body, time]`.
    pub n_trials: Array2<u32>,
}

impl ChainMotion {
    /// Number of bodies.
    pub fn n_bodies(&self) -> usize {
        self.displacement_m.nrows()
    }
}

/// One error that many samples share, such as the timing of a view: the displacement error for an amplitude of one
/// standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorMode {
    /// Where the error comes from.
    pub source: String,
    /// Displacement error in metres, shape `[body, time]`.
    pub displacement_m: Array2<f64>,
}
