//! The contact law of a compression curve, as `chainwave contact` fits it.

use chainwave_inference::contact_fit::{self, PARAMETERS, Zero};
use pyo3::prelude::*;
use serde_json::json;

use crate::cells::TableArgument;
use crate::estimate::{Told, told};
use crate::failure::Failure;
use crate::work::watched;

/// The parameters with their names, and what else is known of the fit (JSON).
#[pyfunction]
pub(crate) fn fit_contact(
    py: Python<'_>,
    curve: TableArgument,
    zero: &str,
) -> PyResult<(Vec<(&'static str, Told)>, String)> {
    let zero = match zero {
        "auto" => Zero::Auto,
        "stated" => Zero::Stated,
        "load-cell" => Zero::LoadCell,
        "contact" => Zero::Contact,
        other => {
            let message = format!("zero {other:?}: expected auto, stated, load-cell or contact");
            return Err(Failure::Argument(message).into());
        }
    };
    let table = curve.table("curve")?;
    let numbers = |name: &str| table.full_numbers(name).map_err(Failure::from);
    let (overlap_m, force_n) = (numbers("overlap_m")?, numbers("force_n")?);
    let fit = watched(py, None, move |_, _| Ok(contact_fit::fit_contact(&overlap_m, &force_n, zero)?))?;
    let parameters = PARAMETERS.iter().zip(&fit.estimates);
    let parameters = parameters.map(|(name, estimate)| (*name, told(*estimate, fit.factor_95))).collect();
    let residual = fit.residual;
    let details = json!({
        "factor_95": fit.factor_95,
        "cannot_tell_apart": fit.ambiguities,
        "correlation": fit.correlation,
        "residual": {
            "rms_n": residual.rms_n,
            "largest_n": residual.largest_n,
            "noise_n": residual.noise_n,
            "overlap_noise_m": residual.overlap_noise_m,
            "autocorrelation": residual.autocorrelation,
            "widening": residual.widening,
            "n_readings": residual.n_readings,
            "degrees_of_freedom": residual.degrees_of_freedom,
        },
        "p_interval": [fit.profile.low, fit.profile.high],
    });
    Ok((parameters, details.to_string()))
}
