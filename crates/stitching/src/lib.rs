//! Several recordings of a chain -> one motion x_n(t) on one time base, with its uncertainty.
//!
//! A camera on a stage sees a few bodies at a time, so the chain is put together from views, and each view from several
//! trials. The trials differ: the trigger fires a fraction of a frame early or late, and the striker's speed scatters by
//! a few per cent, which moves a body by pixels where the tracker resolves thousandths. Plain averaging would carry that
//! scatter into x_n(t), and steps between views into the strain. So recording r is described by
//!
//! > y_{n,r}(t) = X_n(t') + s_r S_n(t') + s_r^2 Q_n(t') + noise,  t' = t - tau_r
//!
//! with its trigger offset tau_r and the deviation s_r of its drive, and for each body the motion X_n and its response to
//! the drive, slope S_n and curvature Q_n. The bodies that neighbouring views share tie all recordings together; one
//! least-squares problem over the whole graph of views and trials gives every tau_r and s_r. The result is the mean motion
//! over the drives of all recordings, at their mean trigger (mean tau = mean s = 0).
//!
//! Two words of estimation theory, as they are used here:
//!
//! - *Nuisance parameters* are unknowns that nobody asks for, but without which the data cannot be described: here tau_r and s_r, and for
//!   the alignment the responses S_n and Q_n, which it eliminates (variable projection).
//! - A *gauge* is a choice among descriptions that fit the data equally well. If every trigger is taken to be later in proportion to its
//!   drive, and every body to be delayed by the drive as much, no reading changes. Like the zero of a potential, such a choice must be
//!   fixed by something else: the struck body starts at the impact and in proportion to the drive (see `gauge.rs`).
//!
//! Views that share no body have no such tie. Each group of recordings is then merged by itself, and the groups are joined by their
//! triggers: this is as good as the average of trials by their triggers, and its error is that of the group's own mean drive and
//! mean trigger, found from how far its trials scatter (see `trigger_scatter.rs`).
//!
//! - [`Observation`]: the tracked bodies of one recording, in metres;
//! - [`outliers`]: the recordings that contradict the others of their view, with the evidence;
//! - [`take_out_wild`]: single readings that are far from those before and after them;
//! - [`merge`]: observations -> [`Stitched`], which holds the [`ChainMotion`] and each recording's alignment;
//! - [`averaged`]: another coordinate of the same recordings (across the chain, rotation), by the alignment that was found;
//! - [`refine_stages`]: where the camera stood, from the bodies that views share. Displacements from rest do not depend on it.
//!
//! Pixels are unknown here, and so is what moves the chain.
//!
//! ```
//! use chainwave_measurement::{BodyTrack, Estimate, Observation};
//! use chainwave_stitching::{Settings, merge};
//!
//! // Three trials of one body, which starts at the trigger and is seen every 0.1 ms to a micrometre; one trial triggers 20 us early,
//! // so that its stamps are late by as much.
//! let trial = |trial: u32, lead_s: f64| {
//!     let frames = -20..60;
//!     let times_s: Vec<f64> = frames.clone().map(|frame| f64::from(frame) * 1e-4).collect();
//!     let noise = |frame: i32| 1e-6 * (f64::from(frame * (trial as i32 + 4) * 37 % 11) / 3.2);
//!     let moved_m = |time_s: &f64| 2.0 * (time_s - lead_s).max(0.0).powi(2) / 1e-3;
//!     let read = |(time_s, frame)| Some(Estimate::new(moved_m(time_s) + noise(frame), 1e-6));
//!     let position_m = times_s.iter().zip(frames).map(read).collect();
//!     let bodies = vec![BodyTrack { body: 1, position_m }];
//!     Observation { recording: format!("trial {trial}"), view: 1, trial, times_s, bodies }
//! };
//! let recordings = [trial(1, 0.0), trial(2, 20e-6), trial(3, 0.0)];
//!
//! let settings = Settings { drive_scatter: Some(0.02), ..Settings::new(1, 1e-4) };
//! let stitched = merge(&recordings, &settings)?;
//! let x = stitched.motion.displacement_m[(0, 50)].ok_or("body 1 was not seen")?;
//! println!("{:.3} ms: x_1 = {:.4} +- {:.4} mm", 1e3 * stitched.motion.times_s[50], 1e3 * x.value, 1e3 * x.sigma);
//! assert!(stitched.unsettled.is_none() && x.sigma > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Observation`]: chainwave_measurement::Observation
//! [`ChainMotion`]: chainwave_measurement::ChainMotion

mod arrivals;
mod assembly;
mod assumptions;
mod averaged;
mod body_response;
mod by_trigger;
mod by_view;
mod clocks;
mod consistency;
mod convergence;
mod detached;
mod drive_scatter;
mod error;
mod fitted;
mod fitted_body;
mod gauge;
mod groups;
mod likeness;
mod merge;
mod modes;
mod normal_equations;
mod onset;
mod outliers;
mod phases;
mod reading_error;
mod resample;
mod response_sizes;
mod rest;
mod settings;
mod shown;
mod spread;
mod stages;
mod state;
mod stated_response;
mod stitched;
mod time_base;
mod trigger_scatter;
mod untied;
mod wild;

pub use assumptions::Assumption;
pub use averaged::averaged;
pub use by_view::LeftByView;
pub use clocks::{ClockOf, ClockShown};
pub use error::StitchingError;
pub use merge::merge;
pub use outliers::{Evidence, Outlier, at_rest, outliers};
pub use resample::power_passed;
pub use response_sizes::ResponseSizes;
pub use settings::{FirstBody, Settings};
pub use shown::ShownByBody;
pub use spread::Spread;
pub use stages::{StageStep, refine_stages};
pub use stated_response::{HigherOrders, ModelResponse, StatedResponse};
pub use stitched::{Alignment, AlignmentPhase, Stitched, Unsettled};
pub use untied::{Mean, MeanOff, UntiedGroup};
pub use wild::{WildReading, take_out_wild};
