//! What is assumed of an experiment whose peak energies are fitted, and what is found.

use std::num::NonZero;

use chainwave_analysis::Spacing;
use chainwave_measurement::Estimate;
use chainwave_mechanics::Chain;

use crate::damping::Damping;
use crate::quantity::{Prior, Quantity};

/// What is assumed of the experiment, and where the search begins.
#[derive(Debug, Clone, PartialEq)]
pub struct EnergyModel {
    /// The chain with its striker; the dampings and the striker's velocity are the starting values.
    pub chain: Chain,
    /// The striker's mean velocity as known beforehand, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Drive of each recording behind the motion, relative to the mean drive, less one.
    pub drive_deviations: Vec<f64>,
    /// Relative standard uncertainty of the scale of these deviations.
    pub drive_scale_sigma: f64,
    /// Quantities that are known only within an uncertainty; the others count as exact.
    pub priors: Vec<Prior>,
    /// How far apart neighbours rest.
    pub spacing: Spacing,
    /// Threads that carry the simulations; the result does not depend on their number.
    pub n_threads: NonZero<usize>,
}

/// Damping fitted to the peak potential energies, and what went along.
#[derive(Debug, Clone, PartialEq)]
pub struct EnergyFit {
    /// c_d and c_s.
    pub damping: Damping,
    /// The striker's mean velocity, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Factor on the drives' deviations, which the fit moves within its prior.
    pub drive_scale: f64,
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
    /// Sum of squared whitened residuals over their number less the parameters; near 1 (or below, where interpolated samples
    /// are smoother than their stated noise) when model and stated errors explain the measurement.
    pub reduced_chi_squared: f64,
    /// Probability of such a value or a larger one, did the energies scatter as stated alone.
    pub p_value: f64,
    /// Whitened residuals.
    pub n_residuals: usize,
    /// Chain simulations carried out.
    pub n_simulations: u64,
}
