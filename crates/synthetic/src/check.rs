//! Checks of settings: an error that names the setting, what was expected and what was found.

use crate::SyntheticError;

/// An error that names the setting unless `holds`.
pub(crate) fn require(
    holds: bool,
    name: &'static str,
    expected: &'static str,
    found: impl ToString + Copy,
) -> Result<(), SyntheticError> {
    if holds { Ok(()) } else { Err(SyntheticError::Setting { name, expected, found: found.to_string() }) }
}

/// An error unless the setting is finite and above 0.
pub(crate) fn require_positive(name: &'static str, value: f64) -> Result<(), SyntheticError> {
    require(value > 0.0 && value.is_finite(), name, "a positive number", value)
}

/// An error unless the setting is finite and at least 0.
pub(crate) fn require_not_negative(name: &'static str, value: f64) -> Result<(), SyntheticError> {
    require(value >= 0.0 && value.is_finite(), name, "a number of at least 0", value)
}

/// An error unless the setting is a share of something.
pub(crate) fn require_share(name: &'static str, share: f64) -> Result<(), SyntheticError> {
    require((0.0..=1.0).contains(&share), name, "0 to 1", share)
}
