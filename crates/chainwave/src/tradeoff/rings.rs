use std::path::Path;
use std::time::Instant;

use chainwave_mechanics::{RingChain, RingSchedule, RingSimulation, simulate_rings};

use super::Rung;
use crate::error::Error;
use crate::progress;
use crate::simulate::ring_scene;

/// Elements around each ring; the step is that which each allows, so errors of both are in the figure.
const ELEMENTS: [usize; 8] = [8, 12, 16, 20, 24, 32, 48, 64];
/// Elements of the simulation that stands for the truth: its own error is a sixteenth of the finest rung's, or less.
const REFERENCE: usize = 128;
/// Repetitions of which the shortest counts.
const REPETITIONS: usize = 3;

/// Meshes of a scene of rings: largest error of a joint's displacement over the largest displacement, and the time of one
/// simulation on one thread. A scene that asks for an accuracy takes the first mesh that meets it.
pub(super) fn of_scene(path: &Path) -> Result<Vec<Rung>, Error> {
    let (chain, schedule) = ring_scene(path)?;
    let schedule = RingSchedule { n_threads: 1, shapes: false, ..schedule };
    let meshed = |elements_per_ring: usize| RingChain { elements_per_ring, ..chain.clone() };
    let truth = simulate_rings(&meshed(REFERENCE), &schedule)?;
    let bar = progress::bar("meshes", ELEMENTS.len() as u64);
    let mut rungs = Vec::with_capacity(ELEMENTS.len());
    for elements in ELEMENTS {
        bar.inc(1);
        // A mesh too coarse for the scene is no rung here.
        let Some((found, seconds_per_item)) = timed(&meshed(elements), &schedule) else { continue };
        rungs.push(Rung {
            step: "ring",
            method: "verlet".into(),
            settings: format!("elements_per_ring = {elements}"),
            error: distance(&found, &truth),
            error_unit: "of largest displacement",
            seconds_per_item,
            items: REPETITIONS as u64,
        });
    }
    bar.finish_and_clear();
    Ok(rungs)
}

/// A simulation and the shortest time that it takes, in seconds.
fn timed(chain: &RingChain, schedule: &RingSchedule) -> Option<(RingSimulation, f64)> {
    let mut shortest = f64::INFINITY;
    let mut simulation = None;
    for _ in 0..REPETITIONS {
        let start = Instant::now();
        simulation = Some(simulate_rings(chain, schedule).ok()?);
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    simulation.map(|simulation| (simulation, shortest))
}

/// Largest difference of displacements, over the outputs that both have, over the largest displacement.
fn distance(found: &RingSimulation, truth: &RingSimulation) -> f64 {
    let (found, truth) = (&found.trajectory.displacement_m, &truth.trajectory.displacement_m);
    let n_common = found.ncols().min(truth.ncols());
    let largest = truth.iter().fold(0.0_f64, |most, x_m| most.max(x_m.abs()));
    let apart = (0..n_common)
        .flat_map(|k| found.column(k).into_iter().zip(truth.column(k)))
        .fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    apart / largest
}
