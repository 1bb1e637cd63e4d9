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
//! gaps in a frame that moves with the pulse ([`MovingProfile`]).
//!
//! A value that cannot be measured is [`Missing`] with its reason; a motion that makes no sense is an [`AnalysisError`].

mod across;
mod check;
mod columns;
pub mod contact_fit;
mod dispersion;
mod energy;
mod error;
pub mod fit;
mod front;
mod half_width;
mod line_test;
mod local;
mod measure;
mod particle;
mod probability;
mod replicas;
mod spectrum;
mod strain;
mod tail;
mod velocity;

pub use across::motion_across;
pub use dispersion::{DispersionMap, dispersion_map, linear_dispersion_hz};
pub use energy::{DampingShare, EnergyLaw, PeakEnergies, damping_share, peak_energies};
pub use error::{AnalysisError, Missing};
pub use front::{FrontSettings, GapFront, LeadingPulse, leading_pulses};
pub use half_width::{HalfWidth, MovingProfile, half_width_times, half_widths};
pub use line_test::{LineTest, line_test};
pub use measure::{MeasureSettings, Measurement, measure};
pub use replicas::replicate;
pub use spectrum::{GapSpectrum, LocalResonance, TailSpectrum, dominant_frequency, tail_spectrum};
pub use strain::{StrainMap, exact_motion, strain_map};
pub use velocity::{GroupVelocity, Reflection, SpeedFit, fit_speed, undisturbed_gaps};
