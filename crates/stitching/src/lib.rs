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
//! - [`Observation`]: the tracked bodies of one recording, in metres;
//! - [`outliers`]: the recordings that contradict the others of their view, with the evidence;
//! - [`merge`]: observations -> [`Stitched`], which holds the [`ChainMotion`] and each recording's alignment;
//! - [`refine_stages`]: where the camera stood, from the bodies that views share. Displacements from rest do not depend on it.
//!
//! Pixels are unknown here, and so is what moves the chain.
//!
//! [`Observation`]: chainwave_measurement::Observation
//! [`ChainMotion`]: chainwave_measurement::ChainMotion

mod align;
mod consistency;
mod drive_scatter;
mod error;
mod gauge;
mod merge;
mod modes;
mod outliers;
mod resample;
mod responses;
mod rest;
mod spread;
mod stages;
mod ties;
mod time_base;

pub use error::StitchingError;
pub use merge::{Alignment, Settings, Stitched, merge};
pub use outliers::{Evidence, Outlier, outliers};
pub use spread::Spread;
pub use stages::{StageStep, refine_stages};
