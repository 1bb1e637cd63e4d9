//! The tracks of one recording: each body's position in every frame, and the same as positions along the chain.

use chainwave_camera::PlaneMap;
use chainwave_measurement::{BodyTrack, Estimate, Lost, Observation, Position};

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

/// What of a body is observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Coordinate {
    /// Its position along the chain, in metres.
    Along,
    /// Its position across the chain, in metres.
    Across,
    /// Its rotation, in radians.
    Turn,
}

impl Coordinate {
    fn of(self, found: &Position, map: &PlaneMap) -> Option<Estimate> {
        match self {
            Self::Along => Some(map.position_of(found.x_px, found.y_px)),
            Self::Across => Some(map.across_of(found.x_px, found.y_px)),
            Self::Turn => Some(map.turn_of([found.x_px.value, found.y_px.value], found.theta_rad?)),
        }
    }
}

impl RecordingTracks {
    /// A coordinate of the bodies; each line of a picture is exposed `line_time_s` after the one above.
    pub(crate) fn observation_of(
        &self,
        coordinate: Coordinate,
        trial: &Trial,
        map: &PlaneMap,
        line_time_s: f64,
    ) -> Observation {
        let place = |position: &Result<Position, Lost>| {
            position.as_ref().ok().and_then(|found| coordinate.of(found, map))
        };
        let of_body = |followed: &FollowedBody| BodyTrack {
            body: followed.body,
            position_m: followed.positions.iter().map(place).collect(),
        };
        let delay_s = line_time_s * self.row_px().unwrap_or(0.0);
        // A recording in which no body is seen says nothing, not even of time.
        let seen_s: &[f64] = if self.bodies.is_empty() { &[] } else { &self.times_s };
        Observation {
            recording: trial.recording.clone(),
            view: trial.view,
            trial: trial.trial,
            times_s: seen_s.iter().map(|time_s| time_s + delay_s).collect(),
            bodies: self.bodies.iter().map(of_body).collect(),
        }
    }

    /// The row of the picture that the bodies lie on, in the mean of them.
    fn row_px(&self) -> Option<f64> {
        let first_row = |body: &FollowedBody| Some(body.positions.iter().flatten().next()?.y_px.value);
        let rows: Vec<f64> = self.bodies.iter().filter_map(first_row).collect();
        (!rows.is_empty()).then(|| rows.iter().sum::<f64>() / rows.len() as f64)
    }
}
