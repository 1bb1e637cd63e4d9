//! Refuses motions and settings that make no sense.

use chainwave_measurement::ChainMotion;
use ndarray::Array2;

use crate::AnalysisError;

/// Samples without which no local polynomial of order four can be fitted.
const MIN_TIMES: usize = 8;
/// How far a time may lie from equal spacing, as a share of the interval.
const SPACING_TOLERANCE: f64 = 1e-3;

/// Refuses a motion whose arrays do not fit together, whose times are not one time base, or that holds a number that is
/// not finite.
pub(crate) fn check_motion(motion: &ChainMotion) -> Result<(), AnalysisError> {
    if motion.n_bodies() < 2 {
        return Err(AnalysisError::TooFewBodies { found: motion.n_bodies() });
    }
    check_times(&motion.times_s)?;
    check_shapes(motion)?;
    check_numbers(motion)
}

fn check_times(times_s: &[f64]) -> Result<(), AnalysisError> {
    let found = times_s.len();
    let (&[first, ..], &[.., last]) = (times_s, times_s) else {
        return Err(AnalysisError::TooFewTimes { expected: MIN_TIMES, found });
    };
    if found < MIN_TIMES {
        return Err(AnalysisError::TooFewTimes { expected: MIN_TIMES, found });
    }
    let interval = (last - first) / (found - 1) as f64;
    for (index, &found_s) in times_s.iter().enumerate() {
        let expected_s = first + interval * index as f64;
        let in_step = (found_s - expected_s).abs() <= SPACING_TOLERANCE * interval && interval > 0.0;
        if !in_step {
            return Err(AnalysisError::UnequalTimes { index, expected_s, found_s });
        }
    }
    Ok(())
}

fn check_shapes(motion: &ChainMotion) -> Result<(), AnalysisError> {
    let expected = (motion.n_bodies(), motion.times_s.len());
    let check = |what: &str, found: (usize, usize)| {
        let what = what.to_owned();
        if found == expected { Ok(()) } else { Err(AnalysisError::Shape { what, expected, found }) }
    };
    check("displacement_m", motion.displacement_m.dim())?;
    check("independent_sigma_m", motion.independent_sigma_m.dim())?;
    let unfitting = motion.modes.unfitting(expected);
    unfitting.map_or(Ok(()), |(source, found)| check(&source.to_string(), found))
}

fn check_numbers(motion: &ChainMotion) -> Result<(), AnalysisError> {
    let refuse =
        |(body, index): (usize, usize), found| AnalysisError::NotFinite { body: body + 1, index, found };
    for (place, sample) in motion.displacement_m.indexed_iter() {
        if let Some(x) = sample.filter(|x| !x.value.is_finite()) {
            return Err(refuse(place, x.value));
        }
    }
    let is_sigma = |sigma: f64| sigma.is_finite() && sigma >= 0.0;
    refuse_first(&motion.independent_sigma_m, is_sigma)
        .map_or(Ok(()), |(place, found)| Err(refuse(place, found)))?;
    motion.modes.not_finite().map_or(Ok(()), |(place, found)| Err(refuse(place, found)))
}

fn refuse_first(array: &Array2<f64>, is_good: impl Fn(f64) -> bool) -> Option<((usize, usize), f64)> {
    array.indexed_iter().find(|(_, value)| !is_good(**value)).map(|(place, value)| (place, *value))
}

/// Refuses a setting that is not a positive finite number.
pub(crate) fn check_positive(name: &'static str, found: f64) -> Result<(), AnalysisError> {
    if found.is_finite() && found > 0.0 {
        return Ok(());
    }
    Err(AnalysisError::Setting { name, expected: "a positive number", found })
}

/// Refuses a setting that does not lie strictly between zero and one.
pub(crate) fn check_fraction(name: &'static str, found: f64) -> Result<(), AnalysisError> {
    if found > 0.0 && found < 1.0 {
        return Ok(());
    }
    Err(AnalysisError::Setting { name, expected: "a number between 0 and 1", found })
}
