//! What is assumed of the experiment behind the tracks.

use std::num::NonZero;

use chainwave_measurement::{Estimate, SharedReadingError};
use chainwave_mechanics::Chain;

use crate::quantity::Prior;

/// What is assumed of the experiment behind the tracks, and where the search begins.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackModel {
    /// The chain with its striker; the dampings are the starting values.
    pub chain: Chain,
    /// A striker's velocity as known beforehand, with its scatter from trial to trial, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Quantities that are known only within an uncertainty; the others count as exact.
    pub priors: Vec<Prior>,
    /// Errors that readings were found to have in common, beside the noise in their sigmas.
    pub reading_errors: Vec<SharedReadingError>,
    /// Errors in common that nothing showed and nothing excludes, such as those of a lens, as large as they usually are.
    pub usual_errors: Vec<SharedReadingError>,
    /// Threads that carry the simulations; the result does not depend on their number.
    pub n_threads: NonZero<usize>,
}
