//! The ladder of meshes of a scene of rings.

use std::path::Path;

use chainwave_mechanics::{RingChain, RingSchedule, simulate_rings};

use super::Rung;
use super::simulations::ladder;
use crate::error::Error;
use crate::simulate::ring_scene;

/// Elements around each ring; the step is that which each allows, so errors of both are in the figure.
const ELEMENTS: [usize; 8] = [8, 12, 16, 20, 24, 32, 48, 64];
/// Elements of the simulation that stands for the truth: its own error is a sixteenth of the finest rung's, or less.
const REFERENCE: usize = 128;

/// Meshes of a scene of rings, on one thread. A scene that asks for an accuracy takes the first mesh that meets it.
pub(super) fn of_scene(path: &Path) -> Result<Vec<Rung>, Error> {
    let (chain, schedule) = ring_scene(path)?;
    let schedule = RingSchedule { n_threads: 1, shapes: false, ..schedule };
    let meshed = |elements_per_ring: usize| RingChain { elements_per_ring, ..chain.clone() };
    let truth = simulate_rings(&meshed(REFERENCE), &schedule)?.trajectory;
    let settings = ELEMENTS.map(|elements| (format!("elements_per_ring = {elements}"), meshed(elements)));
    Ok(ladder("ring", &truth, settings.into(), |chain| {
        Some(("verlet".into(), simulate_rings(chain, &schedule).ok()?.trajectory))
    }))
}
