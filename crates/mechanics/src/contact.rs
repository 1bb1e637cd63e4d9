//! What lies in the gaps: laws of force over overlap, each for one gap and for vectors of gaps, and the striker's one-sided contact.

pub(crate) mod contacts;
pub(crate) mod dashpots;
pub(crate) mod gaps;
pub(crate) mod linear;
mod power;
mod power_kernel;
mod power_lanes;
mod power_table;
pub(crate) mod spring;
pub(crate) mod striker;
pub(crate) mod table;
pub(crate) mod tension;

pub use contacts::{Contact, Contacts, Law};
pub use linear::LinearLaw;
pub use power::PowerLaw;
pub use table::TableLaw;
pub use tension::Tension;
