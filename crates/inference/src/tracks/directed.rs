//! Hypotheses held against the tracks one by one, each by one step from a minimum: what the residuals have of its own shape.
//!
//! What is left over as a whole ([`super::structure`]) is blind to what is small everywhere: a friction that most of a damper's work hides is
//! lost among some hundred cells of noise. A test that looks for its shape alone has one degree of freedom (the score test of C. R. Rao, Math.
//! Proc. Camb. Phil. Soc. 44 (1948) 50-57), and as many tests as there are hypotheses share the level (Bonferroni).

use chainwave_analysis::probability::chi_squared_beyond;
use chainwave_analysis::{Rule, SIGNIFICANCE_LEVEL};
use chainwave_measurement::Observation;

use super::hypothesis::Hypothesis;
use super::model::TrackModel;
use super::residuals::TrackResiduals;
use crate::error::FitError;
use crate::least_squares::{LeastSquares, Unknowns, within};
use crate::measured_rates;
use crate::quantity::Quantity;

/// What one step towards a hypothesis would do.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Directed {
    pub(super) hypothesis: Hypothesis,
    /// Numbers that it frees.
    pub(super) n_free: usize,
    /// By how much chi squared would fall.
    pub(super) fall: f64,
    /// Where the unknowns of the model without it would go.
    pub(super) at: Unknowns,
}

/// Every hypothesis that frees quantities and is open to a model, at a minimum of it.
pub(super) fn directed(
    observations: &[Observation],
    (model, asked): (&TrackModel, &[Quantity]),
    at: &Unknowns,
) -> Result<(Vec<Directed>, u64), FitError> {
    let is_tried =
        |hypothesis: &Hypothesis| !hypothesis.quantities().is_empty() && hypothesis.is_open(model, asked);
    let tried: Vec<Hypothesis> = Hypothesis::ALL.into_iter().filter(is_tried).collect();
    let mut all = asked.to_vec();
    for quantity in tried.iter().flat_map(|hypothesis| hypothesis.quantities()) {
        if !all.contains(quantity) {
            all.push(*quantity);
        }
    }
    let problem = TrackResiduals::new(observations, model, &all)?;
    let n_before = at.shared.len();
    let there = problem.extended(at, (model.priors.len(), asked.len()));
    let equations = problem.equations(&there)?;
    let Some(reduced) = equations.reduced(0.0) else { return Ok((Vec::new(), problem.n_simulations())) };
    let system = reduced.system();
    let place = |quantity: &Quantity| {
        all.iter().skip(asked.len()).position(|other| other == quantity).map(|i| n_before + i)
    };
    let of = |hypothesis: Hypothesis| {
        let free: Vec<usize> = hypothesis.quantities().iter().filter_map(place).collect();
        let held: Vec<usize> = (n_before..problem.n_shared()).filter(|i| !free.contains(i)).collect();
        let (step, _) = within(&system, &there.shared, &problem.bounds().shared, &held)?;
        let fall = system.length2(&step);
        let own = at.own.iter().zip(reduced.own_steps(&step)).map(|(own, step)| own + step).collect();
        let moved = Unknowns { shared: &at.shared + step.rows(0, n_before), own };
        Some(Directed { hypothesis, n_free: free.len(), fall, at: problem.bounds().nearest(moved) })
    };
    Ok((tried.into_iter().filter_map(of).collect(), problem.n_simulations()))
}

/// How likely each hypothesis is before the tracks are asked, against the model as stated: there are twelve or so, of which most experiments
/// have none or one.
pub const ODDS_OF_A_CAUSE: f64 = 0.2;
/// How large its quantities may be then, in standard errors: what is much larger is told, what is much smaller does no harm.
pub const SIGMAS_OF_A_CAUSE: f64 = 3.0;

/// Minus twice the logarithm of what a cause that frees so many numbers is worth before the tracks are asked, over what they leave open of these.
pub(super) fn cost_of_a_cause(n_free: usize) -> f64 {
    n_free as f64 * (SIGMAS_OF_A_CAUSE * SIGMAS_OF_A_CAUSE).ln_1p() - 2.0 * ODDS_OF_A_CAUSE.ln()
}

/// Minus twice the logarithm of the odds of a cause that frees so many numbers against the model without it, beside which it lowers chi squared by
/// so many times the variance of what is left over: the ratio of the two likelihoods, over a normal distribution of its quantities.
pub(super) fn cause_behind_none(n_free: usize, fall: f64) -> f64 {
    let width2 = SIGMAS_OF_A_CAUSE * SIGMAS_OF_A_CAUSE;
    cost_of_a_cause(n_free) - width2 / (1.0 + width2) * fall
}

impl Directed {
    /// Minus twice the logarithm of its odds against the model without it, what is left over having the variance `unit`.
    pub(super) fn behind(&self, unit: f64) -> f64 {
        cause_behind_none(self.n_free, self.fall / unit)
    }

    /// Probability of such a fall or a larger one, were there noise alone of variance `unit` and nothing but one of `n` hypotheses to try.
    pub(super) fn p_value(&self, unit: f64, n: usize) -> f64 {
        (n as f64 * chi_squared_beyond(self.fall / unit, self.n_free as f64)).min(1.0)
    }
}

/// The rule by which one hypothesis is told where what is left over as a whole has no structure.
pub fn hypothesis_rule() -> Rule {
    Rule {
        question: "whether the tracks have the shape of something that the chain model does not state",
        text: format!(
            "no unless freeing it lowers chi squared by more than chance does ({} % level, shared by all that are tried)",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: measured_rates::HYPOTHESIS.to_vec(),
    }
}
