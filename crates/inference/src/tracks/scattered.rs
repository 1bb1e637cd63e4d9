//! What bodies that are not quite alike may do to a fit before it is told.
//!
//! Masses and stiffnesses always scatter by a little. Where the model states them as alike, a scatter too small to leave structure bends
//! c_s and the strikers all the same. How large it is may be anything, and what it would be in each body the tracks tell in part: the mean over
//! both of what it makes of the unknowns joins their uncertainties.

use std::collections::BTreeSet;

use chainwave_measurement::Observation;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use super::hypothesis::Hypothesis;
use super::model::TrackModel;
use super::residuals::TrackResiduals;
use super::rivals::Shift;
use crate::damping::N_DAMPINGS;
use crate::error::FitError;
use crate::least_squares::{
    LeastSquares, NormalEquations, Own, Profiled, Reduced, SharedSystem, Unknowns, within,
};
use crate::quantity::Quantity;

/// What may scatter.
const KINDS: [Hypothesis; 2] = [Hypothesis::MassesScatter, Hypothesis::StiffnessScatters];
/// How likely it is beforehand that one of them scatters by as much as a fit could notice, against bodies that are alike.
pub const ODDS_OF_SCATTER: f64 = 1.0;
/// Numbers of one kind at most: in longer chains neighbours share one, whose mean scatters by less.
const MOST_NUMBERS: usize = 32;
/// How wide a scatter is tried, over the widest that tracks are asked for where they have structure: from a wide one, which would be told, down to
/// what no fit can notice.
const WIDTHS: [f64; 9] = [1.0, 0.3, 0.1, 0.03, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4];

/// Logarithm up to which likelihoods count, so that no odds are without bound.
const LARGEST_LN: f64 = 500.0;

/// What a scatter of which nothing is told makes of the unknowns of a fit, whose residuals have the variance `unit`; and the simulations behind that.
pub(super) fn scattered(
    observations: &[Observation],
    (model, asked): (&TrackModel, &[Quantity]),
    at: &Unknowns,
    unit: f64,
) -> Result<(Vec<Shift>, u64), FitError> {
    let (wide, kinds) = with_numbers(observations, model, asked);
    if kinds.is_empty() {
        return Ok((Vec::new(), 0));
    }
    let problem = TrackResiduals::new(observations, &wide, asked)?;
    let there = problem.extended(at, (model.priors.len(), asked.len()));
    let equations = problem.equations(&there)?;
    let numbers: Vec<usize> = kinds.iter().flatten().copied().collect();
    let shifts = Open::at(&equations, &there, &problem.bounds().shared, &numbers).map(|open| {
        let sigma = |number: &usize| wide.priors[number - N_DAMPINGS].relative_sigma;
        let told = |numbers: Vec<usize>| {
            let profiled = open.system.profiled(&numbers, &open.others)?;
            let sigmas = DVector::from_iterator(numbers.len(), numbers.iter().map(sigma));
            let scatters = scatters(&profiled, &sigmas, unit);
            Some(Kind { numbers, profiled, scatters })
        };
        let kinds: Vec<Kind> = kinds.into_iter().filter_map(told).collect();
        let odds = kinds.iter().flat_map(|kind| &kind.scatters).map(|one| one.odds);
        let sum = 1.0 + odds.sum::<f64>();
        let steps = kinds.iter().flat_map(|kind| kind.steps(sum));
        steps.map(|(kind, step)| open.shift(&kind.followed(&open, &step), &numbers)).collect()
    });
    Ok((shifts.unwrap_or_default(), problem.n_simulations()))
}

/// The model with a number for each body and gap, or group of neighbours, and the places of each kind's among the shared unknowns; kinds that the
/// model states or that are believed stay out.
fn with_numbers(
    observations: &[Observation],
    model: &TrackModel,
    asked: &[Quantity],
) -> (TrackModel, Vec<Vec<usize>>) {
    let bodies: BTreeSet<usize> =
        observations.iter().flat_map(|one| one.bodies.iter().map(|track| track.body)).collect();
    let bodies: Vec<usize> = bodies.into_iter().collect();
    let mut wide = model.clone();
    let mut kinds = Vec::new();
    for kind in KINDS.into_iter().filter(|kind| kind.is_open(model, asked)) {
        let first = wide.priors.len();
        wide = kind.applied_with_at_most(MOST_NUMBERS, &wide, asked, &bodies);
        kinds.push((N_DAMPINGS + first..N_DAMPINGS + wide.priors.len()).collect());
    }
    (wide, kinds)
}

/// What is open at a minimum beside the numbers.
struct Open {
    reduced: Reduced,
    system: SharedSystem,
    /// Shared unknowns that follow the numbers.
    others: Vec<usize>,
    n_shared: usize,
    /// Steps of the recordings' own unknowns that rounding leaves at the minimum.
    still: Vec<Own>,
}

impl Open {
    fn at(
        equations: &NormalEquations,
        there: &Unknowns,
        bounds: &[(f64, f64)],
        numbers: &[usize],
    ) -> Option<Self> {
        let reduced = equations.reduced(0.0)?;
        let system = reduced.system();
        let (_, resting) = within(&system, &there.shared, bounds, numbers)?;
        let n_shared = there.shared.len();
        let others = (0..n_shared).filter(|unknown| !resting.contains(unknown)).collect();
        let still = reduced.own_steps(&DVector::zeros(n_shared));
        Some(Self { reduced, system, others, n_shared, still })
    }

    /// A step as one of the model without the numbers.
    fn shift(&self, step: &DVector<f64>, numbers: &[usize]) -> Shift {
        let own = self.reduced.own_steps(step).into_iter().zip(&self.still).map(|(own, still)| own - still);
        let shared = (0..self.n_shared).filter(|unknown| !numbers.contains(unknown)).map(|i| step[i]);
        Shift::by(shared.collect(), own.collect())
    }
}

/// What tracks say of one kind.
struct Kind {
    /// The places of its numbers among the shared unknowns.
    numbers: Vec<usize>,
    profiled: Profiled,
    scatters: Vec<Scatter>,
}

impl Kind {
    /// Steps of its numbers whose squares add up to the mean square, where the odds of all add up to `sum`.
    fn steps(&self, sum: f64) -> impl Iterator<Item = (&Self, DVector<f64>)> {
        let n = self.numbers.len();
        let second = self.scatters.iter().map(|one| &one.second * (one.odds / sum));
        let SymmetricEigen { eigenvalues, eigenvectors } =
            SymmetricEigen::new(second.fold(DMatrix::zeros(n, n), |all, one| all + one));
        (0..n).map(move |k| (self, eigenvectors.column(k) * eigenvalues[k].max(0.0).sqrt()))
    }

    /// A step of its numbers with that of the unknowns that follow them.
    fn followed(&self, open: &Open, step: &DVector<f64>) -> DVector<f64> {
        let mut all = DVector::zeros(open.n_shared);
        let followed = &self.profiled.followed * step;
        let places = self.numbers.iter().zip(step).chain(open.others.iter().zip(&followed));
        places.for_each(|(place, value)| all[*place] = *value);
        all
    }
}

/// A scatter of one width.
struct Scatter {
    /// Against none.
    odds: f64,
    /// The mean square of what it is in each body, and from body to body.
    second: DMatrix<f64>,
}

/// Each width's odds, all beforehand as likely as each other, by the likelihood over a normal distribution of so wide a scatter.
fn scatters(profiled: &Profiled, sigmas: &DVector<f64>, unit: f64) -> Vec<Scatter> {
    // Without the priors, which are those of the widest.
    let told = (&profiled.matrix - DMatrix::from_diagonal(&sigmas.map(|sigma| sigma.powi(-2)))) / unit;
    let side = &profiled.side / unit;
    let scatter = |width: &f64| {
        let prior = sigmas.map(|sigma| (width * sigma).powi(-2));
        let factor: Cholesky<f64, Dyn> = (&told + DMatrix::from_diagonal(&prior)).cholesky()?;
        let mean = factor.solve(&side);
        let ln_determinant = 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
        let ln_likelihood =
            0.5 * (mean.dot(&side) - ln_determinant + prior.iter().map(|x| x.ln()).sum::<f64>());
        let odds =
            ODDS_OF_SCATTER / (KINDS.len() * WIDTHS.len()) as f64 * ln_likelihood.min(LARGEST_LN).exp();
        Some(Scatter { odds, second: &mean * mean.transpose() + factor.inverse() })
    };
    WIDTHS.iter().filter_map(scatter).collect()
}
