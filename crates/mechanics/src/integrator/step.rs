//! What an integrator does with a step.

use pulp::Simd;

use crate::equations::{model::ChainModel, state::ChainState};

/// A rung of the ladder: it knows rates, forces and steps, and nothing of outputs, switches or energies.
///
/// A step has two halves. `begin` prepares the state that it starts from; `advance` then goes on by any length from there,
/// so that a step can be tried with several lengths.
pub(crate) trait Integrator {
    /// Prepares steps from a state; `continued` says that it is where the last step ended, unchanged.
    fn begin<S: Simd>(&mut self, simd: S, model: &ChainModel<'_>, from: &ChainState, continued: bool);

    /// The state `step.h_s` after `from`, which was given to `begin`, into `to`.
    fn advance<S: Simd>(
        &mut self,
        simd: S,
        model: &ChainModel<'_>,
        from: &ChainState,
        step: TimeStep,
        to: &mut ChainState,
    );

    /// Estimated error of the last step, where the method has one.
    fn local_error(&self) -> Option<LocalError>;

    /// Evaluations of the forces of all gaps so far.
    fn evaluations(&self) -> u64;
}

/// Start and length of a step in seconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimeStep {
    pub(crate) time_s: f64,
    pub(crate) h_s: f64,
}

/// Largest errors of any mass that a step has added, as the method estimates them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalError {
    pub(crate) x_m: f64,
    pub(crate) v_m_per_s: f64,
}
