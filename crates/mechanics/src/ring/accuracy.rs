//! Mesh refinement: finer and finer elements until two meshes agree.

use super::{chain::RingChain, schedule::RingSchedule, simulate::simulate_rings, simulation::RingSimulation};
use crate::{check, error::MechanicsError};

/// Elements per ring that are tried in turn. The time step shrinks with the elements, so both errors do.
const LADDER: [usize; 10] = [12, 16, 24, 32, 48, 64, 96, 128, 192, 256];

/// A simulation whose mesh was chosen for a requested accuracy.
#[derive(Debug, Clone, PartialEq)]
pub struct RefinedSimulation {
    /// The simulation with the finest mesh tried.
    pub simulation: RingSimulation,
    /// Elements around each ring.
    pub elements_per_ring: usize,
    /// Largest difference of a joint's displacement to the next coarser mesh, over the largest displacement, or of the times at which walls
    /// met, over the longer one: more than the error where the differences fall from mesh to mesh.
    pub difference: f64,
}

/// Simulates with finer and finer meshes until two neighbours on the ladder agree within `accuracy`, relative to the
/// largest displacement. The chain's own number of elements is not used.
///
/// # Errors
/// Those of [`simulate_rings`], and [`MechanicsError::AccuracyNotReached`] at the ladder's end.
pub fn simulate_rings_within(
    chain: &RingChain,
    schedule: &RingSchedule,
    accuracy: f64,
) -> Result<RefinedSimulation, MechanicsError> {
    check::positive("accuracy", accuracy)?;
    let mut coarser: Option<RingSimulation> = None;
    let mut reached = f64::INFINITY;
    for elements_per_ring in LADDER {
        let simulation = simulate_rings(&RingChain { elements_per_ring, ..chain.clone() }, schedule)?;
        if let Some(coarser) = &coarser {
            reached = difference(coarser, &simulation);
            if reached <= accuracy {
                return Ok(RefinedSimulation { simulation, elements_per_ring, difference: reached });
            }
        }
        coarser = Some(simulation);
    }
    Err(MechanicsError::AccuracyNotReached { asked: accuracy, reached })
}

/// Largest difference of the displacements of two motions of the same joints while both go on, over the largest of the second; or that
/// of the times at which they end, over the longer one, where walls met in one of them sooner.
fn difference(a: &RingSimulation, b: &RingSimulation) -> f64 {
    let outputs = [a, b].map(|motion| motion.trajectory.times_s.len());
    let [n_shared, n_most] = [outputs[0].min(outputs[1]), outputs[0].max(outputs[1])];
    let (a, b) = (&a.trajectory.displacement_m, &b.trajectory.displacement_m);
    let largest = b.iter().fold(0.0, |largest: f64, x_m| largest.max(x_m.abs()));
    let shared = a.rows().into_iter().zip(b.rows());
    let pairs = shared.flat_map(|(a, b)| a.into_iter().zip(b).take(n_shared));
    let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let in_place = if apart > 0.0 { apart / largest } else { 0.0 };
    in_place.max((n_most - n_shared) as f64 / n_most.max(1) as f64)
}
