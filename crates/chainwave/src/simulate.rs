//! `chainwave simulate`: the motion of a chain from a scene.

mod ring;
mod scan;
mod scene;
mod velocities;

use std::path::Path;
use std::time::Instant;

use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Drive, Simulation, StrikerMotion};
use serde_json::json;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::write_text;
use crate::table::{self, column};
pub(crate) use ring::{is_ring_scene, ring_scene};
use scene::ChainScene;
pub(crate) use velocities::Velocities;

/// Simulates a scene and writes the motion, and a summary where that is asked; or, with several striker velocities, each
/// one's pulse.
pub(crate) fn simulate(arguments: &cli::Simulate) -> Result<Outcome, Error> {
    table::expect_writable(&arguments.out)?;
    if is_ring_scene(&arguments.scene)? {
        return ring::simulate(arguments);
    }
    let scene = ChainScene::read(&arguments.scene)?;
    let (chain, schedule) = (scene.chain(&arguments.scene)?, scene.schedule(&arguments.scene)?);
    if let Some(velocities) = &arguments.scan {
        return scan::scan(&chain, &schedule, &scene.spacing(&arguments.scene)?, velocities, arguments);
    }
    let start = Instant::now();
    let simulation = chainwave_mechanics::simulate(&chain, &schedule)?;
    let wall_s = start.elapsed().as_secs_f64();
    write_motion(&arguments.out, &simulation.trajectory, simulation.striker.as_ref())?;
    if let Some(path) = &arguments.summary {
        write_summary(path, &simulation, wall_s)?;
    }
    Ok(Outcome::default())
}

/// Motion of a scene of the chain model, with another velocity of its striker where one is given.
fn chain_trajectory(path: &Path, striker_velocity_m_per_s: Option<f64>) -> Result<Trajectory, Error> {
    let scene = ChainScene::read(path)?;
    let mut chain = scene.chain(path)?;
    if let (Drive::Striker(striker), Some(velocity_m_per_s)) = (&mut chain.drive, striker_velocity_m_per_s) {
        striker.velocity_m_per_s = velocity_m_per_s;
    }
    Ok(chainwave_mechanics::simulate(&chain, &scene.schedule(path)?)?.trajectory)
}

/// Writes the motion, time by time; body 0 is the striker.
fn write_motion(path: &Path, trajectory: &Trajectory, striker: Option<&StrikerMotion>) -> Result<(), Error> {
    let (mut times, mut bodies, mut x, mut v) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (i, time_s) in trajectory.times_s.iter().enumerate() {
        let mut add = |body: u32, x_m: f64, v_m_per_s: f64| {
            times.push(*time_s);
            bodies.push(body);
            x.push(x_m);
            v.push(v_m_per_s);
        };
        if let Some(striker) = striker {
            add(0, striker.displacement_m[i], striker.velocity_m_per_s[i]);
        }
        for row in 0..trajectory.displacement_m.nrows() {
            let at = (row, i);
            add(row as u32 + 1, trajectory.displacement_m[at], trajectory.velocity_m_per_s[at]);
        }
    }
    table::write(
        path,
        vec![column("t_s", times), column("body", bodies), column("x_m", x), column("v_m_per_s", v)],
    )
}

fn write_summary(path: &Path, simulation: &Simulation, wall_s: f64) -> Result<(), Error> {
    let summary = json!({
        "energy_drift": simulation.energy_drift,
        "psi_max_j": simulation.psi_max_j,
        "steps": simulation.steps,
        "dt_s": simulation.dt_s,
        "method": simulation.method,
        "choice": simulation.choice,
        "error_estimate": simulation.error_estimate,
        "tension_events": simulation.tension_events,
        "contact_switches": simulation.contact_switch_times_s.len(),
        "force_evaluations": simulation.force_evaluations,
        "wall_s": wall_s,
    });
    write_text(path, &format!("{summary:#}\n"))
}
