//! What structure in the residuals may do to the dampings and to the recordings' own unknowns: how they differ between parts of the chain and of
//! the time.

use std::collections::BTreeSet;

use super::residuals::{Residual, Takes, TrackResiduals};
use super::rivals::{BetweenHypotheses, Shift};
use crate::damping::N_DAMPINGS;
use crate::error::FitError;
use crate::least_squares::{Minimum, N_OWN, NormalEquations, Own, OwnCovariance};

/// Parts into which the bodies, and the time, are cut.
const PARTS: usize = 5;

/// What the model misses.
#[derive(Debug, Default)]
pub(super) struct Discrepancy {
    /// The variances that it gives c_d and c_s.
    pub(super) of_dampings: [f64; N_DAMPINGS],
    /// What it makes of the recordings' strikers and impacts.
    pub(super) of_recordings: BetweenHypotheses,
}

/// What the model misses, as parts of the bodies or of the time tell it, whichever differ more.
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
) -> Result<Discrepancy, FitError> {
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
    let of_dampings = std::array::from_fn(|i| by_bodies.of_dampings[i].max(by_time.of_dampings[i]));
    let wider = if by_bodies.of_own > by_time.of_own { by_bodies } else { by_time };
    Ok(Discrepancy { of_dampings, of_recordings: BetweenHypotheses::of_shifts(wider.shifts) })
}

/// How parts differ.
struct Among {
    /// Variances of c_d and c_s.
    of_dampings: [f64; N_DAMPINGS],
    /// The mean variance of the recordings' own unknowns, in units of what noise leaves them.
    of_own: f64,
    /// What each part makes of the recordings' own unknowns.
    shifts: Vec<Shift>,
}

/// How parts differ, from the equations without each of them.
fn among(all: &NormalEquations, noise_variance: f64, without: &[NormalEquations; PARTS]) -> Among {
    let nothing = Among { of_dampings: [0.0; N_DAMPINGS], of_own: 0.0, shifts: Vec::new() };
    let Some(stands) = Stepped::of(all) else { return nothing };
    // A part without which the dampings are open says nothing of how others differ from it: those that do stand for all.
    let told: Vec<Stepped> = without.iter().filter_map(Stepped::of).collect();
    if told.is_empty() {
        return Among { of_dampings: [f64::INFINITY; N_DAMPINGS], ..nothing };
    }
    let weight = (PARTS - 1) as f64 * PARTS as f64 / told.len() as f64;
    let mut sums = [0.0; N_DAMPINGS];
    for left in &told {
        for (i, sum) in sums.iter_mut().enumerate() {
            let noise2 = noise_variance * (left.variances[i] - stands.variances[i]);
            *sum += (left.step[i] - stands.step[i]).powi(2) - noise2;
        }
    }
    // Strikers and impacts of all recordings together tell which share of the squares noise does not explain.
    let of_own = |left: &Stepped, k: usize| {
        let own = left.own.iter().zip(&stands.own).zip(left.own_variances.iter().zip(&stands.own_variances));
        own.fold([0.0, 0.0], |[squares, noise], ((left, stands), (left_variance, variance))| {
            let unit = noise_variance * variance[k];
            [
                squares + (left[k] - stands[k]).powi(2) / unit,
                noise + (left_variance[k] - variance[k]) / variance[k],
            ]
        })
    };
    let shares: [[f64; 2]; N_OWN] = std::array::from_fn(|k| {
        let [squares, noise] =
            told.iter().map(|left| of_own(left, k)).fold([0.0, 0.0], |a, b| [a[0] + b[0], a[1] + b[1]]);
        let excess = (squares - noise).max(0.0);
        [excess, if squares > 0.0 { excess / squares } else { 0.0 }]
    });
    let roots = Own::new((weight * shares[0][1]).sqrt(), (weight * shares[1][1]).sqrt());
    let shift = |left: &Stepped| {
        let own =
            left.own.iter().zip(&stands.own).map(|(left, stands)| (left - stands).component_mul(&roots));
        Shift::by(Vec::new(), own.collect())
    };
    Among {
        of_dampings: sums.map(|sum| weight * sum.max(0.0)),
        of_own: shares.iter().map(|[excess, _]| weight * excess).sum(),
        shifts: told.iter().map(shift).collect(),
    }
}

/// Where one step leads, and the variances there in units of the noise's.
struct Stepped {
    step: [f64; N_DAMPINGS],
    variances: [f64; N_DAMPINGS],
    own: Vec<Own>,
    own_variances: Vec<Own>,
}

impl Stepped {
    /// `None` where something is open.
    fn of(equations: &NormalEquations) -> Option<Self> {
        let reduced = equations.reduced(0.0)?;
        let system = reduced.system();
        let (step, covariance) = (system.step()?, system.covariance().ok()?);
        let of_each = OwnCovariance::of(&reduced, &covariance).of_each;
        Some(Self {
            step: std::array::from_fn(|i| step[i]),
            variances: std::array::from_fn(|i| covariance[(i, i)]),
            own: reduced.own_steps(&step),
            own_variances: of_each.iter().map(|of_own| of_own.diagonal()).collect(),
        })
    }
}
