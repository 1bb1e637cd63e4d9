//! Intervals by profile likelihood.

use chainwave_measurement::{Estimate, both_in_parallel};
use nalgebra::DVector;

use super::residuals::TrackResiduals;
use crate::error::FitError;
use crate::least_squares::{LeastSquares, Minimum, Stop, Unknowns, least_chi_squared};

/// A 95 % interval by profile likelihood: where chi squared, all other unknowns fitted anew, is 3.84 above its least (times the
/// residuals' excess over what is stated).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Its lower end; zero where the data do not tell the quantity from zero.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// Whether both ends lie where 1.96 standard uncertainties put them, within a twentieth: chi squared is then a parabola, and the
    /// standard uncertainty says all.
    pub is_quadratic: bool,
    /// Whether chi squared was followed to both ends. An end to which it was not, as no search led there, lies where 1.96 standard uncertainties
    /// put it, and nothing tells whether chi squared is a parabola.
    pub is_profile: bool,
}

impl Interval {
    /// The interval whose ends lie so many times as far from a value, and no lower than zero.
    pub(super) fn widened(self, value: f64, times: f64) -> Self {
        let end = |end: f64| value + times * (end - value);
        Self { low: end(self.low).max(0.0), high: end(self.high), ..self }
    }
}

/// Steps of the other unknowns shorter than this, in standard errors, end their search: a rise of 3.84 is then known to a hundredth, its root to 0.2 %.
const SHORT: f64 = 0.1;
/// How far the square root of chi squared's rise may be off at an end.
const TOLERANCE: f64 = 0.05;
const MAX_ROUNDS: usize = 4;

/// The interval of a shared unknown, which takes the others along at the rates `moves` (its own is 1), by a secant in the root of chi squared's rise, which is nearly straight. Its ends are sought beside each other.
pub(super) fn interval_95(
    problem: &TrackResiduals<'_>,
    best: &Minimum,
    (unknown, moves): (usize, &DVector<f64>),
    estimate: Estimate,
    inflation: f64,
) -> Interval {
    let wanted = Estimate::COVERAGE_95 * inflation;
    let rise = |value: f64| Ok(rise_at(problem, best, (unknown, moves), value)?.sqrt() / wanted);
    let n_threads = problem.model.n_threads;
    let (low, high) =
        both_in_parallel(n_threads, || end(estimate, -1.0, &rise), || end(estimate, 1.0, &rise));
    Interval::between(low, high)
}

/// An end of an interval, and whether it is where standard uncertainties put it; `None` where it was not found.
#[derive(Clone, Copy)]
struct End {
    value: f64,
    is_quadratic: Option<bool>,
}

impl Interval {
    fn between(low: End, high: End) -> Self {
        let ends = [low.is_quadratic, high.is_quadratic];
        Self {
            low: low.value,
            high: high.value,
            is_quadratic: ends == [Some(true); 2],
            is_profile: ends.iter().all(Option::is_some),
        }
    }
}

/// The end on one side, from the root of chi squared's rise over the wanted one. The minimum and its covariance are known however the searches beside
/// it go, so that the end which they put there stands for one that is not found.
fn end(estimate: Estimate, sign: f64, rise: &impl Fn(f64) -> Result<f64, FitError>) -> End {
    let by_sigma = (estimate.value + sign * Estimate::COVERAGE_95 * estimate.sigma).max(0.0);
    let mut value = by_sigma;
    for round in 0..MAX_ROUNDS {
        value = value.max(0.0);
        let Ok(rise) = rise(value) else { return End { value: by_sigma, is_quadratic: None } };
        let at_zero = value <= 0.0 && rise < 1.0;
        if at_zero || (rise - 1.0).abs() < TOLERANCE || round + 1 == MAX_ROUNDS {
            let refined = if at_zero { value } else { along(estimate.value, value, rise) };
            return End { value: refined, is_quadratic: Some(round == 0) };
        }
        value = along(estimate.value, value, rise);
    }
    End { value, is_quadratic: Some(false) }
}

/// By how much chi squared rises above its least where a shared unknown is held at a value.
pub(super) fn rise_at(
    problem: &TrackResiduals<'_>,
    best: &Minimum,
    (unknown, moves): (usize, &DVector<f64>),
    value: f64,
) -> Result<f64, FitError> {
    // The others move along as the equations at the minimum let expect.
    let shared = &best.at.shared + moves * (value - best.at.shared[unknown]);
    let start = problem.bounds().nearest(Unknowns { shared, own: best.at.own.clone() });
    let held = least_chi_squared(problem, start, &[unknown], &Stop { step: SHORT, ..Stop::STATED });
    let held = held.map_err(|why| problem.failure(why))?;
    Ok((held - best.chi_squared()).max(0.0))
}

/// Where the root of the rise would be 1, were it straight.
fn along(from: f64, to: f64, rise: f64) -> f64 {
    // A search that hardly rose is sent no farther than four times out.
    from + (to - from) / rise.max(0.25)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ESTIMATE: Estimate = Estimate { value: 3.0, sigma: 0.5 };

    /// The ends where the root of chi squared's rise is a function of the value.
    fn of(rise: impl Fn(f64) -> Result<f64, FitError>) -> Interval {
        Interval::between(end(ESTIMATE, -1.0, &rise), end(ESTIMATE, 1.0, &rise))
    }

    fn sigmas(value: f64) -> f64 {
        (value - ESTIMATE.value).abs() / (Estimate::COVERAGE_95 * ESTIMATE.sigma)
    }

    #[test]
    fn ends_lie_where_chi_squared_rises_by_what_is_asked() {
        let parabola = of(|value| Ok(sigmas(value)));
        assert!(parabola.is_quadratic && parabola.is_profile, "{parabola:?}");
        let narrower = of(|value| Ok(2.0 * sigmas(value)));
        assert!(!narrower.is_quadratic && narrower.is_profile, "{narrower:?}");
        for (found, times) in [(parabola, 1.0), (narrower, 0.5)] {
            let half = times * Estimate::COVERAGE_95 * ESTIMATE.sigma;
            // The secant of a straight line ends on it, but for rounding.
            assert!((found.low - (3.0 - half)).abs() < 1e-12 && (found.high - (3.0 + half)).abs() < 1e-12);
        }
    }

    #[test]
    fn an_end_that_no_search_leads_to_lies_where_the_sigma_puts_it_and_is_told() {
        let half = Estimate::COVERAGE_95 * ESTIMATE.sigma;
        // At once above, and behind the first step below.
        let lost = |value: f64| match value {
            value if value > ESTIMATE.value || value > 2.2 => Err(FitError::NotConverged { rounds: 60 }),
            value => Ok(2.0 * sigmas(value)),
        };
        let found = of(lost);
        assert!(!found.is_quadratic && !found.is_profile, "{found:?}");
        assert!((found.low - (3.0 - half)).abs() < 1e-12 && (found.high - (3.0 + half)).abs() < 1e-12);
    }
}
