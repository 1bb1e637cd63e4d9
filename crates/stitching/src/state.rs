//! What is under way while recordings are aligned: their displacements, and each one's drive and trigger offset.

use chainwave_measurement::Observation;

use crate::arrivals::starting_offsets_s;
use crate::body_response::Contribution;
use crate::consistency::check;
use crate::error::StitchingError;
use crate::fitted_body::{FittedBody, FittedTime};
use crate::rest::{Displacement, displacement_from_rest};
use crate::settings::{FirstBody, Settings};
use crate::time_base::common_times;

/// What of the drives' scale, which the readings leave open, is settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Scale {
    /// Nothing: it follows the priors.
    Open,
    /// It is held where it came to be.
    Held,
    /// It is the true one, as the first body's onset has it.
    True,
}

/// The alignment under way.
pub(crate) struct AlignmentState<'a> {
    pub(crate) observations: &'a [Observation],
    pub(crate) settings: &'a Settings,
    pub(crate) displacements: Vec<Vec<Displacement>>,
    pub(crate) times_s: Vec<f64>,
    pub(crate) frame_interval_s: f64,
    pub(crate) drive: Vec<f64>,
    pub(crate) offsets_s: Vec<f64>,
    pub(crate) scale: Scale,
}

impl<'a> AlignmentState<'a> {
    /// The recordings' displacements from rest, with all drives alike, and triggers too unless the motion comes far later in one than in another.
    pub(crate) fn new(
        observations: &'a [Observation],
        settings: &'a Settings,
        frame_interval_s: f64,
    ) -> Result<Self, StitchingError> {
        if observations.iter().all(|observation| observation.bodies.is_empty()) {
            return Err(StitchingError::Empty);
        }
        let mut displacements = Vec::with_capacity(observations.len());
        for observation in observations {
            check(observation, settings.n_bodies, frame_interval_s)?;
            let seen = observation.bodies.iter().filter(|track| track.position_m.iter().any(Option::is_some));
            let of_bodies =
                seen.map(|track| displacement_from_rest(observation, track, settings.rest_until_s));
            displacements.push(of_bodies.collect::<Result<Vec<_>, _>>()?);
        }
        let common_s = common_times(observations, frame_interval_s);
        if common_s.is_empty() {
            return Err(StitchingError::TooShort { n_recordings: observations.len(), frame_interval_s });
        }
        let times_s: Vec<&[f64]> = observations.iter().map(|one| one.times_s.as_slice()).collect();
        // A motion that repeats itself passes a level once a period.
        let offsets_s = match settings.first_body {
            FirstBody::Free => starting_offsets_s(&displacements, &times_s, frame_interval_s),
            FirstBody::Imposed => vec![0.0; observations.len()],
        };
        Ok(Self {
            times_s: common_s,
            frame_interval_s,
            drive: vec![0.0; observations.len()],
            offsets_s,
            scale: Scale::Open,
            observations,
            settings,
            displacements,
        })
    }

    /// Residuals' rms of the chosen contributions over what the trackers' sigma lets expect.
    pub(crate) fn scatter_ratio(&self, of_body: &FittedBody, chosen: impl Fn(&Contribution) -> bool) -> f64 {
        let (mut squares, mut degrees_of_freedom) = (0.0, 0.0);
        for FittedTime { contributions, response } in of_body.times().filter(|at| at.contributions.len() > 2)
        {
            for contribution in contributions.iter().filter(|contribution| chosen(contribution)) {
                let residual = contribution.read.value - response.at(self.drive[contribution.recording]);
                squares += contribution.weight() * contribution.n_shared * residual.powi(2)
                    / contribution.read.noise_gain;
                degrees_of_freedom += 1.0 - response.leverage(contribution, &self.drive);
            }
        }
        if degrees_of_freedom > 1.0 { (squares / degrees_of_freedom).sqrt() } else { 1.0 }
    }
}
