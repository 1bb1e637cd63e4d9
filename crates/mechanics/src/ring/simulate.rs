use chainwave_measurement::Trajectory;
use ndarray::Array4;

use super::{RingChain, block::Machine, clock::Clock, march::Run, walls::Walls};
use crate::{MechanicsError, StrikerMotion};

/// When a simulation ends, when it reports, its step and its threads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingSchedule {
    /// Length of the simulation in seconds. Outputs lie at all multiples of the interval up to it.
    pub duration_s: f64,
    /// Time between outputs, in seconds.
    pub output_interval_s: f64,
    /// Largest time step in seconds; the step used is the next smaller one that divides the output interval. `None`: 0.9
    /// of the largest stable one.
    pub dt_s: Option<f64>,
    /// Whether the rings' shapes are wanted.
    pub shapes: bool,
    /// Threads; the result does not depend on them.
    pub n_threads: usize,
}

/// What a chain of rings did.
#[derive(Debug, Clone, PartialEq)]
pub struct RingSimulation {
    /// Motion of joints 1 to N + 1 at the output times.
    pub trajectory: Trajectory,
    /// Motion of the striker at the output times, where there is one.
    pub striker: Option<StrikerMotion>,
    /// Largest change, over the outputs, of the energy held and lost, relative to the largest held. The energy is that
    /// which velocity Verlet keeps exactly for linear rings: with the product of the velocities half a step before and after.
    pub energy_drift: f64,
    /// Largest change, over the outputs, of the momentum along the chain, relative to the largest; `None` where a wall, a
    /// damper or an imposed motion takes part.
    pub momentum_drift: Option<f64>,
    /// Largest strain energy of each ring in joules, looked for every 20 microseconds and at the outputs.
    pub psi_max_j: Vec<f64>,
    /// Number of steps.
    pub steps: u64,
    /// Time step in seconds.
    pub dt_s: f64,
    /// Largest stable time step in seconds.
    pub stable_dt_s: f64,
    /// Elements times steps computed: less than all, where the wave was not everywhere all the time.
    pub element_steps: u64,
    /// Share of them by the slower functions, for rings bent beyond the fast ones' range.
    pub wide_share: f64,
    /// Times the striker's contact opened or closed after t = 0.
    pub contact_switches: u32,
    /// Where walls of one ring touched, which is the end of the model: the outputs end before it.
    pub self_contact: Option<SelfContact>,
    /// Centrelines of the upper halves in metres, shape `[ring, time, node, axis]`: x from the first joint's place at rest, y
    /// from the chain's axis. The first and last node are the joints.
    pub shapes_m: Option<Array4<f64>>,
}

/// Walls of one ring that touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfContact {
    /// Number of the ring, from 1.
    pub ring: usize,
    /// When it was seen, in seconds: at most 20 microseconds, or a step, after it happened.
    pub time_s: f64,
}

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
    let clock = Clock::new(chain, schedule)?;
    let machine = Machine::new(&clock.rod, Walls::new(&chain.ring, chain.elements_per_ring), &clock);
    let mut run = Run::new(chain, schedule, &clock, &machine)?;
    run.go(&machine, schedule.n_threads)?;
    Ok(run.finish(chain, schedule))
}
