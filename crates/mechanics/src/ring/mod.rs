//! draft
mod ellipse;
mod rod;
mod section;
mod statics;
mod three_moments;

pub use rod::{Response, Rod};
pub use section::{Ring, Section};
pub use statics::{Equilibrium, Support};
