//! What is assumed of the experiment behind the tracks.

use std::num::NonZero;

use chainwave_measurement::{Estimate, SharedReadingError};
use chainwave_mechanics::{Chain, Drive, Striker};

use crate::error::FitError;
use crate::quantity::Prior;

/// What is assumed of the experiment behind the tracks, and where the search begins.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackModel {
    /// The chain with its striker, or let go from its state ([`Drive::Free`]); the dampings are the starting values.
    pub chain: Chain,
    /// A striker's velocity as known beforehand, with its scatter from trial to trial, in metres per second; of a chain that is let go its state over the
    /// stated one, which is 1, with its scatter.
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

impl TrackModel {
    /// Whether the chain is let go from a state, and nothing strikes it: each recording's strength of the drive is then that state over the stated
    /// one, its impact is the release, and c_s is none.
    pub fn is_let_go(&self) -> bool {
        matches!(self.chain.drive, Drive::Free { .. })
    }

    /// What strikes the chain. Of a chain that is let go that is nobody: what changes it changes nothing.
    pub(super) fn striker(&self) -> Result<Striker, FitError> {
        match &self.chain.drive {
            Drive::Striker(striker) => Ok(*striker),
            Drive::Free { .. } => Ok(Striker {
                mass_kg: 1.0,
                velocity_m_per_s: 0.0,
                damping_kg_per_s: 0.0,
                ground_damping_kg_per_s: 0.0,
            }),
            Drive::Imposed(_) => Err(FitError::NoStriker),
        }
    }
}
