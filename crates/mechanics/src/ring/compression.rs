//! Quasi-static compression of one ring: force over overlap.

use nalgebra::DVector;

use super::{
    rod::Rod,
    section::{Ring, Section},
    statics::Support,
    walls::Walls,
};
use crate::{check, error::MechanicsError};

/// Times a step of the overlap is halved when Newton's method fails.
const HALVINGS: u32 = 12;

/// A quasi-static compression of one ring, pole to pole along its major axis, with the poles' directions kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Compression {
    /// Overlap (shortening) in metres, from 0, in equal steps.
    pub overlap_m: Vec<f64>,
    /// Force on the whole ring in newtons.
    pub force_n: Vec<f64>,
    /// Overlap at which walls of the ring would touch: the model ends before it. `None` if they do not.
    pub self_contact_m: Option<f64>,
    /// Overlap from which on the wall beside the pole stands out beyond it, so that bonded neighbours of the same shape
    /// would touch there, which the model leaves out. `None` if it does not.
    pub neighbour_contact_m: Option<f64>,
}

/// Compresses a ring of the given section up to `max_overlap_m` in `n_steps`; the curve ends where walls touch.
///
/// The overlap is prescribed, so limit points of the load are passed.
///
/// # Errors
/// [`MechanicsError::NotPhysical`] for input without meaning; [`MechanicsError::NoEquilibrium`] where the path cannot be
/// followed.
pub fn compress(
    ring: &Ring,
    section: Section,
    elements_per_ring: usize,
    max_overlap_m: f64,
    n_steps: usize,
) -> Result<Compression, MechanicsError> {
    check::positive("max_overlap_m", max_overlap_m)?;
    check::require(n_steps > 0, "n_steps", "at least 1", n_steps as f64)?;
    let (rod, half) = Rod::and_half_ring(ring, section, elements_per_ring)?;
    let (walls, mut places_m) = (Walls::new(ring, half.nodes_m), Vec::new());
    let mut unknowns = DVector::zeros(rod.n_unknowns());
    let mut curve = Compression {
        overlap_m: vec![0.0],
        force_n: vec![0.0],
        self_contact_m: None,
        neighbour_contact_m: None,
    };
    for step in 1..=n_steps {
        let overlap_m = max_overlap_m * step as f64 / n_steps as f64;
        let force_n = advance(&rod, &mut unknowns, overlap_m)?;
        walls.put_places(&mut places_m, |node| [unknowns[2 * node], unknowns[2 * node + 1]]);
        if walls.touch(&places_m) {
            curve.self_contact_m = Some(overlap_m);
            break;
        }
        if curve.neighbour_contact_m.is_none() && walls.stands_out(&places_m) {
            curve.neighbour_contact_m = Some(overlap_m);
        }
        curve.overlap_m.push(overlap_m);
        curve.force_n.push(force_n);
    }
    Ok(curve)
}

/// Moves the first pole on to an overlap, in halved steps where needed, and returns the force on the whole ring.
pub(crate) fn advance(rod: &Rod, unknowns: &mut DVector<f64>, overlap_m: f64) -> Result<f64, MechanicsError> {
    let from_m = unknowns[0];
    let last = 2 * rod.n_elements();
    let mut parts = 1_u64;
    loop {
        let reached = (1..=parts).try_fold((unknowns.clone(), 0.0), |(at, _), part| {
            let target_m = from_m + (overlap_m - from_m) * part as f64 / parts as f64;
            let held = [1, last, last + 1, rod.rotation(0), rod.rotation(1)].map(|unknown| (unknown, 0.0));
            let prescribed = held.into_iter().chain([(0, target_m)]).collect();
            let found = rod.equilibrium(&at, &Support { prescribed, loads: Vec::new() })?;
            Ok((found.unknowns, 2.0 * found.forces[0]))
        });
        match reached {
            Ok((reached, force_n)) => {
                *unknowns = reached;
                return Ok(force_n);
            }
            Err(error) if parts == 1 << HALVINGS => return Err(error),
            Err(_) => parts *= 2,
        }
    }
}
