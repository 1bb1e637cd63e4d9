//! The chain's equations of motion: point masses in contact, what drives and holds them, and the forces and energies of a state.

mod energy;
pub(crate) mod force_row;
pub(crate) mod ground;
pub(crate) mod imposed;
pub(crate) mod model;
pub(crate) mod parameters;
pub(crate) mod row;
pub(crate) mod state;

pub use imposed::ImposedMotion;
pub use parameters::{Chain, Drive, FarEnd, FarStriker, Striker};
