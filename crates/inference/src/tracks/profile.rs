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
) -> Result<Interval, FitError> {
    let wanted = Estimate::COVERAGE_95 * inflation;
    let end = |sign: f64| -> Result<(f64, bool), FitError> {
        let mut value = estimate.value + sign * Estimate::COVERAGE_95 * estimate.sigma;
        for round in 0..MAX_ROUNDS {
            value = value.max(0.0);
            let rise = rise_at(problem, best, (unknown, moves), value)?.sqrt() / wanted;
            let at_zero = value <= 0.0 && rise < 1.0;
            if at_zero || (rise - 1.0).abs() < TOLERANCE || round + 1 == MAX_ROUNDS {
                let refined = if at_zero { value } else { along(estimate.value, value, rise) };
                return Ok((refined, round == 0));
            }
            value = along(estimate.value, value, rise);
        }
        Ok((value, false))
    };
    let (low, high) = both_in_parallel(problem.model.n_threads, || end(-1.0), || end(1.0));
    let ((low, first_low), (high, first_high)) = (low?, high?);
    Ok(Interval { low, high, is_quadratic: first_low && first_high })
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
