//! Damping of the chain (c_d) and of the striker's contact (c_s), fitted to a measured motion.
//!
//! The chain model is solved for trial values and compared with the measurement. Two comparisons are offered:
//!
//! - the tracks of all recordings ([`fit_tracks`]), each with a striker and an impact of its own: all that was measured, at
//!   the place where its errors are independent and stated;
//! - the peak potential energies ([`fit_peak_energies`]), as in the paper: a few numbers of the merged motion, which feel less
//!   of what the model leaves out. The merged motion is a mean over trials whose drives scatter by about 2 %, and the chain
//!   is not linear. So the model's is a mean too, of two runs at the nodes of the Gauss quadrature for the drives' own
//!   distribution: exact to third order in their deviations. The scale of the deviations is fitted along with a prior.
//!
//! Either way the striker's velocity is fitted along with its prior, because it is known only so well. Without a striker, body 1 as it
//! was measured drives the chain ([`fit_imposed`]), which tells c_d from the displacement field behind it, and nothing of c_s.
//!
//! Whether the tracks ask for more than the simplest model is told by [`softening`] and [`scatter_of_bodies`].

mod arrow;
mod bootstrap;
mod departure;
mod family;
mod imposed;
mod prediction;
mod problem;
mod profile;
mod quantity;
mod response;
mod search;
mod track_problem;
mod tracks;
mod whitening;

use std::num::NonZero;

use chainwave_measurement::Estimate;
use chainwave_mechanics::{Chain, MechanicsError, Schedule};
use ndarray::Array2;

use crate::probability::normal_beyond;
use crate::strain::strain_of_checked;
use crate::{FrontSettings, PeakEnergies, StrainMap, exact_motion, leading_pulses, peak_energies};
use prediction::{Prediction, Times};
use problem::{Comparison, minimise};
use whitening::cholesky_whitening;

pub use bootstrap::OverTrials;
pub use departure::{Departure, scatter_of_bodies, softening};
pub use imposed::{ImposedFit, ImposedModel, fit_imposed};
pub use profile::Interval;
pub use quantity::{Known, Quantity};
pub use tracks::{FittedRecording, TrackFit, TrackModel, fit_tracks, fitted_motion};

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
    pub known: Vec<Known>,
    /// Distance between neighbouring bodies, in metres.
    pub pitch_m: f64,
    /// Threads that carry the simulations; the result does not depend on their number.
    pub n_threads: NonZero<usize>,
}

/// Fitted damping with standard uncertainties.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    /// c_d, dashpot of each body to ground, in kilograms per second.
    pub chain_damping_kg_per_s: Estimate,
    /// c_s, damping of the striker's contact, in kilograms per second.
    pub striker_damping_kg_per_s: Estimate,
    /// Correlation of the errors of c_d and c_s.
    pub correlation: f64,
}

impl Damping {
    /// Probabilities that c_d and c_s, were they zero, would be found so large or larger (one-sided, as neither can be negative).
    pub fn told_from_zero(&self) -> [f64; 2] {
        [self.chain_damping_kg_per_s, self.striker_damping_kg_per_s]
            .map(|found| normal_beyond(found.value / found.sigma))
    }
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
    /// Whitened residuals.
    pub n_residuals: usize,
    /// Chain simulations carried out.
    pub n_simulations: u64,
}

/// Why damping could not be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The chain model has no striker.
    #[error(
        "damping fit: expected a chain driven by a striker, found another drive (c_s acts in the striker's contact alone)"
    )]
    NoStriker,
    /// Not enough was measured.
    #[error("damping fit: expected at least {expected} measured {what}, found {found}")]
    TooFew {
        /// What is counted.
        what: &'static str,
        /// The least number.
        expected: usize,
        /// The number measured.
        found: usize,
    },
    /// A stated error is zero, or the errors contradict each other.
    #[error("damping fit: expected positive uncertainties of the {what}, found a singular covariance")]
    SingularCovariance {
        /// What is compared.
        what: &'static str,
    },
    /// The search did not end at a minimum.
    #[error("damping fit: no minimum found: {0}")]
    NotConverged(String),
    /// The chain model refused the trial values.
    #[error("damping fit: {0}")]
    Model(#[from] MechanicsError),
}

/// How the peak energies were measured, so that the model's are measured alike.
#[derive(Debug, Clone, Copy)]
pub struct EnergyMeasurement<'a> {
    /// Time base of the motion behind the energies, in seconds: a peak counts while it was filmed.
    pub times_s: &'a [f64],
    /// How the leading pulse was found.
    pub front: &'a FrontSettings,
    /// Replicas behind the covariance. Its inverse, as an estimate, is too large by (n - 1)/(n - k - 2) for k energies
    /// (Hartlap, Simon and Schneider 2007), which is taken out.
    pub n_replicas: usize,
}

/// Fits c_d and c_s to the peak potential energies of the gaps, with their covariance (paper, Fig. 4).
///
/// # Errors
/// [`FitError`] as its variants say.
pub fn fit_peak_energies(
    energies: &PeakEnergies,
    measurement: &EnergyMeasurement<'_>,
    model: &EnergyModel,
) -> Result<EnergyFit, FitError> {
    const LEAST_GAPS: usize = 5;
    let found = energies.gaps.len();
    if found < LEAST_GAPS {
        return Err(FitError::TooFew { what: "peak energies", expected: LEAST_GAPS, found });
    }
    if measurement.n_replicas < found + 3 {
        let found_replicas = measurement.n_replicas;
        return Err(FitError::TooFew {
            what: "energies' replicas",
            expected: found + 3,
            found: found_replicas,
        });
    }
    let correction = (measurement.n_replicas - 1) as f64 / (measurement.n_replicas - found - 2) as f64;
    let covariance_j2 = &energies.covariance_j2 * correction;
    let whiten = cholesky_whitening(&covariance_j2, "peak energies")?;
    let interval_s = interval_s(measurement.times_s);
    let duration_s = measurement.times_s.last().copied().unwrap_or(0.0) + 2.0 * interval_s;
    let comparison = Comparison {
        measured: whiten(energies.energy_j.iter().map(|energy| energy.value).collect()),
        predict: Box::new(|prediction: &Prediction| {
            whiten(predicted_energies(prediction, &energies.gaps, measurement, model))
        }),
        times: Times {
            measured_s: measurement.times_s,
            schedule: Schedule::automatic(duration_s, interval_s),
        },
    };
    minimise(model, &comparison)
}

/// Peak energies of the mean motion over the drives, found in it as in the measured motion: by the law that the experiment states,
/// whatever law the trial values give the chain.
fn predicted_energies(
    prediction: &Prediction,
    gaps: &[usize],
    measurement: &EnergyMeasurement<'_>,
    model: &EnergyModel,
) -> Vec<f64> {
    let moved = exact_motion(&prediction.motion);
    let map = strain_of_checked(&moved, model.pitch_m);
    let pulses = leading_pulses(&map, measurement.front);
    let contact = model.chain.contact.first();
    let energy_of = |overlap_m: f64| contact.force_and_energy(overlap_m).1;
    let energies_j = peak_energies(&map, &pulses, &energy_of, measurement.front.peak_fraction);
    let found = |gap: &usize| energies_j.get(gap - 1).and_then(|energy| energy.ok());
    let beyond = |gap: &usize| prediction.peak_overlaps_m.get(gap - 1).map_or(0.0, |x_m| energy_of(*x_m));
    gaps.iter().map(|gap| found(gap).unwrap_or_else(|| beyond(gap))).collect()
}

/// Residuals of a measured strain map against a model's on the same times, in units of the measured sigma, shape `[gap, time]`;
/// `None` where nothing was measured.
pub fn normalised_residuals(measured: &StrainMap, model: &StrainMap) -> Array2<Option<f64>> {
    Array2::from_shape_fn(measured.strain.dim(), |at| {
        let (measured, model) = (measured.strain[at]?, model.strain[at]?);
        (measured.sigma > 0.0).then(|| (measured.value - model.value) / measured.sigma)
    })
}

fn interval_s(times_s: &[f64]) -> f64 {
    match times_s {
        [first, .., last] => (last - first) / (times_s.len() - 1) as f64,
        _ => 0.0,
    }
}
