//! Checks of parameters, each with an error that names what was expected.

use crate::error::MechanicsError;

/// Requires a finite number above zero.
pub(crate) fn positive(quantity: impl Into<String>, value: f64) -> Result<(), MechanicsError> {
    require(value.is_finite() && value > 0.0, quantity, "a finite number above 0", value)
}

/// Requires a finite number, zero or above.
pub(crate) fn not_negative(quantity: impl Into<String>, value: f64) -> Result<(), MechanicsError> {
    require(value.is_finite() && value >= 0.0, quantity, "a finite number, 0 or above", value)
}

/// Requires a finite number.
pub(crate) fn finite(quantity: impl Into<String>, value: f64) -> Result<(), MechanicsError> {
    require(value.is_finite(), quantity, "a finite number", value)
}

/// Stored numbers beyond which a simulation is refused: 2 GB, and with velocities 4 GB.
pub(crate) const MAX_STORED: f64 = 2.5e8;

/// Refuses `value` unless `holds`.
pub(crate) fn require(
    holds: bool,
    quantity: impl Into<String>,
    expected: &'static str,
    found: f64,
) -> Result<(), MechanicsError> {
    if holds {
        Ok(())
    } else {
        Err(MechanicsError::NotPhysical { quantity: quantity.into(), expected, found })
    }
}

/// Requires as many entries as there are bodies.
pub(crate) fn length(quantity: &'static str, expected: usize, found: usize) -> Result<(), MechanicsError> {
    if expected == found { Ok(()) } else { Err(MechanicsError::Length { quantity, expected, found }) }
}

/// Checks each entry of a list over bodies; a failure names the body, counted from 1.
pub(crate) fn each_body(
    quantity: &str,
    values: &[f64],
    check: fn(String, f64) -> Result<(), MechanicsError>,
) -> Result<(), MechanicsError> {
    let refused = values.iter().position(|&value| check(String::new(), value).is_err());
    refused.map_or(Ok(()), |i| check(format!("{quantity} of body {}", i + 1), values[i]))
}

/// Refuses more than `limit` of something.
pub(crate) fn limit(
    quantity: &'static str,
    limit: f64,
    found: f64,
    hint: &'static str,
) -> Result<(), MechanicsError> {
    if found <= limit { Ok(()) } else { Err(MechanicsError::TooLarge { quantity, limit, found, hint }) }
}
