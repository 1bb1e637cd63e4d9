//! Tracks as a table.

use chainwave_measurement::{Lost, Position};

use crate::tables::result_table::{ResultTable, column};
use crate::tracking::follow::Followed;
use crate::tracks::RecordingTracks;

/// The rows of a table of tracks: `recording, name, frame, t_s, x_px, y_px, sigma_x_px, sigma_y_px, theta_rad,
/// sigma_theta_rad, zncc, iterations, status, method`.
#[derive(Default)]
pub struct TrackRows {
    recording: Vec<String>,
    name: Vec<String>,
    frame: Vec<u32>,
    t_s: Vec<Option<f64>>,
    x_px: Vec<Option<f64>>,
    y_px: Vec<Option<f64>>,
    sigma_x_px: Vec<Option<f64>>,
    sigma_y_px: Vec<Option<f64>>,
    theta_rad: Vec<Option<f64>>,
    sigma_theta_rad: Vec<Option<f64>>,
    zncc: Vec<Option<f64>>,
    iterations: Vec<Option<u32>>,
    status: Vec<&'static str>,
    method: Vec<String>,
}

/// Columns of a table of tracks with their units (SI; `1` of a pure number, empty of a text) and what they are.
pub const TRACK_COLUMNS: [(&str, &str, &str); 14] = [
    ("recording", "", "File name of the recording"),
    ("name", "", "Number of the body, or name of the point"),
    ("frame", "1", "Number of the frame in the recording, from 0"),
    ("t_s", "s", "Time of the frame after the camera's trigger; none where the recording states no rate"),
    ("x_px", "px", "Column of the subset's centre, to the right; 0 is the centre of the first pixel"),
    ("y_px", "px", "Row of the subset's centre, downwards; 0 is the centre of the first pixel"),
    ("sigma_x_px", "px", "Standard uncertainty of x_px"),
    ("sigma_y_px", "px", "Standard uncertainty of y_px"),
    ("theta_rad", "rad", "Rotation of the subset from its reference"),
    ("sigma_theta_rad", "rad", "Standard uncertainty of theta_rad"),
    ("zncc", "1", "Zero-mean normalised cross-correlation of subset and picture"),
    ("iterations", "1", "Iterations of the match"),
    ("status", "", "ok, or why the position is lost"),
    ("method", "", "Method of the match"),
];

impl TrackRows {
    /// Adds the points of one recording.
    pub fn add_points(&mut self, recording: &str, followed: &Followed) {
        let time_s = |time: &f64| followed.has_rate.then_some(*time);
        let times_s: Vec<_> = followed.times_s.iter().map(time_s).collect();
        for one in &followed.tracks {
            self.add(recording, &one.track.name, &one.method, &times_s, &one.track.positions);
        }
    }

    /// Adds the bodies of one recording.
    pub fn add_bodies(&mut self, recording: &str, tracks: &RecordingTracks) {
        let times_s: Vec<_> = tracks.times_s.iter().copied().map(Some).collect();
        for one in &tracks.bodies {
            self.add(recording, &one.body.to_string(), &one.method, &times_s, &one.positions);
        }
    }

    fn add(
        &mut self,
        recording: &str,
        name: &str,
        method: &str,
        times_s: &[Option<f64>],
        positions: &[Result<Position, Lost>],
    ) {
        for (frame, (position, time_s)) in positions.iter().zip(times_s).enumerate() {
            self.recording.push(recording.to_owned());
            self.name.push(name.to_owned());
            self.frame.push(frame as u32);
            self.t_s.push(*time_s);
            self.add_position(position);
            self.method.push(method.to_owned());
        }
    }

    fn add_position(&mut self, position: &Result<Position, Lost>) {
        let found = position.as_ref().ok();
        self.x_px.push(found.map(|position| position.x_px.value));
        self.y_px.push(found.map(|position| position.y_px.value));
        self.sigma_x_px.push(found.map(|position| position.x_px.sigma));
        self.sigma_y_px.push(found.map(|position| position.y_px.sigma));
        let theta_rad = found.and_then(|position| position.theta_rad);
        self.theta_rad.push(theta_rad.map(|theta| theta.value));
        self.sigma_theta_rad.push(theta_rad.map(|theta| theta.sigma));
        self.zncc.push(found.map(|position| position.zncc));
        self.iterations.push(found.map(|position| position.iterations));
        self.status.push(position.as_ref().err().map_or("ok", |lost| lost.as_str()));
    }

    /// The table.
    pub fn table(self) -> ResultTable {
        let columns = vec![
            column("recording", self.recording),
            column("name", self.name),
            column("frame", self.frame),
            column("t_s", self.t_s),
            column("x_px", self.x_px),
            column("y_px", self.y_px),
            column("sigma_x_px", self.sigma_x_px),
            column("sigma_y_px", self.sigma_y_px),
            column("theta_rad", self.theta_rad),
            column("sigma_theta_rad", self.sigma_theta_rad),
            column("zncc", self.zncc),
            column("iterations", self.iterations),
            column("status", self.status),
            column("method", self.method),
        ];
        ResultTable { columns }
    }
}
