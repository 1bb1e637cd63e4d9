//! `chainwave simulate`: the motion of a chain from a scene.

mod ring;
mod scan;

use std::path::Path;
use std::time::Instant;

use chainwave_experiment::{ChainScene, SimulationSummary, read_text, simulated_table};
use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Drive, Simulation};
use serde_json::json;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::{expect_apart, expect_folder_of, write_text};
use crate::table::{self, column};
use crate::terminal::say;
pub(crate) use ring::{is_ring_scene, ring_scene};

/// Simulates a scene and writes the motion, and a summary where that is asked; or, with several striker velocities, each
/// one's pulse.
pub(crate) fn simulate(arguments: &cli::Simulate) -> Result<Outcome, Error> {
    table::expect_writable(&arguments.out)?;
    arguments.summary.iter().try_for_each(|path| expect_folder_of(path))?;
    let summary = arguments.summary.iter().map(|path| ("the summary", path.clone()));
    let written: Vec<_> = [("the table", arguments.out.clone())].into_iter().chain(summary).collect();
    expect_apart(&[&arguments.scene], &written)?;
    // Once, for it may be a pipe.
    let text = read_text(&arguments.scene)?;
    if ring::is_of_rings(&text) {
        return ring::simulate(arguments, &text);
    }
    let scene = ChainScene::parse(&arguments.scene, &text)?;
    if scene.asks_for_bands() && arguments.scan.is_none() {
        return bands(&scene, arguments);
    }
    let (chain, schedule) = (scene.chain(&arguments.scene, &table::read)?, scene.schedule(&arguments.scene)?);
    if let Some(velocities) = &arguments.scan {
        return scan::scan(&chain, &schedule, &scene.spacing(&arguments.scene)?, velocities, arguments);
    }
    let start = Instant::now();
    let simulation = chainwave_mechanics::simulate(&chain, &schedule)?;
    let wall_s = start.elapsed().as_secs_f64();
    let (striker, far_striker) = (simulation.striker.as_ref(), simulation.far_striker.as_ref());
    note_lost_energy(&arguments.scene, simulation.energy_drift);
    let motion = simulated_table(&simulation.trajectory, striker, far_striker);
    table::write_result(&arguments.out, motion)?;
    if let Some(path) = &arguments.summary {
        write_summary(path, &simulation, wall_s)?;
    }
    say!(
        "wrote {}: {} bodies at {} times; {} steps by {}, energy drift {:.1e}",
        arguments.out.display(),
        simulation.trajectory.displacement_m.nrows(),
        simulation.trajectory.times_s.len(),
        simulation.steps,
        simulation.method,
        simulation.energy_drift
    );
    Ok(Outcome::default())
}

/// Relative energy that a motion may lose or gain by its steps before that is said.
const ENERGY_DRIFT: f64 = 0.01;

/// Says where the energy that steps lost or made is no small part of the motion's.
fn note_lost_energy(scene: &Path, energy_drift: f64) {
    if energy_drift > ENERGY_DRIFT {
        Outcome::note(format!(
            "{}: the steps lose or gain {:.0} % of the energy: the motion is not to be trusted (hint: a smaller \
             integrator.dt_s)",
            scene.display(),
            100.0 * energy_drift
        ));
    }
}

/// Writes the bands of a chain.
fn bands(scene: &ChainScene, arguments: &cli::Simulate) -> Result<Outcome, Error> {
    let start = Instant::now();
    let points = scene.bands(&arguments.scene, &table::read)?;
    let columns = vec![
        column("kappa_a", points.iter().map(|point| point.kappa_a).collect::<Vec<_>>()),
        column("band", points.iter().map(|point| point.band).collect::<Vec<_>>()),
        column("frequency_hz", points.iter().map(|point| point.frequency_hz).collect::<Vec<_>>()),
    ];
    table::write(&arguments.out, columns)?;
    if let Some(path) = &arguments.summary {
        let summary = json!({ "method": "bands", "wall_s": start.elapsed().as_secs_f64() });
        write_text(path, &format!("{summary:#}\n"))?;
    }
    say!("wrote {}: {} points of bands", arguments.out.display(), points.len());
    Ok(Outcome::default())
}

/// Motion of a scene of the chain model, with another velocity of its striker where one is given.
fn chain_trajectory(path: &Path, striker_velocity_m_per_s: Option<f64>) -> Result<Trajectory, Error> {
    let scene = read_scene(path)?;
    let mut chain = scene.chain(path, &table::read)?;
    if let (Drive::Striker(striker), Some(velocity_m_per_s)) = (&mut chain.drive, striker_velocity_m_per_s) {
        striker.velocity_m_per_s = velocity_m_per_s;
    }
    Ok(chainwave_mechanics::simulate(&chain, &scene.schedule(path)?)?.trajectory)
}

/// Reads a scene; an error points at the line.
fn read_scene(path: &Path) -> Result<ChainScene, Error> {
    Ok(ChainScene::parse(path, &read_text(path)?)?)
}

fn write_summary(path: &Path, simulation: &Simulation, wall_s: f64) -> Result<(), Error> {
    let summary = json!(SimulationSummary::of(simulation, wall_s));
    write_text(path, &format!("{summary:#}\n"))
}
