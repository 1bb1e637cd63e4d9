//! Which recordings see the wave.

use chainwave_measurement::Observation;

use super::model::TrackModel;
use super::residuals::TrackResiduals;
use crate::damping::STARTS;
use crate::error::FitError;

/// The recordings that a wave reaches, and when.
#[derive(Debug, Clone, PartialEq)]
pub struct Reached {
    /// The recordings.
    pub observations: Vec<Observation>,
    /// The guess of each one's impact, in seconds.
    pub impact_times_s: Vec<f64>,
}

/// Those recordings that a wave of the stated chain reaches while they are filmed, so that they tell when it began, with the guesses of their
/// impacts: to less than a quarter of a period of the chain's fastest oscillation, as far as a search can follow a straight line. Others say nothing of the chain
/// but that it rests.
///
/// `impact_times_s` are first guesses of the recordings' impacts, in seconds.
///
/// # Errors
/// As [`fit_tracks`](super::fit_tracks).
pub fn reached(
    observations: &[Observation],
    impact_times_s: &[f64],
    model: &TrackModel,
) -> Result<Reached, FitError> {
    let problem = TrackResiduals::new(observations, model, &[])?;
    let start = problem.start(impact_times_s, STARTS[0])?;
    let (_, [equations]) = problem.equations_of(&start, false, [&|_, _, _| true])?;
    let quarter_s = model.chain.linear().map_or(f64::INFINITY, |linear| 0.25 / linear.band_edge_hz());
    let tells = |(r, _): &(usize, &Observation)| {
        let covariance = equations.own_covariance(*r);
        covariance.is_some_and(|covariance| covariance[(1, 1)].sqrt() < quarter_s)
    };
    let with_impact = |(r, observation): (usize, &Observation)| (observation.clone(), start.own[r][1]);
    let (observations, impact_times_s) =
        observations.iter().enumerate().filter(tells).map(with_impact).unzip();
    Ok(Reached { observations, impact_times_s })
}
