//! The chain as an experiment states it.

use chainwave_mechanics::{Chain, Drive, Striker};

use crate::configuration::Experiment;
use crate::error::Error;

/// Where the fit of c_d begins: light damping, 0.04 % of critical for one HEC. The end does not depend on it.
const STARTING_DAMPING_KG_PER_S: f64 = 1e-3;
/// Where the fit of c_s begins.
const STARTING_STRIKER_DAMPING_KG_PER_S: f64 = 0.1;

impl Experiment {
    /// The chain with usual damping, as a fit starts from it.
    ///
    /// # Errors
    /// A contact law that makes no sense, and a far striker behind a wall.
    pub fn chain_model(&self) -> Result<Chain, Error> {
        let striker = Striker {
            mass_kg: self.striker.mass_kg.get(),
            velocity_m_per_s: self.striker.velocity_m_per_s.get(),
            damping_kg_per_s: STARTING_STRIKER_DAMPING_KG_PER_S,
        };
        self.chain_struck_by(striker, STARTING_DAMPING_KG_PER_S)
    }

    /// The chain as it is stated, struck by a striker, with a mean damping of its bodies.
    ///
    /// # Errors
    /// As for [`Experiment::chain_model`].
    pub fn chain_struck_by(&self, striker: Striker, damping_kg_per_s: f64) -> Result<Chain, Error> {
        Ok(Chain {
            mass_kg: self.chain.masses_kg()?,
            damping_kg_per_s: self.chain.dampings_kg_per_s(damping_kg_per_s)?,
            contact: self.contact.contacts(self.chain.n_bodies)?,
            drive: Drive::Striker(striker),
            far_end: self.far_end()?,
        })
    }
}
