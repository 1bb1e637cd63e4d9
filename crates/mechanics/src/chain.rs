//! The chain model: point masses in contact, what drives them, and the march that integrates their motion and books energies,
//! peaks and outputs; many chains at once; and how a motion follows its parameters.

mod automatic;
mod change;
mod course;
pub(crate) mod force_row;
mod front;
pub(crate) mod ground;
pub(crate) mod imposed;
mod ledger;
mod linear_chain;
pub(crate) mod model;
pub(crate) mod parameters;
mod record;
mod recorder;
mod replay;
pub(crate) mod row;
mod run;
mod scan;
mod schedule;
mod sensitivity;
mod simulate;
pub(crate) mod simulation;
pub(crate) mod state;
mod step_size;
mod switch;
mod tangent;
mod unit_cell;

pub use change::Change;
pub use imposed::ImposedMotion;
pub use linear_chain::LinearChain;
pub use parameters::{Chain, Drive, FarEnd, FarStriker, Striker};
pub use replay::{Replay, Stretch};
pub use scan::{ensemble, scan};
pub use schedule::{Bodies, Integration, Schedule};
pub use sensitivity::{
    ReferenceMotion, Sensitivities, Variations, simulate_with_friction, simulate_with_sensitivities,
};
pub use simulate::simulate;
pub use simulation::{Simulation, StrikerMotion};
pub use unit_cell::UnitCell;
