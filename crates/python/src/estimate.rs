//! Numbers with their uncertainties on their way to Python.

use chainwave_measurement::Estimate;

/// Value, sigma, and the ends of the 95 % interval.
pub(crate) type Told = (f64, f64, (f64, f64));

/// A number, or why it is refused: one of both.
pub(crate) type Number = (Option<Told>, Option<String>);

/// An estimate whose 95 % interval is `factor_95` standard uncertainties wide on each side.
pub(crate) fn told(estimate: Estimate, factor_95: f64) -> Told {
    let Estimate { value, sigma } = estimate;
    (value, sigma, (value - factor_95 * sigma, value + factor_95 * sigma))
}

/// A number whose errors are normal.
pub(crate) fn of_estimate(estimate: Estimate) -> Number {
    (Some(told(estimate, Estimate::COVERAGE_95)), None)
}

/// A number that there is not.
pub(crate) fn refused(reason: &str) -> Number {
    (None, Some(reason.to_owned()))
}
