//! What structure in the residuals may do to the dampings: how they differ between parts of the chain and of the time.

use std::collections::BTreeSet;

use super::residuals::{Residual, Takes, TrackResiduals};
use crate::damping::N_DAMPINGS;
use crate::error::FitError;
use crate::least_squares::{Minimum, NormalEquations};

/// Parts into which the bodies, and the time, are cut.
const PARTS: usize = 5;

/// Variances of c_d and c_s for what the model misses: those among parts of the bodies or of the time, whichever is larger.
///
/// Each part is left out in turn, and one Gauss-Newton step tells where the unknowns go without it. Pseudo-values made of these (J. W. Tukey's
/// jackknife) stand for what each part would say alone. Their variance, less what noise makes of it, is that of the model's error from part
/// to part; it is not divided by the number of parts, as nothing says that parts err independently.
///
/// # Errors
/// As the model's that is solved anew.
pub(super) fn discrepancy(
    problem: &TrackResiduals<'_>,
    minimum: &Minimum,
    residuals: &[Residual],
    noise_variance: f64,
) -> Result<[f64; N_DAMPINGS], FitError> {
    let moving = || residuals.iter().filter(|residual| residual.after_impact_s > 0.0);
    let bodies: BTreeSet<usize> = moving().map(|residual| residual.body).collect();
    let bodies: Vec<usize> = bodies.into_iter().collect();
    let place = |body: usize| bodies.binary_search(&body).map_or(PARTS, |row| row * PARTS / bodies.len());
    let mut times_s: Vec<f64> = moving().map(|residual| residual.after_impact_s).collect();
    times_s.sort_by(f64::total_cmp);
    let bounds: Vec<f64> =
        (1..PARTS).filter_map(|k| times_s.get(k * times_s.len() / PARTS).copied()).collect();
    let part_of_time = |time_s: f64| bounds.partition_point(|bound| *bound <= time_s);
    let of_parts = |part_of: &(dyn Fn(usize, f64) -> usize + Sync)| -> Result<_, FitError> {
        let without: [_; PARTS] = std::array::from_fn(|part| {
            move |_: usize, body: usize, time_s: f64| time_s <= 0.0 || part_of(body, time_s) != part
        });
        let takes = without.each_ref().map(|takes| takes as &Takes<'_>);
        let (_, without) = problem.equations_of(&minimum.at, true, takes)?;
        Ok(among(&minimum.equations, noise_variance, &without))
    };
    let by_bodies = of_parts(&|body, _| place(body))?;
    let by_time = of_parts(&|_, time_s| part_of_time(time_s))?;
    Ok(std::array::from_fn(|i| by_bodies[i].max(by_time[i])))
}

/// The variance among parts, from the equations without each of them.
fn among(
    all: &NormalEquations,
    noise_variance: f64,
    without: &[NormalEquations; PARTS],
) -> [f64; N_DAMPINGS] {
    let Some((step, variance)) = stepped(all) else { return [0.0; N_DAMPINGS] };
    let mut sums = [0.0; N_DAMPINGS];
    // A part without which the dampings are open says nothing of how others differ from it: those that do stand for all.
    let told: Vec<_> = without.iter().filter_map(stepped).collect();
    if told.is_empty() {
        return [f64::INFINITY; N_DAMPINGS];
    }
    let n_told = told.len();
    for (left_step, left_variance) in told {
        for (i, sum) in sums.iter_mut().enumerate() {
            let noise2 = noise_variance * (left_variance[i] - variance[i]);
            *sum += (left_step[i] - step[i]).powi(2) - noise2;
        }
    }
    sums.map(|sum| (PARTS - 1) as f64 * PARTS as f64 / n_told as f64 * sum.max(0.0))
}

/// Where one step leads, and the variances there in units of the noise's; `None` where something is open.
fn stepped(equations: &NormalEquations) -> Option<([f64; N_DAMPINGS], [f64; N_DAMPINGS])> {
    let system = equations.reduced(0.0)?.system();
    let (step, covariance) = (system.step()?, system.covariance().ok()?);
    Some((std::array::from_fn(|i| step[i]), std::array::from_fn(|i| covariance[(i, i)])))
}
