//! What a run hands its states to.

use crate::equations::state::ChainState;

/// What takes in the states at a run's outputs.
pub(crate) trait Record {
    /// Takes in `state` as output number `k`.
    fn record(&mut self, k: usize, state: &ChainState);
}
