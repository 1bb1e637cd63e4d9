//! Damping fitted to the tracks of all recordings at once.

mod aligned;
mod bootstrap;
mod departure;
mod directed;
mod discrepancy;
mod family;
mod fitted;
mod hypothesis;
mod model;
mod neighbours;
mod outcome;
mod profile;
mod reached;
mod residuals;
mod resistances;
mod response;
mod rivals;
mod samples;
mod scattered;
mod search;
mod selection;
mod shared_errors;
mod structure;
mod usual_amplitudes;
mod windows;

use chainwave_analysis::Departure;
use chainwave_measurement::Observation;

use crate::damping::{Damping, STARTS};
use crate::error::FitError;
use crate::least_squares::{Minimum, Stop, minimise};
use departure::{scatter_of_bodies_at, softening_at};
use residuals::TrackResiduals;
use search::{LeftByStated, StatedSearch, damping_of, inflation_of};
use selection::{Fit, Told};

pub use aligned::{AlignedMotion, aligned_motion};
pub use bootstrap::OverTrials;
pub use departure::{scatter_of_bodies, scatter_of_bodies_rule, softening, softening_rule};
pub use directed::{ODDS_OF_A_CAUSE, SIGMAS_OF_A_CAUSE, hypothesis_rule};
pub use fitted::{fitted_chain, fitted_motion};
pub use hypothesis::{Hypothesis, UNSTATED_MASS_SCATTER, UNSTATED_STIFFNESS_SCATTER};
pub use model::TrackModel;
pub use outcome::{FittedRecording, TrackFit};
pub use profile::Interval;
pub use reached::{Reached, reached};
pub use rivals::BetweenHypotheses;
pub use scattered::ODDS_OF_SCATTER;
pub use structure::{Structure, structure_rule};
pub use usual_amplitudes::UsualAmplitudes;

/// Fits c_d and c_s to the tracks of all recordings at once.
///
/// Each recording keeps its own striker velocity (with its prior), instant of impact, and place at rest of each body, so
/// nothing has to be averaged before: the model is compared with what the tracker saw, frame by frame, whose errors are
/// independent and stated. The search is Gauss-Newton with Marquardt's damping from several starting points; the recordings'
/// unknowns are eliminated from each step, and a body's place at rest from its residuals. Dampings stay at or above zero.
///
/// `impact_times_s` are first guesses of the recordings' impacts, within about half a pulse. Recordings that end before the wave comes are to
/// be left away ([`reached`]): nothing tells their impact. A c_d that another fit found is where the search begins if none of the usual starts
/// leads to a minimum, as where damping decides how fast a front runs.
///
/// The model's usual errors are taken in where they may be behind what the stated model leaves over, and explain as much. Where the chain may as well be
/// another than stated, both are open.
///
/// # Errors
/// [`FitError`] as its variants say.
pub fn fit_tracks(
    observations: &[Observation],
    impact_times_s: &[f64],
    model: &TrackModel,
    elsewhere_kg_per_s: Option<f64>,
) -> Result<TrackFit, FitError> {
    let exact = TrackModel { usual_errors: Vec::new(), ..model.clone() };
    let stated = StatedSearch::new(observations, impact_times_s, &exact)?;
    let may_be_usual = |left: &LeftByStated| {
        let size = left.structure.size.max((left.reduced_chi_squared - 1.0).max(0.0).sqrt());
        size < LARGEST_USUAL
    };
    let Some(left) = stated.left().filter(may_be_usual).filter(|_| !model.usual_errors.is_empty()) else {
        return stated.fit(elsewhere_kg_per_s);
    };
    let open = stated.with_errors(model).and_then(|open| open.fit(elsewhere_kg_per_s));
    let is_disputed = |open: &TrackFit| left.structure.is_told() || open.usual_amplitudes.are_told();
    let open = match open {
        Ok(open) if open.leaves_noise_alone() && !is_disputed(&open) => return Ok(open),
        open => open.ok(),
    };
    let exact = stated.fit(elsewhere_kg_per_s);
    match (open, exact) {
        (Some(open), Ok(exact)) if open.leaves_noise_alone() => {
            if !exact.rivals(&open) {
                return Ok(open);
            }
            let both = StatedSearch::new(observations, impact_times_s, model);
            let both = both.and_then(|open| open.fit_beyond(&exact)).ok();
            let both = both.filter(|both| both.leaves_noise_alone() && both.tells_more_than(&open));
            Ok(both.unwrap_or_else(|| open.beside(&exact)))
        }
        (Some(open), Ok(exact)) => Ok(if exact.leaves_noise_alone() { exact } else { open }),
        (Some(open), Err(_)) if open.leaves_noise_alone() => Ok(open),
        (_, exact) => exact,
    }
}

/// What the stated model may leave over, in deviations of the noise, where usual errors may be behind it: a camera's geometry moves a body by some
/// thousandths of its way, and noise is some ten-thousandths. What is larger has another cause, and a fit with so much left open goes astray.
const LARGEST_USUAL: f64 = 5.0;

/// The dampings of the model as it is stated, with what noise does to them: [`fit_tracks`] without its other starting points, and without
/// asking whether the model explains the tracks.
///
/// # Errors
/// As [`fit_tracks`].
pub fn stated_damping(
    observations: &[Observation],
    impact_times_s: &[f64],
    model: &TrackModel,
) -> Result<Damping, FitError> {
    let problem = TrackResiduals::new(observations, model, &[])?;
    let minimum = stated_minimum(&problem, impact_times_s)?;
    let (_, covariance) = minimum.solved().map_err(|why| problem.failure(why))?;
    Ok(damping_of(&minimum.at, &covariance, inflation_of(&problem, minimum.chi_squared())))
}

fn stated_minimum(problem: &TrackResiduals<'_>, impact_times_s: &[f64]) -> Result<Minimum, FitError> {
    let start = problem.start(impact_times_s, STARTS[0])?;
    minimise(problem, start, &[], &Stop::STATED).map_err(|why| problem.failure(why))
}

/// What the tests find in tracks that the simplest model describes.
pub(crate) struct NullTest {
    pub(crate) damping: Damping,
    pub(crate) softening: Departure,
    pub(crate) scatter: Departure,
    pub(crate) structure: Structure,
    /// Probability of what the best single hypothesis finds.
    pub(crate) hypothesis_p_value: f64,
}

impl NullTest {
    /// What [`fit_tracks`], [`softening`] and [`scatter_of_bodies`] would find, from the model's own starting values and without intervals.
    pub(crate) fn of(observations: &[Observation], model: &TrackModel) -> Result<Self, FitError> {
        let problem = TrackResiduals::new(observations, model, &[])?;
        let minimum = stated_minimum(&problem, &[])?;
        let (_, covariance) = minimum.solved().map_err(|why| problem.failure(why))?;
        let damping = damping_of(&minimum.at, &covariance, inflation_of(&problem, minimum.chi_squared()));
        let softening = softening_at(observations, (model, &[]), &minimum.at)?;
        let scatter = scatter_of_bodies_at(observations, (model, &[]), &minimum.at)?;
        let mut fit = Fit::at(&problem, minimum, Vec::new())?;
        let hypothesis_p_value = Told::of(observations, &mut fit).least_p_value.unwrap_or(1.0);
        Ok(Self { damping, softening, scatter, structure: fit.structure, hypothesis_p_value })
    }
}
