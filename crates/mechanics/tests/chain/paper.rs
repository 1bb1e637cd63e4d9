//! The experiment's chain in numbers, for tests and benches.

/// The ring's own law, fitted over 0 to 10 mm: prefactor in N/m^p, offset in metres, exponent.
pub(crate) const RING_LAW: (f64, f64, f64) = (60.1, 2.27e-3, 0.114);
pub(crate) const MASS_KG: f64 = 0.455e-3;
pub(crate) const STRIKER_KG: f64 = 4.3e-3;
