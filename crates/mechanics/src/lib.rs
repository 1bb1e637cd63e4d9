//! Forward models of the chain: what the bodies do when the first one is struck, moved or let go.
//!
//! The crate knows the mechanics and nothing of measurements: parameters in, motion out. Three layers keep it open for
//! more laws, integrators and models:
//!
//! - contact laws ([`Law`]) give force, energy and stiffness of one gap, each in a form that keeps its digits for any
//!   overlap. What a chain's gaps hold is sorted by law once, and forces are computed for vectors of gaps, with the same bits
//!   on every instruction set; a power law that all gaps share becomes a table, which costs a third of the formula;
//! - the model turns positions and velocities into accelerations, and knows masses, dampers, the drive and the far end;
//! - integrators ([`Method`]) know rates and forces only. Where the striker's one-sided contact opens or closes, the step is
//!   cut at that instant, so that each step sees smooth forces and every order holds. Between them and the model stands the
//!   march: it chooses steps, leaves out bodies that the wave has not reached, books energies and peaks, and records outputs.
//!
//! Without a method asked for, a run takes the one that its scene calls for, to the accuracy asked for, and says why
//! ([`Simulation::choice`]) and how far off it may be ([`Simulation::error_estimate`]).
//! Many chains ([`scan`], [`ensemble`]) share the cores, each with the bits that it has alone. How a motion follows its parameters is
//! integrated along with it ([`simulate_with_sensitivities`]), so that a fit needs no differences of simulations.
//!
//! Energy is booked along the way: kinetic and potential energy plus what the dampers took stays constant, and
//! [`Simulation::energy_drift`] says how well. Nothing is allocated in a step, and the same input gives the same bits.

mod automatic;
mod chain;
mod check;
mod contact;
mod course;
mod error;
mod force_row;
mod front;
mod gaps;
mod imposed;
mod integrator;
mod lanes;
mod ledger;
mod model;
mod recorder;
mod ring;
mod row;
mod run;
mod scan;
mod sensitivity;
mod simulate;
mod state;
mod step_size;
mod striker;
mod switch;
mod tangent;

pub use chain::{Chain, Drive, FarEnd, Striker};
pub use contact::{Contact, Contacts, Law, LinearLaw, PowerLaw, TableLaw, Tension};
pub use error::MechanicsError;
pub use imposed::ImposedMotion;
pub use integrator::Method;
pub use ring::{
    Boundary, Compression, Equilibrium, Mode, RefinedSimulation, Response, Ring, RingChain, RingDrive,
    RingSchedule, RingSimulation, RingStriker, Rod, Section, SelfContact, Support, Symmetry, compress,
    ring_bands, ring_modes, simulate_rings, simulate_rings_within,
};
pub use scan::{ensemble, scan};
pub use sensitivity::{Change, Sensitivities, simulate_with_sensitivities};
pub use simulate::{Bodies, Integration, Schedule, Simulation, StrikerMotion, simulate};
