//! What distinguishes one experiment of a proof from the others.

use chainwave_experiment::{CameraEffect, OtherChain, Protocol, WrongChain};

/// What distinguishes one experiment of a proof from the others.
#[derive(Debug, Clone, Copy)]
pub(super) struct Variant {
    pub(super) seed: u64,
    pub(super) noise: f64,
    pub(super) striker_m_per_s: f64,
    /// Kind of what goes wrong.
    pub(super) fault: Option<&'static str>,
    /// What the camera adds to the ideal picture.
    pub(super) effect: Option<CameraEffect>,
    /// What the chain is beside what is stated.
    pub(super) chain: Option<WrongChain>,
    /// How it is filmed, where not as the experiment says.
    pub(super) protocol: Option<Protocol>,
    /// The chain, where not the experiment's own.
    pub(super) other_chain: Option<OtherChain>,
}

impl Variant {
    /// Whether everything is as the experiment states it.
    pub(super) fn is_plain(&self) -> bool {
        let Self { fault, effect, chain, protocol, other_chain, .. } = self;
        let is_own = chain.is_none() && other_chain.is_none();
        fault.is_none() && effect.is_none() && is_own && protocol.is_none()
    }

    pub(super) fn name(&self) -> String {
        let wrong = self.effect.map(|effect| effect.name).or(self.chain.map(|chain| chain.name));
        let other = self.protocol.map(|protocol| protocol.name).or(self.other_chain.map(|chain| chain.name));
        let kind = self.fault.or(wrong).or(other);
        let kind = kind.map_or_else(String::new, |kind| format!("-{kind}"));
        format!("seed-{}-noise-{}-striker-{}{kind}", self.seed, self.noise, self.striker_m_per_s)
    }
}
