//! The ladder of integrators: explicit and implicit Runge-Kutta methods, and symplectic compositions. They know rates and forces
//! only, nothing of outputs, switches or energies.

mod implicit;
mod kick;
pub(crate) mod method;
mod rows;
pub(crate) mod rung;
mod runge_kutta;
pub(crate) mod step;
mod symplectic;
mod tableau;

pub use method::Method;
