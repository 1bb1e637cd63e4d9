//! The model that the tracks ask for: as it is stated, and more only where what it leaves over has structure and a hypothesis takes that
//! away, or where it has the shape of a hypothesis.

use chainwave_measurement::Observation;

use super::directed::{Directed, cause_behind_none, directed, hypothesis_rule};
use super::hypothesis::Hypothesis;
use super::model::TrackModel;
use super::residuals::{Residual, TrackResiduals, degrees_of_freedom};
use super::rivals::{FAR_BEHIND, Rival, Rivals, Shift};
use super::scattered::scattered;
use super::structure::{Fitted, Structure};
use crate::damping::N_DAMPINGS;
use crate::error::FitError;
use crate::least_squares::{Minimum, NormalEquations, Stop, Unknowns, least_beside, minimise};
use crate::quantity::Quantity;

/// Hypotheses that are believed at a time.
const MOST: usize = 2;
/// A hypothesis takes away at least this share of the structure's excess to be believed, or to stand beside one that is.
const SHARE: f64 = 0.5;
/// The same of a hypothesis with a number for each body, unless it leaves noise alone: so many numbers take half of anything away.
const WIDE_SHARE: f64 = 0.9;

/// Chi squared, in units of the residuals' variance, that a hypothesis takes away and errors which readings share may feign: what is known of
/// them is their size and how far they reach, and ten standard deviations of one number are what they were seen to make.
const FEIGNED_CHI_SQUARED: f64 = 100.0;

/// A model at its minimum, and what it leaves over.
pub(super) struct Fit {
    /// The model, what is believed beyond the stated one applied.
    pub(super) model: TrackModel,
    /// Quantities without a prior.
    pub(super) asked: Vec<Quantity>,
    /// What is believed beyond the stated model.
    pub(super) beyond: Vec<Hypothesis>,
    pub(super) minimum: Minimum,
    pub(super) residuals: Vec<Residual>,
    pub(super) structure: Structure,
    /// The same of the model as it was stated.
    pub(super) as_stated: Structure,
    /// Probability, by chance, of what single hypotheses find at the model as it was stated.
    pub(super) p_value_as_stated: Option<f64>,
    /// Simulations behind it, those of other hypotheses included.
    pub(super) n_simulations: u64,
}

impl Fit {
    /// A model with quantities asked for, at a minimum.
    pub(super) fn at(
        problem: &TrackResiduals<'_>,
        minimum: Minimum,
        beyond: Vec<Hypothesis>,
    ) -> Result<Self, FitError> {
        let solved = problem.solve(&minimum.at)?;
        let residuals = problem.residuals(&solved, &minimum.at, &minimum.equations.amplitudes());
        let structure = Structure::of(&residuals, fitted(problem, &minimum.equations));
        Ok(Self {
            model: problem.model.clone(),
            asked: problem.asked.to_vec(),
            beyond,
            minimum,
            residuals,
            as_stated: structure.clone(),
            p_value_as_stated: None,
            structure,
            n_simulations: problem.n_simulations(),
        })
    }

    /// A model with a hypothesis at a minimum, in place of a stated one that has none: what that leaves over is told by the same values.
    pub(super) fn in_place_of(
        stated: &TrackResiduals<'_>,
        other: &TrackResiduals<'_>,
        minimum: Minimum,
        hypothesis: Hypothesis,
    ) -> Result<Self, FitError> {
        let (solved, [equations]) = stated.equations_of(&minimum.at, false, [&|_, _, _| true])?;
        let residuals = stated.residuals(&solved, &minimum.at, &equations.amplitudes());
        let as_stated = Structure::of(&residuals, fitted(stated, &equations));
        let fit = Self::at(other, minimum, vec![hypothesis])?;
        let n_simulations = fit.n_simulations + stated.n_simulations();
        Ok(Self { as_stated, n_simulations, ..fit })
    }
}

/// Adds hypotheses to a model while the tracks ask for one: while what it leaves over has structure and one of them takes at least half of
/// that away, or they have the shape of one. And the hypotheses that might as well hold.
pub(super) fn explained(observations: &[Observation], mut fit: Fit) -> (Fit, Rivals) {
    let mut instead = Vec::new();
    let may_be_feigned = !fit.model.reading_errors.is_empty() && fit.beyond.is_empty();
    let (stated, stated_cost) = (fit.minimum.at.clone(), cost(&fit));
    let n_stated = stated.shared.len();
    loop {
        let told = Told::of(observations, &mut fit);
        if fit.beyond.is_empty() {
            fit.p_value_as_stated = told.least_p_value;
        }
        let asks = fit.structure.is_told() || !told.hypotheses.is_empty();
        let found =
            if asks && fit.beyond.len() < MOST { richer(observations, &mut fit, &told) } else { Vec::new() };
        let mut found = found.into_iter();
        let Some((believed, best)) = found.next() else {
            let is_feigned = may_be_feigned && !fit.beyond.is_empty();
            let is_little = (stated_cost - cost(&fit)) / unit(&fit) < FEIGNED_CHI_SQUARED;
            if is_feigned && is_little {
                instead.retain(|rival: &Rival| rival.hypothesis.is_some());
                instead.push(Rival { hypothesis: None, at: stated, behind: 0.0 });
            }
            let scattered = of_scatter(observations, &mut fit);
            return (fit, Rivals { instead, beside: told.undecided, scattered });
        };
        let unit = unit(&best);
        let fall = (fit.minimum.chi_squared() - best.minimum.chi_squared()) / unit;
        let without = Rival {
            hypothesis: None,
            at: first_of(&fit.minimum.at, n_stated),
            behind: -cause_behind_none(believed.quantities().len(), fall),
        };
        let others = found.map(|(hypothesis, other)| Rival {
            hypothesis: Some(hypothesis),
            at: first_of(&other.minimum.at, n_stated),
            behind: (cost(&other) - cost(&best)) / unit,
        });
        instead = std::iter::once(without).chain(others).filter(|rival| rival.behind < FAR_BEHIND).collect();
        let Fit { as_stated, p_value_as_stated, n_simulations, .. } = fit;
        fit = Fit { as_stated, p_value_as_stated, n_simulations, ..best };
    }
}

/// What bodies that are not quite alike may do to a fit that leaves noise alone.
fn of_scatter(observations: &[Observation], fit: &mut Fit) -> Vec<Shift> {
    if fit.structure.is_told() {
        return Vec::new();
    }
    let (shifts, n_simulations) =
        scattered(observations, (&fit.model, &fit.asked), &fit.minimum.at, unit(fit)).unwrap_or_default();
    fit.n_simulations += n_simulations;
    shifts
}

/// Values of a richer model's unknowns without those of the shared ones that stand behind the first `n`.
fn first_of(at: &Unknowns, n: usize) -> Unknowns {
    Unknowns { shared: at.shared.rows(0, n).into_owned(), own: at.own.clone() }
}

/// The share of the structure's excess that a hypothesis has to take away.
fn share_of(hypothesis: Hypothesis) -> f64 {
    if hypothesis.is_wide() { WIDE_SHARE } else { SHARE }
}

/// The fits with one hypothesis more that explain what the tracks ask for, the least cost first.
fn richer(observations: &[Observation], fit: &mut Fit, told: &Told) -> Vec<(Hypothesis, Fit)> {
    let excess = fit.structure.excess();
    let has_structure = fit.structure.is_told();
    let is_tried = |hypothesis: &Hypothesis| match has_structure {
        true => !fit.beyond.contains(hypothesis) && hypothesis.is_open(&fit.model, &fit.asked),
        false => told.hypotheses.contains(hypothesis),
    };
    // Where little structure is told, most of its excess is noise, which no hypothesis takes away: one that is told by itself may leave it.
    let explains = |hypothesis: Hypothesis, other: &Fit| {
        let costs_less = cost(other) < cost(fit);
        let is_told = told.hypotheses.contains(&hypothesis) && !other.structure.is_told();
        let (left, share) = (other.structure.excess(), share_of(hypothesis));
        let leaves_noise = !other.structure.is_told() && left < (1.0 - SHARE) * excess;
        match has_structure {
            true => left < (1.0 - share) * excess || leaves_noise || is_told && costs_less,
            false => costs_less,
        }
    };
    // Most explain nothing, which the first steps towards them show.
    let worth = |hypothesis: Hypothesis| match has_structure {
        true => fit.minimum.chi_squared() - fit.structure.least_fall(&fit.residuals, share_of(hypothesis)),
        false => fit.minimum.chi_squared(),
    };
    let mut n_simulations = 0;
    let mut found: Vec<(Hypothesis, Fit)> = Vec::new();
    for hypothesis in Hypothesis::ALL.into_iter().filter(is_tried) {
        // Where something simple leaves noise alone, what has a number for each body is not asked.
        if hypothesis.is_wide() && found.iter().any(|(_, simple)| !simple.structure.is_told()) {
            continue;
        }
        let (other, n) = freed(observations, fit, hypothesis, worth(hypothesis));
        n_simulations += n;
        if let Ok(other) = other
            && explains(hypothesis, &other)
        {
            found.push((hypothesis, other));
        }
    }
    fit.n_simulations += n_simulations;
    found.sort_by(|a, b| cost(&a.1).total_cmp(&cost(&b.1)));
    found
}

/// What the tracks say of single hypotheses at a fit.
pub(super) struct Told {
    /// Those of whose shape the residuals have more than chance gives.
    pub(super) hypotheses: Vec<Hypothesis>,
    /// All of them, as what might as well hold.
    pub(super) undecided: Vec<Rival>,
    /// The least probability, by chance, of what was found; `None` where none could be tried.
    pub(super) least_p_value: Option<f64>,
}

impl Told {
    /// Nothing where no step can be made.
    pub(super) fn of(observations: &[Observation], fit: &mut Fit) -> Self {
        let (found, n_simulations) =
            directed(observations, (&fit.model, &fit.asked), &fit.minimum.at).unwrap_or_default();
        fit.n_simulations += n_simulations;
        let unit = unit(fit);
        let p_value = |one: &Directed| one.p_value(unit, found.len());
        let is_told = |one: &&Directed| hypothesis_rule().rejects(p_value(one));
        let rival = |one: &Directed| Rival {
            hypothesis: Some(one.hypothesis),
            at: one.at.clone(),
            behind: one.behind(unit),
        };
        Self {
            hypotheses: found.iter().filter(is_told).map(|one| one.hypothesis).collect(),
            undecided: found.iter().map(rival).collect(),
            least_p_value: found.iter().map(p_value).min_by(f64::total_cmp),
        }
    }
}

/// Variance of what a fit leaves over, neighbours' common errors counted.
fn unit(fit: &Fit) -> f64 {
    fit.structure.ratio.max(1.0) * noise_variance(fit)
}

/// The fit with one hypothesis more, from where it is, unless chi squared does not promise to fall to what is worth it; and the simulations
/// behind that.
pub(super) fn freed(
    observations: &[Observation],
    fit: &Fit,
    hypothesis: Hypothesis,
    worth: f64,
) -> (Result<Fit, FitError>, u64) {
    let mut bodies: Vec<usize> = fit.residuals.iter().map(|residual| residual.body).collect();
    bodies.sort_unstable();
    bodies.dedup();
    let model = hypothesis.applied(&fit.model, &fit.asked, &bodies);
    let asked = [fit.asked.as_slice(), hypothesis.quantities()].concat();
    let problem = match TrackResiduals::new(observations, &model, &asked) {
        Ok(problem) => problem,
        Err(error) => return (Err(error), 0),
    };
    let extended = problem.extended(&fit.minimum.at, (fit.model.priors.len(), fit.asked.len()));
    let start = |value: f64| {
        let mut start = extended.clone();
        start.shared.iter_mut().rev().take(hypothesis.quantities().len()).for_each(|one| *one = value);
        start
    };
    // A hypothesis that does not hold may lead anywhere; one that holds is near.
    let stop = Stop { max_rounds: 20, worth, ..Stop::STATED };
    let near = minimise(&problem, start(hypothesis.usual()), &[], &stop);
    let is_in_reach = |value: &f64| near.as_ref().map_or(true, |near| is_in_reach(fit, near, *value));
    let from_afar = hypothesis.far_starts().iter().copied().filter(is_in_reach).map(start);
    let far = least_beside(&problem, from_afar, &[], &stop, near.iter().cloned().collect());
    let best = far.map(|best| best.minimum).or(near).map_err(|why| problem.failure(why));
    let beyond = [fit.beyond.as_slice(), &[hypothesis]].concat();
    let other = best.and_then(|best| Fit::at(&problem, best, beyond));
    (other, problem.n_simulations())
}

/// Whether a value of the last unknown may be where a hypothesis holds that looks otherwise from a minimum near its usual value: were it true,
/// the tracks would leave there about as much as the value is away, in standard errors, or less by as much as the way there bends.
fn is_in_reach(fit: &Fit, near: &Minimum, value: f64) -> bool {
    /// Three times the most that was seen: 67, to every second body twice as heavy.
    const BEND: f64 = 200.0;
    let Ok((_, covariance)) = near.solved::<FitError>() else { return true };
    let last = near.at.shared.len() - 1;
    let away2 = (value - near.at.shared[last]).powi(2) / covariance[(last, last)];
    away2 < BEND * BEND * fit.structure.excess() * noise_variance(fit)
}

/// Chi squared, and for each number that the model may choose the logarithm of how many positions it explains (G. Schwarz, Ann. Statist. 6
/// (1978) 461-464), in units of the residuals' variance: of two models that explain as much the simpler one costs less.
fn cost(fit: &Fit) -> f64 {
    let n_free = (fit.model.priors.len() + fit.asked.len()) as f64;
    fit.minimum.chi_squared() + n_free * (fit.residuals.len() as f64).ln() * noise_variance(fit)
}

/// Variance of the residuals, in units of the stated one.
pub(super) fn noise_variance(fit: &Fit) -> f64 {
    let squares: f64 = fit.residuals.iter().map(|residual| residual.value.powi(2)).sum();
    squares / fit.residuals.len().max(1) as f64
}

/// Cells as long as an eighth of a period of the chain's fastest oscillation, and two frames at least.
fn fitted(problem: &TrackResiduals<'_>, equations: &NormalEquations) -> Fitted {
    const PART: f64 = 8.0;
    let frame_s =
        problem.observations.iter().map(Observation::frame_interval_s).fold(f64::INFINITY, f64::min);
    let period_s = problem.model.chain.linear().map_or(0.0, |linear| linear.band_edge_hz().recip());
    let n_shared = problem.n_shared() as f64 + equations.n_told();
    let n_own = problem.n_residuals.saturating_sub(degrees_of_freedom(problem) + N_DAMPINGS);
    Fitted { n_shared, n_own, cell_s: (period_s / PART).max(2.0 * frame_s) }
}
