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
//! Whether the tracks ask for more than the simplest model is told by [`softening`] and [`scatter_of_bodies`]; every test stands beside its
//! rule, which says how often it is wrong ([`false_choices`]).
//!
//! [`contact_fit`] fits the contact law itself, to a measured compression curve:
//!
//! ```
//! use chainwave_inference::contact_fit::{Zero, fit_contact};
//! use chainwave_mechanics::PowerLaw;
//!
//! let law = PowerLaw::new(60.1, 2.27e-3, 0.114)?;
//! let overlap_m: Vec<f64> = (0..101).map(|k| 1e-4 * f64::from(k)).collect();
//! let force_n: Vec<f64> = overlap_m.iter().map(|x_m| law.force_n(*x_m)).collect();
//! let fit = fit_contact(&overlap_m, &force_n, Zero::Stated)?;
//! assert!((fit.law.k_0_n_per_m() / law.k_0_n_per_m() - 1.0).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! All fits share one solver (`least_squares`): each hands over its normal equations at trial values, and gets back the minimum, its
//! covariance, or the names of what stays undetermined. Files import each other without circles; types that an algorithm and its parts
//! both need stand in a file of their own (`model`, `outcome`).

pub mod contact_fit;
mod damping;
mod displacements;
mod energies;
mod error;
mod excess;
pub mod false_choices;
mod imposed;
mod least_squares;
mod measured_rates;
mod priors;
mod quadrature;
mod quantity;
mod released;
mod steps;
mod tracks;
pub mod wrong_models;

pub use damping::{Damping, critical_kg_per_s, damping_rule, refusal};
pub use energies::{EnergyFit, EnergyModel, fit_peak_energies};
pub use error::FitError;
pub use imposed::{ImposedFit, ImposedModel, fit_imposed};
pub use quantity::{Prior, Quantity};
pub use released::{ReleasedFit, ReleasedModel, fit_release};
pub use tracks::{
    AlignedMotion, BetweenHypotheses, FittedRecording, Hypothesis, Interval, ODDS_OF_A_CAUSE,
    ODDS_OF_SCATTER, OverTrials, Reached, SIGMAS_OF_A_CAUSE, Structure, TrackFit, TrackModel,
    UNSTATED_MASS_SCATTER, UNSTATED_STIFFNESS_SCATTER, UsualAmplitudes, aligned_motion, fit_tracks,
    fitted_chain, fitted_motion, hypothesis_rule, reached, scatter_of_bodies, scatter_of_bodies_rule,
    softening, softening_rule, stated_damping, structure_rule,
};
