//! What a run hands its states to.

use crate::equations::state::ChainState;

/// What takes in the states at a run's outputs.
pub(crate) trait Record {
    /// Whether it takes output number `k`.
    fn takes(&self, k: usize) -> bool;

    /// Takes in `state` as output number `k`, if it takes that.
    fn record(&mut self, k: usize, state: &ChainState);
}
