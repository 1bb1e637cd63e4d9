//! What a chain of rings did: motion, energies, drifts, shapes.

use chainwave_measurement::Trajectory;
use ndarray::Array4;

use crate::chain::simulation::StrikerMotion;

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
