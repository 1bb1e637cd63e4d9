//! The march of the chain model: it integrates the motion and books energies, peaks and outputs; many chains at once; and how a motion
//! follows its parameters.

mod automatic;
mod change;
mod control;
mod effort;
mod front;
mod gap_interpolant;
mod ledger;
mod linear_chain;
mod opening;
mod record;
mod recorded_steps;
mod recorder;
mod replay;
mod run;
mod run_request;
mod scan;
mod schedule;
mod sensitivity;
mod simulate;
pub(crate) mod simulation;
mod step_size;
mod switch;
mod tangent;
mod unit_cell;

pub use change::{Change, Resistance};
pub use linear_chain::LinearChain;
pub use replay::{Replay, Stretch};
pub use scan::{ensemble, scan};
pub use schedule::{Bodies, Integration, Schedule};
pub use sensitivity::{
    Kept, ReferenceMotion, Sensitivities, Variations, simulate_with_resistance, simulate_with_sensitivities,
};
pub use simulate::simulate;
pub use simulation::{Simulation, StrikerMotion};
pub use unit_cell::UnitCell;
