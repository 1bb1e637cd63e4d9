//! From the motion of a chain to the numbers of its wave: strain, leading pulse, group velocity, half width, tail spectrum
//! and peak potential energy, each with its standard uncertainty.
//!
//! The crate is built on two ideas.
//!
//! *One way for every number.* Each quantity is a plain function of a strain map that returns point values, and knows
//! nothing of errors. [`measure`] calls these functions for the motion, and again for some hundred replicas of it that carry
//! one more draw of its stated errors ([`replicate`]); the scatter of the results is the uncertainty. Errors that many samples
//! share, bodies that two gaps share and functions that are not linear are then all in it, without a formula for each. A
//! model's motion goes the same way ([`exact_motion`]), so a difference between model and experiment is not one of method.
//!
//! *Local polynomials in time, equal phase in space.* A recording samples a pulse densely in time (some fifty samples) and
//! coarsely along the chain (some five gaps). So peaks and edges are found in time, gap by gap, with least-squares
//! polynomials whose window follows the pulse; and where a profile along the chain is needed, it is interpolated between the
//! gaps in a frame that moves with the pulse.
//!
//! Models are chosen by tests with a level ([`motion_across`], [`line_test`], [`GroupVelocity::variation_p_value`]); each stands beside its
//! [`Rule`], which says in words what is chosen by it and how often that is wrong.
//!
//! A value that cannot be measured is [`Missing`] with its reason; a motion that makes no sense is an [`AnalysisError`].
//!
//! ```
//! use chainwave_analysis::{MeasureSettings, measure};
//! use chainwave_measurement::{ChainMotion, ErrorModes, Estimate};
//! use ndarray::Array2;
//!
//! // Ten gaps of 30 mm that a pulse closes one after the other, 0.6 ms apart: 50 m/s.
//! let times_s: Vec<f64> = (0..300).map(|k| 4e-5 * f64::from(k)).collect();
//! let closed_m = |gap: usize, t_s: f64| 1.5e-3 / ((t_s - 3e-3 - 6e-4 * gap as f64) / 6e-4).cosh().powi(2);
//! let displacement_m = Array2::from_shape_fn((11, 300), |(body, k)| {
//!     Some(Estimate::new((body..10).map(|gap| closed_m(gap, times_s[k])).sum(), 0.0))
//! });
//! let exact = Array2::zeros(displacement_m.dim());
//! let n_trials = Array2::ones(displacement_m.dim());
//! let motion = ChainMotion { times_s, displacement_m, independent_sigma_m: exact, modes: ErrorModes::default(), n_trials };
//! let settings = MeasureSettings { end_reflects: false, ..MeasureSettings::new(0.030, 1) };
//! let c_g = measure(&motion, &settings, None)?.group_velocity.unwrap().velocity_m_per_s;
//! assert!((c_g.value - 50.0).abs() < 0.01, "{c_g:?}");
//! # Ok::<(), chainwave_analysis::AnalysisError>(())
//! ```

mod across;
mod at_rest;
mod camera_motion;
mod check;
mod columns;
mod departure;
mod dispersion;
mod energy;
mod error;
pub mod false_choices;
mod front;
mod half_width;
mod holes;
mod line_test;
mod local;
mod measure;
mod measured_rates;
mod particle;
pub mod probability;
mod pulses;
mod replicas;
mod rule;
mod spacing;
mod spectrum;
mod strain;
mod summit;
mod tail;
mod top;
mod velocity;

pub use across::{motion_across, motion_across_rule};
pub use at_rest::{at_rest_p_value, at_rest_rule};
pub use camera_motion::{CameraMotion, camera_motion, camera_motion_rule};
pub use departure::Departure;
pub use dispersion::{DispersionMap, dispersion_map};
pub use energy::{DampingShare, EnergyLaw, PeakEnergies, damping_share, pulses_and_energies};
pub use error::{AnalysisError, Missing};
pub use front::{Bend, FrontSettings, GapFront, LeadingPulse, OfGaps, leading_pulses};
pub use half_width::{HalfWidth, profile_times};
pub use line_test::{LineTest, line_rule, line_test};
pub use measure::{MeasureSettings, Measurement, measure, measure_peak_energies};
pub use pulses::{
    Collision, Direction, Pass, Pulse, PulseSettings, Pulses, Sense, follow_pulses, measure_pulses,
    power_exponent,
};
pub use replicas::{Replicas, replicate};
pub use rule::{FalseRate, Rule, SIGNIFICANCE_LEVEL};
pub use spacing::Spacing;
pub use spectrum::{
    DominantFrequency, GapSpectrum, LocalResonance, TailSpectrum, dominant_frequency, tail_spectrum,
};
pub use strain::{StrainMap, exact_motion, normalised_residuals, strain_map};
pub use summit::summit;
pub use velocity::{GroupVelocity, Reflection, one_speed_rule};
