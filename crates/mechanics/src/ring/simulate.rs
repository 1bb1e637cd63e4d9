//! The ring model's door: integrates a chain of rings up to a contact of walls.

use super::{
    block::BlockStepper, chain::RingChain, clock::RingClock, march::RingRun, schedule::RingSchedule,
    simulation::RingSimulation, walls::Walls,
};
use crate::error::MechanicsError;

/// Integrates the rings' motion from t = 0 by velocity Verlet, up to the last output before walls of one ring touch.
///
/// # Errors
/// [`MechanicsError::NotPhysical`], [`MechanicsError::Length`] or [`MechanicsError::ImposedTooShort`] for input without
/// meaning; [`MechanicsError::UnstableStep`] for a given step beyond the stability bound;
/// [`MechanicsError::NoEquilibrium`] for a state that no rings at rest have; [`MechanicsError::RingBroken`],
/// [`MechanicsError::TooLarge`] and [`MechanicsError::NotFinite`] as they say.
pub fn simulate_rings(chain: &RingChain, schedule: &RingSchedule) -> Result<RingSimulation, MechanicsError> {
    chain.check()?;
    let simulation = march(chain, schedule)?;
    let Some(contact) = simulation.self_contact else { return Ok(simulation) };
    // What was booked beyond the contact means nothing, so the part before is computed again by itself.
    let n_intervals = (contact.time_s / schedule.output_interval_s).ceil() - 1.0;
    let duration_s = schedule.output_interval_s * n_intervals.max(0.5);
    let before = march(chain, &RingSchedule { duration_s, ..*schedule })?;
    Ok(RingSimulation { self_contact: Some(contact), ..before })
}

fn march(chain: &RingChain, schedule: &RingSchedule) -> Result<RingSimulation, MechanicsError> {
    let clock = RingClock::new(chain, schedule)?;
    let machine = BlockStepper::new(&clock.rod, Walls::new(&chain.ring, clock.half.nodes_m.clone()), &clock);
    let mut run = RingRun::new(chain, schedule, &clock, &machine)?;
    run.go(&machine, schedule.n_threads)?;
    Ok(run.finish(chain, schedule))
}
