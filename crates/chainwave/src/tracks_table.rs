//! Tracks from the tables in which `run` writes them.

use chainwave_experiment::{Error, FollowedBody, RecordingTracks, Table};
use chainwave_measurement::{Estimate, Lost, Position};

/// The tracks of each recording in a table, in its order: the rows of a body follow each other and begin with frame 0.
pub(crate) fn tracks_of(table: &Table) -> Result<Vec<(String, RecordingTracks)>, Error> {
    let (recordings, names) = (table.texts("recording")?, table.texts("name")?);
    let (methods, statuses) = (table.texts("method")?, table.texts("status")?);
    let (times_s, frames) = (table.full_numbers("t_s")?, table.counts("frame")?);
    let [x, sigma_x, y, sigma_y] =
        ["x_px", "sigma_x_px", "y_px", "sigma_y_px"].map(|name| table.numbers(name));
    let (x, sigma_x, y, sigma_y) = (x?, sigma_x?, y?, sigma_y?);
    let (theta, sigma_theta) = (table.numbers("theta_rad")?, table.numbers("sigma_theta_rad")?);
    let (zncc, iterations) = (table.numbers("zncc")?, table.numbers("iterations")?);
    let mut all: Vec<(String, RecordingTracks)> = Vec::new();
    for (row, (recording, name)) in recordings.into_iter().zip(&names).enumerate() {
        if all.last().is_none_or(|(last, _)| *last != recording) {
            all.push((recording, RecordingTracks { times_s: Vec::new(), bodies: Vec::new() }));
        }
        let Some((_, tracks)) = all.last_mut() else { continue };
        if frames[row] == 0 {
            let body = name.parse().map_err(|_| table.cell(row, "name", "the number of a body", name))?;
            tracks.bodies.push(FollowedBody { body, method: methods[row].clone(), positions: Vec::new() });
        }
        if tracks.bodies.len() == 1 {
            tracks.times_s.push(times_s[row]);
        }
        let found = || {
            Some(Position {
                x_px: Estimate::new(x[row]?, sigma_x[row]?),
                y_px: Estimate::new(y[row]?, sigma_y[row]?),
                theta_rad: theta[row].zip(sigma_theta[row]).map(|(value, sigma)| Estimate::new(value, sigma)),
                zncc: zncc[row]?,
                iterations: iterations[row]? as u32,
            })
        };
        let position = match Lost::named(&statuses[row]) {
            Some(lost) => Err(lost),
            None => Ok(found()
                .ok_or_else(|| table.cell(row, "status", "why there is no position", &statuses[row]))?),
        };
        if let Some(body) = tracks.bodies.last_mut() {
            body.positions.push(position);
        }
    }
    Ok(all)
}
