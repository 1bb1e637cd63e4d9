//! Lengths and standard uncertainties that a calibration can rest on, and the refusal of others.

use chainwave_measurement::Estimate;

use crate::error::CameraError;

pub(super) fn check_length(what: &str, length: Estimate) -> Result<(), CameraError> {
    if !(length.value.is_finite() && length.value > 0.0) {
        return Err(refusal(what, "a finite number above 0", length.value));
    }
    check_sigma(length.sigma)
}

pub(super) fn check_sigma(sigma: f64) -> Result<(), CameraError> {
    let valid = sigma.is_finite() && sigma >= 0.0;
    valid.then_some(()).ok_or_else(|| refusal("standard uncertainty", "a finite number, 0 or above", sigma))
}

pub(super) fn refusal(what: &str, expected: &str, found: f64) -> CameraError {
    CameraError::Calibration { what: what.into(), expected: expected.into(), found }
}
