//! The experiment's chain in numbers, for tests and benches.

pub(crate) const MASS_KG: f64 = 0.455e-3;
pub(crate) const STRIKER_KG: f64 = 4.3e-3;
