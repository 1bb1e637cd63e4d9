//! The linear spring.

use crate::{check, error::MechanicsError};

/// A linear spring, F = k Delta: in tension too, unless the contact detaches at zero overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearLaw {
    /// Stiffness in newtons per metre.
    pub k_n_per_m: f64,
}

impl LinearLaw {
    /// A spring from its stiffness.
    ///
    /// # Errors
    /// [`MechanicsError::NotPhysical`] unless the stiffness is finite and above zero.
    pub fn new(k_n_per_m: f64) -> Result<Self, MechanicsError> {
        let law = Self { k_n_per_m };
        law.check()?;
        Ok(law)
    }

    pub(crate) fn check(&self) -> Result<(), MechanicsError> {
        check::positive("contact k_n_per_m", self.k_n_per_m)
    }
}
