//! What is assumed of a chain whose body 1 drives it as measured.

use std::num::NonZero;

use chainwave_mechanics::Chain;

use crate::quantity::Prior;

/// What is assumed of the chain behind body 1.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedModel {
    /// The chain; its damping is the starting value, and its drive stands back behind the measured motion of body 1.
    pub chain: Chain,
    /// Quantities that are known only within an uncertainty; the others count as exact.
    pub priors: Vec<Prior>,
    /// Drive of each recording behind the motion, relative to the mean drive, less one.
    pub drive_deviations: Vec<f64>,
    /// Threads that carry the simulations; the result does not depend on their number.
    pub n_threads: NonZero<usize>,
}
