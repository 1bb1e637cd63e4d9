//! The search for a fit to tracks: of the model as it is stated, and with what they ask for beyond it.

use chainwave_measurement::{Estimate, Observation};
use nalgebra::DMatrix;

use super::bootstrap::bootstrap;
use super::discrepancy::{Discrepancy, discrepancy};
use super::hypothesis::Hypothesis;
use super::model::TrackModel;
use super::outcome::{FittedRecording, TrackFit};
use super::profile::interval_95;
use super::residuals::{TrackResiduals, degrees_of_freedom};
use super::rivals::{BetweenHypotheses, Rivals, with_variance};
use super::selection::{Fit, explained, freed};
use super::structure::Structure;
use super::usual_amplitudes::UsualAmplitudes;
use crate::damping::{Damping, N_DAMPINGS, STARTS};
use crate::error::FitError;
use crate::excess;
use crate::least_squares::{Failure, JointCovariance, Minimum, Own, OwnCovariance, Stop, Unknowns, least_of};
use crate::priors::PriorFactors;

/// The search by which [`fit_tracks`](super::fit_tracks) begins: for the dampings of the model as it is stated, from the usual starts.
pub(super) struct StatedSearch<'a> {
    problem: TrackResiduals<'a>,
    impact_times_s: &'a [f64],
    found: Result<StatedFit, Failure<FitError>>,
    /// Simulations of the search from whose end it began.
    n_simulations_before: u64,
}

/// The stated model at its minimum, and how many of the starts end there.
struct StatedFit {
    fit: Fit,
    n_same: usize,
}

/// What the model as it is stated leaves over at its best.
#[derive(Debug, Clone)]
pub(super) struct LeftByStated {
    /// Structure of the residuals.
    pub(super) structure: Structure,
    /// Sum of squared residuals over their number less the unknowns.
    pub(super) reduced_chi_squared: f64,
}

impl<'a> StatedSearch<'a> {
    /// Searches.
    ///
    /// # Errors
    /// Where the model and the observations do not fit together; a search that finds no minimum is told by [`StatedSearch::fit`].
    pub(super) fn new(
        observations: &'a [Observation],
        impact_times_s: &'a [f64],
        model: &'a TrackModel,
    ) -> Result<Self, FitError> {
        let problem = TrackResiduals::new(observations, model, &[])?;
        let found = stated_fit(&problem, problem.starts(impact_times_s)?);
        Ok(Self { problem, impact_times_s, found, n_simulations_before: 0 })
    }

    /// The search for the same model with more errors that readings share ([`TrackModel::usual_errors`]). Of known size as they are, they move a minimum
    /// by little: where all of the starts led to one minimum it goes on from there, and else, or where none is near, from the usual starts.
    ///
    /// # Errors
    /// As for [`StatedSearch::new`].
    pub(super) fn with_errors<'b>(&self, model: &'b TrackModel) -> Result<StatedSearch<'b>, FitError>
    where
        'a: 'b,
    {
        let Self { problem: TrackResiduals { observations, .. }, impact_times_s, .. } = *self;
        let problem = TrackResiduals::new(observations, model, &[])?;
        let agreed = self.found.as_ref().ok().filter(|found| found.n_same == STARTS.len());
        let near = agreed.and_then(|found| {
            let near = stated_fit(&problem, vec![found.fit.minimum.at.clone()]).ok()?;
            Some(StatedFit { n_same: found.n_same, ..near })
        });
        let found = match near {
            Some(near) => Ok(near),
            None => stated_fit(&problem, problem.starts(impact_times_s)?),
        };
        let n_simulations_before = self.problem.n_simulations();
        Ok(StatedSearch { problem, impact_times_s, found, n_simulations_before })
    }

    /// What is left over at the minimum, where one was found.
    pub(super) fn left(&self) -> Option<LeftByStated> {
        let StatedFit { fit, .. } = self.found.as_ref().ok()?;
        let degrees_of_freedom = degrees_of_freedom(&self.problem);
        Some(LeftByStated {
            structure: fit.structure.clone(),
            reduced_chi_squared: excess::reduced_chi_squared(fit.minimum.chi_squared(), degrees_of_freedom),
        })
    }

    /// The fit, with what the tracks ask for beyond the stated model: [`fit_tracks`](super::fit_tracks).
    ///
    /// # Errors
    /// As [`fit_tracks`](super::fit_tracks).
    pub(super) fn fit(self, elsewhere_kg_per_s: Option<f64>) -> Result<TrackFit, FitError> {
        let Self { problem, impact_times_s, found, n_simulations_before } = self;
        let observations = problem.observations;
        let best = match (found, elsewhere_kg_per_s) {
            (Err(Failure::Unsettled { .. }), Some(c_d_kg_per_s)) if c_d_kg_per_s > 0.0 => {
                stated_fit(&problem, vec![problem.start_at_c_d(impact_times_s, c_d_kg_per_s)?])
            }
            (usual, _) => usual,
        };
        let (stated, (fit, rivals), n_same) = match best {
            Ok(StatedFit { fit: as_stated, n_same }) => {
                let (_, covariance) = as_stated.minimum.solved().map_err(|why| problem.failure(why))?;
                let worth = as_stated.minimum.chi_squared();
                let stated = damping_of(&as_stated.minimum.at, &covariance, inflation_of(&problem, worth));
                let is_lost = as_stated.structure.is_told() && as_stated.structure.size > 1.0;
                match is_lost.then(|| with_the_other_end(&problem, impact_times_s, worth)).flatten() {
                    Some((other, n_same)) => (Some(stated), explained(observations, other), n_same),
                    None => (Some(stated), explained(observations, as_stated), n_same),
                }
            }
            Err(why) => {
                let other = Some(&why).filter(|why| matches!(why, Failure::Unsettled { .. }));
                let other = other.and_then(|_| with_the_other_end(&problem, impact_times_s, f64::INFINITY));
                let (other, n_same) = other.ok_or_else(|| problem.failure(why))?;
                (None, explained(observations, other), n_same)
            }
        };
        let found = finish(observations, (&fit, &rivals), (stated, n_same))?;
        Ok(TrackFit { n_simulations: found.n_simulations + n_simulations_before, ..found })
    }
}

impl StatedSearch<'_> {
    /// The fit of a model with usual errors, and with what another fit, to the same tracks without these, found beyond the stated model: where both may
    /// be behind what that leaves over, neither is to be taken for all of it.
    ///
    /// # Errors
    /// As [`fit_tracks`](super::fit_tracks).
    pub(super) fn fit_beyond(self, without: &TrackFit) -> Result<TrackFit, FitError> {
        let Self { problem, found, .. } = self;
        let observations = problem.observations;
        let StatedFit { mut fit, n_same } = found.map_err(|why| problem.failure(why))?;
        let (_, covariance) = fit.minimum.solved().map_err(|why| problem.failure(why))?;
        let inflation = inflation_of(&problem, fit.minimum.chi_squared());
        let stated = damping_of(&fit.minimum.at, &covariance, inflation);
        for hypothesis in &without.beyond {
            let (freed, n) = freed(observations, &fit, *hypothesis, f64::INFINITY);
            let n_simulations = fit.n_simulations + n;
            fit = Fit { n_simulations, ..freed? };
        }
        let (as_stated, p_value_as_stated) = (without.as_stated.clone(), without.p_value_as_stated);
        let (fit, rivals) = explained(observations, Fit { as_stated, p_value_as_stated, ..fit });
        finish(observations, (&fit, &rivals), (Some(stated), n_same))
    }
}

/// The least minimum of the stated model from some starts.
fn stated_fit(problem: &TrackResiduals<'_>, starts: Vec<Unknowns>) -> Result<StatedFit, Failure<FitError>> {
    let best = least_of(problem, starts, &[], &Stop::STATED)?;
    let fit = Fit::at(problem, best.minimum, Vec::new()).map_err(Failure::Problem)?;
    Ok(StatedFit { fit, n_same: best.n_same })
}

/// The fit of the chain whose far end is held in place of free, or free in place of held, where it leaves noise alone: a wave that comes back
/// otherwise than the stated one would leads a search for the dampings nowhere, or so far off that no step leads from there to where the other
/// end explains all, so that this search begins where the first one did. And how many of the starts end there. A search that does not promise to
/// come below a sum of squares that is `worth` it is given up.
fn with_the_other_end(
    problem: &TrackResiduals<'_>,
    impact_times_s: &[f64],
    worth: f64,
) -> Option<(Fit, usize)> {
    let TrackResiduals { observations, model, .. } = *problem;
    let hypothesis = Hypothesis::OtherEnd;
    if !hypothesis.is_open(model, &[]) {
        return None;
    }
    let model = &hypothesis.applied(model, &[], &[]);
    let other = TrackResiduals::new(observations, model, &[]).ok()?;
    let stop = Stop { max_rounds: 20, worth, ..Stop::STATED };
    let best = least_of(&other, other.starts(impact_times_s).ok()?, &[], &stop).ok()?;
    let fit = Fit::in_place_of(problem, &other, best.minimum, hypothesis).ok()?;
    (!fit.structure.is_told()).then_some((fit, best.n_same))
}

/// The estimates and their uncertainties at a minimum: what noise makes of them, what the structure that is left may do, and what other
/// hypotheses that explain as much would say.
fn finish(
    observations: &[Observation],
    (fit, rivals): (&Fit, &Rivals),
    (stated, n_same): (Option<Damping>, usize),
) -> Result<TrackFit, FitError> {
    let problem = &TrackResiduals::new(observations, &fit.model, &fit.asked)?;
    let minimum = &fit.minimum;
    let Minimum { at, equations, .. } = minimum;
    let (reduced, covariance) = minimum.solved().map_err(|why: Failure<FitError>| problem.failure(why))?;
    let errors = OwnCovariance::of(&reduced, &covariance);
    let chi_squared = minimum.chi_squared();
    let reduced_chi_squared = excess::reduced_chi_squared(chi_squared, degrees_of_freedom(problem));
    let inflation = excess::inflation(reduced_chi_squared);
    let estimate = |value: f64, variance: f64| Estimate::new(value, inflation * variance.sqrt());
    let of_shared = |i: usize| estimate(at.shared[i], covariance[(i, i)]);
    let mean = at.own.iter().sum::<Own>() / at.own.len() as f64;
    let of_mean = |k: usize| estimate(mean[k], errors.of_mean[(k, k)]);
    let by_noise = damping_of(at, &covariance, inflation);
    let missed = match fit.structure.is_noise_alone() {
        true => Discrepancy::default(),
        false => discrepancy(problem, minimum, &fit.residuals, inflation * inflation)?,
    };
    let between = rivals.about(at);
    let more: [f64; N_DAMPINGS] = std::array::from_fn(|i| missed.of_dampings[i] + between.of_shared(i));
    let damping = by_noise.widened(more);
    let wider = damping.sigmas_over(&by_noise);
    let interval = |i: usize| {
        let moves = covariance.column(i) / covariance[(i, i)];
        let interval = interval_95(problem, minimum, (i, &moves), of_shared(i), inflation);
        interval.widened(at.shared[i], wider[i])
    };
    let intervals_95 = [interval(0), interval(1)];
    let asked = fit.asked.iter().zip(N_DAMPINGS + fit.model.priors.len()..);
    let recording = |(r, own): (usize, &Own)| {
        let (of_own, about_mean) = (errors.of_each[r], errors.about_mean[r]);
        let (squares, degrees_of_freedom) = problem.of_recording(r, equations, at);
        FittedRecording {
            recording: problem.observations[r].recording.clone(),
            striker_velocity_m_per_s: estimate(own[0], of_own[(0, 0)]),
            impact_time_s: estimate(own[1], of_own[(1, 1)]),
            drive_deviation: estimate(own[0] - mean[0], about_mean[(0, 0)]).scaled(mean[0].recip()),
            trigger_offset_s: estimate(own[1] - mean[1], about_mean[(1, 1)]),
            scatter_ratio: (squares / degrees_of_freedom.max(1.0)).sqrt(),
        }
    };
    let factor = |i: usize| with_variance(of_shared(i), between.of_shared(i));
    let fit = TrackFit {
        damping,
        by_noise,
        stated,
        intervals_95,
        bootstrap: bootstrap(problem.observations, &reduced, &covariance)
            .map(|found| std::array::from_fn(|i| found[i].widened(more[i]))),
        starts: (n_same, STARTS.len()),
        factors: PriorFactors::new(&fit.model.priors, N_DAMPINGS).found(factor),
        beyond: fit.beyond.clone(),
        found: asked.map(|(quantity, i)| (*quantity, of_shared(i))).collect(),
        rivals: rivals.instead.iter().filter_map(|rival| rival.hypothesis).collect(),
        between: BetweenHypotheses::default(),
        as_stated: fit.as_stated.clone(),
        p_value_as_stated: fit.p_value_as_stated,
        structure: fit.structure.clone(),
        model: fit.model.clone(),
        errors: JointCovariance::of(&reduced, &covariance),
        usual_amplitudes: UsualAmplitudes::of(problem, equations, (&reduced, &covariance)),
        striker_velocity_m_per_s: of_mean(0),
        impact_time_s: of_mean(1),
        recordings: at.own.iter().enumerate().map(recording).collect(),
        chi_squared,
        reduced_chi_squared,
        n_residuals: problem.n_residuals,
        n_simulations: fit.n_simulations + problem.n_simulations(),
    };
    Ok(fit.among(between.and(missed.of_recordings)))
}

pub(super) fn damping_of(at: &Unknowns, covariance: &DMatrix<f64>, inflation: f64) -> Damping {
    let of_shared = |i: usize| Estimate::new(at.shared[i], inflation * covariance[(i, i)].sqrt());
    Damping {
        chain_damping_kg_per_s: of_shared(0),
        striker_damping_kg_per_s: of_shared(1),
        correlation: covariance[(0, 1)] / (covariance[(0, 0)] * covariance[(1, 1)]).sqrt(),
    }
}

/// What a sum of squares does to standard uncertainties.
pub(super) fn inflation_of(problem: &TrackResiduals<'_>, chi_squared: f64) -> f64 {
    excess::inflation(excess::reduced_chi_squared(chi_squared, degrees_of_freedom(problem)))
}
