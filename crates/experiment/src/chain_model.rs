//! The chain as an experiment states it.

use chainwave_mechanics::{Chain, Drive, FarEnd, PowerLaw, Striker};

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
    /// A contact law that makes no sense.
    pub fn chain_model(&self) -> Result<Chain, Error> {
        Ok(starting_chain(self, self.contact.power_law()?))
    }
}

/// The chain as the experiment states it, with usual damping to start a fit from.
pub(crate) fn starting_chain(experiment: &Experiment, contact: PowerLaw) -> Chain {
    Chain {
        mass_kg: vec![experiment.chain.mass_kg.get(); experiment.chain.n_bodies],
        damping_kg_per_s: vec![STARTING_DAMPING_KG_PER_S; experiment.chain.n_bodies],
        contact: contact.into(),
        drive: Drive::Striker(Striker {
            mass_kg: experiment.striker.mass_kg.get(),
            velocity_m_per_s: experiment.striker.velocity_m_per_s.get(),
            damping_kg_per_s: STARTING_STRIKER_DAMPING_KG_PER_S,
        }),
        far_end: FarEnd::Free,
    }
}
