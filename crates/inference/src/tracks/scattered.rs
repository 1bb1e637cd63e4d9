//! What bodies that are not quite alike may do to a fit before it is told.
//!
//! Masses, stiffnesses and dampings always scatter by a little. Where the model states them as alike, a scatter too small to leave structure bends
//! c_s and the strikers all the same. How large it is may be anything, and what it would be in each body the tracks tell in part: the mean over
//! both of what it makes of the unknowns joins their uncertainties.

use chainwave_measurement::Observation;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use super::hypothesis::Hypothesis;
use super::model::TrackModel;
use super::residuals::TrackResiduals;
use super::rivals::Shift;
use crate::damping::N_DAMPINGS;
use crate::error::FitError;
use crate::least_squares::{LeastSquares, Profiled, Unknowns, within};
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

/// What a scatter of which nothing is told makes of the unknowns of a fit, whose residuals have the variance `unit`; and the simulations behind that.
pub(super) fn scattered(
    observations: &[Observation],
    (model, asked): (&TrackModel, &[Quantity]),
    at: &Unknowns,
    unit: f64,
) -> Result<(Vec<Shift>, u64), FitError> {
    let mut bodies: Vec<usize> =
        observations.iter().flat_map(|one| one.bodies.iter().map(|track| track.body)).collect();
    bodies.sort_unstable();
    bodies.dedup();
    let mut wide = model.clone();
    let mut kinds: Vec<Vec<usize>> = Vec::new();
    for kind in KINDS {
        if !kind.is_open(model, asked) {
            continue;
        }
        let first = wide.priors.len();
        wide = kind.applied_with_at_most(MOST_NUMBERS, &wide, asked, &bodies);
        kinds.push((N_DAMPINGS + first..N_DAMPINGS + wide.priors.len()).collect());
    }
    if kinds.is_empty() {
        return Ok((Vec::new(), 0));
    }
    let problem = TrackResiduals::new(observations, &wide, asked)?;
    let there = problem.extended(at, (model.priors.len(), asked.len()));
    let equations = problem.equations(&there)?;
    let Some(reduced) = equations.reduced(0.0) else { return Ok((Vec::new(), problem.n_simulations())) };
    let system = reduced.system();
    let numbers: Vec<usize> = kinds.iter().flatten().copied().collect();
    let Some((_, resting)) = within(&system, &there.shared, &problem.bounds().shared, &numbers) else {
        return Ok((Vec::new(), problem.n_simulations()));
    };
    let others: Vec<usize> = (0..there.shared.len()).filter(|i| !resting.contains(i)).collect();
    let found: Vec<(Vec<usize>, Profiled, Vec<Scatter>)> = kinds
        .into_iter()
        .filter_map(|of| {
            let profiled = system.profiled(&of, &others)?;
            let sigmas = of.iter().map(|i| wide.priors[i - N_DAMPINGS].relative_sigma);
            let scatters = scatters(&profiled, &DVector::from_iterator(of.len(), sigmas), unit);
            Some((of, profiled, scatters))
        })
        .collect();
    let sum = 1.0 + found.iter().flat_map(|(_, _, all)| all).map(|one| one.odds).sum::<f64>();
    let still = reduced.own_steps(&DVector::zeros(there.shared.len()));
    let mut shifts = Vec::new();
    for (of, profiled, scatters) in found {
        let n = of.len();
        let second =
            scatters.iter().fold(DMatrix::zeros(n, n), |second, one| second + &one.second * (one.odds / sum));
        let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(second);
        for (value, vector) in eigenvalues.iter().zip(eigenvectors.column_iter()) {
            let of_numbers = vector * value.max(0.0).sqrt();
            let mut step = DVector::zeros(there.shared.len());
            of.iter().zip(of_numbers.iter()).for_each(|(i, number)| step[*i] = *number);
            let followed = &profiled.followed * &of_numbers;
            others.iter().zip(followed.iter()).for_each(|(i, other)| step[*i] = *other);
            let own = reduced.own_steps(&step).iter().zip(&still).map(|(own, still)| own - still).collect();
            let shared = (0..step.len()).filter(|i| !numbers.contains(i)).map(|i| step[i]).collect();
            shifts.push(Shift::by(shared, own));
        }
    }
    Ok((shifts, problem.n_simulations()))
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
        let odds = ODDS_OF_SCATTER / (KINDS.len() * WIDTHS.len()) as f64 * ln_likelihood.exp();
        Some(Scatter { odds, second: &mean * mean.transpose() + factor.inverse() })
    };
    WIDTHS.iter().filter_map(scatter).collect()
}
