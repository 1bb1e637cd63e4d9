//! The forward model's door: checks a chain and its schedule, and integrates.

use super::{automatic, schedule::Schedule, simulation::Simulation};
use crate::equations::parameters::Chain;
use crate::error::MechanicsError;

/// Integrates the chain's motion from t = 0.
///
/// The striker's switches are located within a step and end it, so they cost no method its order.
///
/// # Errors
/// [`MechanicsError::NotPhysical`], [`MechanicsError::Length`] or [`MechanicsError::ImposedTooShort`] for input without
/// meaning; [`MechanicsError::StepTooLarge`] for a given step beyond the stability bound, at rest or at the stiffness
/// reached; [`MechanicsError::NotFor`], [`MechanicsError::OutOfReach`], [`MechanicsError::TooLarge`],
/// [`MechanicsError::NotFinite`] and [`MechanicsError::Chatter`] as they say.
pub fn simulate(chain: &Chain, schedule: &Schedule) -> Result<Simulation, MechanicsError> {
    chain.check()?;
    let n_outputs = schedule.check(chain, 1)?;
    Ok(automatic::run(chain, schedule, n_outputs, (1, false))?.simulation)
}
