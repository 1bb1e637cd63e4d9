//! Scenes of rings: their motion, their compression, their modes and bands.

mod figures;
mod scene;
mod tables;

use std::path::Path;
use std::time::Instant;

use chainwave_experiment::{read_text, simulated_table};
use chainwave_mechanics::{
    RefinedSimulation, RingChain, RingDrive, RingSchedule, RingSimulation, RingStriker, SelfContact,
    compress, ring_modes, ring_sound_speed_m_per_s, simulate_rings, simulate_rings_within,
};
use serde::Deserialize;
use serde_json::json;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::write_text;
use crate::table;
use crate::terminal::say;

use super::note_lost_energy;
use figures::{FiguresTable, VelocityRow, wave_of};
use scene::{Mesh, RingScene, Task};

/// Elements per ring of quasi-static and linear tasks where none are stated: frequencies and forces are then good to 1e-4.
const FINE: usize = 64;

/// Whether the scene in a file is one of rings; what else is in it is not looked at.
pub(crate) fn is_ring_scene(path: &Path) -> Result<bool, Error> {
    Ok(is_of_rings(&read_text(path)?))
}

/// Whether the text of a scene is one of rings.
pub(super) fn is_of_rings(text: &str) -> bool {
    #[derive(Deserialize)]
    struct Model {
        model: Option<String>,
    }
    let model: Result<Model, _> = toml::from_str(text);
    model.is_ok_and(|scene| scene.model.as_deref() == Some("ring"))
}

/// The chain and the schedule of a scene of rings that move; the elements are the scene's, or none where it asks for an accuracy.
pub(crate) fn ring_scene(path: &Path) -> Result<(RingChain, RingSchedule), Error> {
    let scene = RingScene::parse(path, &read_text(path)?)?;
    Ok((scene.chain(path)?, scene.schedule(path, None)?))
}

/// Carries out a scene of rings, given its text.
pub(super) fn simulate(arguments: &cli::Simulate, text: &str) -> Result<Outcome, Error> {
    let scene = RingScene::parse(&arguments.scene, text)?;
    if arguments.scan.is_some() {
        let message = "--scan: expected a scene of the chain model, found one of rings (hint: list their velocities as \
                       figures.striker_velocities_m_per_s)";
        return Err(Error::configuration(&arguments.scene, message.into()));
    }
    let start = Instant::now();
    let mut outcome = Outcome::default();
    let summary = match scene.task(&arguments.scene)? {
        Task::Motion => motion(arguments, &scene, &mut outcome)?,
        Task::Compression { max_overlap_m, n_steps } => {
            let ring = scene.ring.ring();
            let elements = scene.ring.elements_or(FINE, &arguments.scene)?;
            let curve = compress(&ring, ring.section(), elements, max_overlap_m, n_steps)?;
            tables::write_curve(&arguments.out, &curve)?;
            json!({
                "method": "static",
                "elements_per_ring": elements,
                "self_contact_m": curve.self_contact_m,
                "neighbour_contact_m": curve.neighbour_contact_m,
            })
        }
        Task::Modes { n_modes } => {
            let elements = scene.ring.elements_or(FINE, &arguments.scene)?;
            let modes = ring_modes(&scene.ring.ring(), elements, n_modes)?;
            tables::write_modes(&arguments.out, &modes)?;
            json!({
                "method": "modes",
                "elements_per_ring": elements,
                "local_resonance_hz": tables::local_resonance_hz(&modes),
            })
        }
        Task::Bands(bands) => {
            let elements = scene.ring.elements_or(FINE, &arguments.scene)?;
            tables::write_bands(&arguments.out, &scene.ring.ring(), elements, &bands)?;
            json!({ "method": "bands", "elements_per_ring": elements })
        }
    };
    if let Some(path) = &arguments.summary {
        let mut summary = summary;
        summary["wall_s"] = start.elapsed().as_secs_f64().into();
        write_text(path, &format!("{summary:#}\n"))?;
    }
    say!("wrote {}", arguments.out.display());
    Ok(outcome)
}

/// Integrates the motion, writes it, and returns the summary. A motion that walls in contact end is a failure of what is missing.
fn motion(
    arguments: &cli::Simulate,
    scene: &RingScene,
    outcome: &mut Outcome,
) -> Result<serde_json::Value, Error> {
    let (mut chain, schedule) =
        (scene.chain(&arguments.scene)?, scene.schedule(&arguments.scene, arguments.jobs)?);
    // What the figures need is looked for before minutes are spent on the motion.
    let figures =
        scene.figures.as_ref().map(|asked| Ok::<_, Error>((asked, scene.pitch_m(&arguments.scene)?)));
    let figures = figures.transpose()?;
    let (simulation, elements, difference) = match scene.mesh(&arguments.scene)? {
        Mesh::Elements(elements) => {
            if scene.states_accuracy_beside_elements() {
                Outcome::note(format!(
                    "{}: integrator.accuracy is not used beside ring.elements_per_ring: the elements and the stable step set the \
                     accuracy (hint: leave elements_per_ring out, and both are chosen for it)",
                    arguments.scene.display()
                ));
            }
            (simulate_rings(&chain, &schedule)?, elements, None)
        }
        Mesh::Accuracy(accuracy) => {
            let RefinedSimulation { simulation, elements_per_ring, difference } =
                simulate_rings_within(&chain, &schedule, accuracy)?;
            (simulation, elements_per_ring, Some(difference))
        }
    };
    chain.elements_per_ring = elements;
    note_lost_energy(&arguments.scene, simulation.energy_drift);
    if let Some(SelfContact { ring, time_s }) = simulation.self_contact {
        outcome.fail(format!(
            "{}: expected walls that stay apart, found those of ring {ring} in contact at t = {time_s:.3e} s, where the model \
             ends: the motion goes to the last output before it (a slower striker, or a shorter duration_s)",
            arguments.scene.display()
        ));
    }
    // Body 0 is the striker, body n the joint where ring n begins.
    let moved = simulated_table(&simulation.trajectory, simulation.striker.as_ref(), None);
    table::write_result(&arguments.out, moved)?;
    if let Some(file) = &scene.shapes_file {
        tables::write_shapes(&arguments.out.with_file_name(file), &simulation)?;
    }
    if let Some((asked, pitch_m)) = figures {
        draw(arguments, scene, (asked, pitch_m), &chain, &simulation)?;
    }
    Ok(summary(&simulation, elements, difference))
}

/// Draws what the scene asks for, with the chain model beside the rings.
fn draw(
    arguments: &cli::Simulate,
    scene: &RingScene,
    (asked, pitch_m): (&FiguresTable, f64),
    rings: &RingChain,
    simulation: &RingSimulation,
) -> Result<(), Error> {
    let folder = arguments.out.with_file_name(&asked.folder);
    let chain_of = |velocity_m_per_s: Option<f64>| match &asked.chain {
        Some(file) => {
            let trajectory =
                super::chain_trajectory(&arguments.scene.with_file_name(file), velocity_m_per_s)?;
            wave_of("chain model", &trajectory, pitch_m).map(Some)
        }
        None => Ok(None),
    };
    let measured = wave_of("rings", &simulation.trajectory, pitch_m)?;
    figures::draw(&folder, asked, &measured, chain_of(None)?.as_ref(), pitch_m)?;
    let RingDrive::Striker(striker) = &rings.drive else { return Ok(()) };
    if asked.striker_velocities_m_per_s.is_empty() {
        return Ok(());
    }
    let schedule = RingSchedule { shapes: false, ..scene.schedule(&arguments.scene, arguments.jobs)? };
    let mut rows = Vec::new();
    for velocity_m_per_s in asked.striker_velocities_m_per_s.iter().map(|velocity| velocity.get()) {
        let drive = RingDrive::Striker(RingStriker { velocity_m_per_s, ..*striker });
        let struck = simulate_rings(&RingChain { drive, ..rings.clone() }, &schedule)?;
        let measured = wave_of("rings", &struck.trajectory, pitch_m)?;
        let chain = chain_of(Some(velocity_m_per_s))?;
        let chain_velocity = chain.and_then(|chain| chain.speed).map(|speed| speed.group_m_per_s.value);
        rows.push(VelocityRow {
            striker_velocity_m_per_s: velocity_m_per_s,
            rings_m_per_s: measured.speed.map(|speed| speed.group_m_per_s.value),
            chain_m_per_s: chain_velocity,
        });
    }
    figures::draw_velocities(
        &folder,
        &rows,
        ring_sound_speed_m_per_s(&rings.ring, rings.elements_per_ring, pitch_m)?,
    )
}

fn summary(simulation: &RingSimulation, elements: usize, difference: Option<f64>) -> serde_json::Value {
    json!({
        "energy_drift": simulation.energy_drift,
        "momentum_drift": simulation.momentum_drift,
        "psi_max_j": simulation.psi_max_j,
        "steps": simulation.steps,
        "dt_s": simulation.dt_s,
        "stable_dt_s": simulation.stable_dt_s,
        "method": "verlet",
        "elements_per_ring": elements,
        "difference_to_coarser_mesh": difference,
        "element_steps": simulation.element_steps,
        "wide_share": simulation.wide_share,
        "contact_switches": simulation.contact_switches,
        "self_contact": simulation.self_contact.map(|contact| {
            json!({ "ring": contact.ring, "t_s": contact.time_s })
        }),
        // Bonded rings pull by their own elasticity, for which there is no limit of a law to pass.
        "tension_events": 0,
    })
}
