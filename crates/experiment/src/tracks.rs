//! The tracks of one recording: each body's position in every frame, and the same as positions along the chain.

use chainwave_camera::PlaneMap;
use chainwave_measurement::{BodyTrack, Lost, Observation, Position};

use crate::configuration::Trial;

/// Where the bodies of one recording were found.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingTracks {
    /// Time of each frame after the trigger, in seconds.
    pub times_s: Vec<f64>,
    /// The bodies, in the order of their numbers.
    pub bodies: Vec<FollowedBody>,
}

/// One body in every frame of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedBody {
    /// Number of the body, from 1.
    pub body: usize,
    /// The rung of the ladder that it was followed with.
    pub method: String,
    /// One entry for each frame, from frame 0.
    pub positions: Vec<Result<Position, Lost>>,
}

impl RecordingTracks {
    /// The tracks as positions along the chain.
    pub(crate) fn observation(&self, trial: &Trial, map: &PlaneMap) -> Observation {
        let place = |position: &Result<Position, Lost>| {
            position.as_ref().ok().map(|found| map.position_of(found.x_px, found.y_px))
        };
        let of_body = |followed: &FollowedBody| BodyTrack {
            body: followed.body,
            position_m: followed.positions.iter().map(place).collect(),
        };
        Observation {
            recording: trial.recording.clone(),
            view: trial.view,
            trial: trial.trial,
            // A recording in which no body is seen says nothing, not even of time.
            times_s: if self.bodies.is_empty() { Vec::new() } else { self.times_s.clone() },
            bodies: self.bodies.iter().map(of_body).collect(),
        }
    }
}
