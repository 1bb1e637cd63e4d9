//! One step towards the minimum, between bounds.

use nalgebra::DVector;

use super::bordered::{NormalEquations, SharedSystem};
use super::problem::{Bounds, Unknowns};

/// A step, and the square of the length in standard errors of the step that no damping would shorten.
pub(super) struct Step {
    pub(super) step: Unknowns,
    pub(super) length2: f64,
    /// By how much the sum of squares would fall at least, were the problem linear, and just by that where no damping shortens the step.
    pub(super) fall: f64,
}

/// The step from some values to where a problem that is linear has its minimum between the bounds, shortened by the `damping`; `None` where the
/// equations are singular.
pub(super) fn constrained_step(
    here: &NormalEquations,
    at: &Unknowns,
    bounds: &Bounds,
    held: &[usize],
    damping: f64,
) -> Option<Step> {
    let reduced = here.reduced(damping)?;
    let (shared, resting) = within(&reduced.system(), &at.shared, &bounds.shared, held)?;
    let own = reduced.own_steps(&shared);
    // What damping makes short is not settled: the length is that of the full step, where there is one.
    let full = if damping > 0.0 { here.reduced(0.0) } else { None };
    let length2 = full.and_then(|full| {
        let mut system = full.system();
        resting.iter().for_each(|unknown| system.hold(*unknown));
        let shared = system.step()?;
        Some(system.length2(&shared) + full.own_length2(&shared))
    });
    let length2 = length2.unwrap_or_else(|| {
        let mut system = reduced.system();
        resting.iter().for_each(|unknown| system.hold(*unknown));
        system.length2(&shared) + reduced.own_length2(&shared)
    });
    let fall = here.fall(&shared, &own);
    Some(Step { step: Unknowns { shared, own }, length2, fall })
}

/// The step of the shared unknowns, none of which leaves its bounds from a bound, and those that rest: what would go beyond its bound
/// stays there, and the others find their place without it (active set).
pub(crate) fn within(
    system: &SharedSystem,
    at: &DVector<f64>,
    bounds: &[(f64, f64)],
    held: &[usize],
) -> Option<(DVector<f64>, Vec<usize>)> {
    let mut resting = held.to_vec();
    loop {
        let mut free = system.clone();
        resting.iter().for_each(|unknown| free.hold(*unknown));
        let step = free.step()?;
        let leaves = |i: usize| {
            let (lowest, highest) = bounds[i];
            at[i] <= lowest && step[i] < 0.0 || at[i] >= highest && step[i] > 0.0
        };
        let leaving: Vec<usize> = (0..step.len()).filter(|i| !resting.contains(i) && leaves(*i)).collect();
        if leaving.is_empty() {
            return Some((step, resting));
        }
        resting.extend(leaving);
    }
}
