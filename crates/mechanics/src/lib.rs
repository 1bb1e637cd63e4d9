//! Forward models of the chain: what the bodies do when the first one is struck, moved or let go.
//!
//! The crate knows the mechanics and nothing of measurements: parameters in, motion out. Three layers keep it open for
//! more laws, integrators and models:
//!
//! - the contact law ([`PowerLaw`]) gives force, energy and stiffness of one gap, each in a form that keeps its digits
//!   for any overlap;
//! - the model turns positions and velocities into accelerations, and knows masses, dampers, the drive and the far end;
//! - the integrator (classical Runge-Kutta of fourth order) knows only rates. Where the striker's one-sided contact opens
//!   or closes, the step is cut at that instant, so that each step sees smooth forces and the order holds.
//!
//! Energy is booked along the way: kinetic and potential energy plus what the dampers took stays constant, and
//! [`Simulation::energy_drift`] says how well. Nothing is allocated after the start, and the same input gives the same
//! bits.

mod automatic;
mod chain;
mod check;
mod contact;
mod error;
mod front;
mod gaps;
mod imposed;
mod integrator;
mod lanes;
mod ledger;
mod model;
mod recorder;
mod ring;
mod run;
mod scan;
mod simulate;
mod state;
mod step_size;
mod switch;

pub use chain::{Chain, Drive, FarEnd, Striker};
pub use contact::{Contact, Contacts, Law, LinearLaw, PowerLaw, TableLaw, Tension};
pub use error::MechanicsError;
pub use imposed::ImposedMotion;
pub use integrator::Method;
pub use ring::{
    Boundary, Compression, Equilibrium, Mode, RefinedSimulation, Response, Ring, RingChain, RingDrive,
    RingSchedule, RingSimulation, RingStriker, Rod, Section, Support, Symmetry, compress, ring_bands,
    ring_modes, simulate_rings, simulate_rings_within,
};
pub use scan::scan;
pub use simulate::{Bodies, Integration, Schedule, Simulation, StrikerMotion, simulate};
