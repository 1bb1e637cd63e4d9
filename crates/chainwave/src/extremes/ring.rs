//! Rings at the ends of their parameters.

use chainwave_mechanics::{
    FarEnd, MechanicsError, Ring, RingChain, RingDrive, RingSchedule, RingSimulation, RingStriker, compress,
    simulate_rings,
};

use super::{Family, decades, text};

/// What a balance of energy may lose at a step that the mesh sets: the striker's contact is the stiffest part of it.
const DRIFT: f64 = 2e-3;
/// What a sum over some thousand nodes rounds to.
const MOMENTUM: f64 = 1e-11;

pub(super) fn families() -> Vec<Family> {
    let mut velocities = decades(-6, 1);
    velocities.push(30.0);
    vec![
        Family::new(
            "ring's wall",
            "wall_m",
            &[0.05e-3, 0.2e-3, 0.4e-3, 1e-3, 4e-3],
            BALANCE,
            1.0,
            |wall_m| imbalance(Ring { wall_m, ..Ring::PAPER }, 16, 0.1),
        ),
        Family::new("ring's aspect", "aspect", &[1.0, 2.0, 3.0, 4.0], BALANCE, 1.0, |aspect| {
            imbalance(of_aspect(aspect), 24, 1.0)
        }),
        Family::new("striker on rings", "velocity_m_per_s", &velocities, BALANCE, 1.0, |velocity_m_per_s| {
            imbalance(Ring::PAPER, 32, velocity_m_per_s)
        }),
        Family::new("mesh of a ring", "elements", &[4.0, 8.0, 16.0, 64.0, 256.0], BALANCE, 1.0, |elements| {
            imbalance(Ring::PAPER, elements as usize, 1.0)
        }),
        Family::new(
            "compression until the walls meet",
            "aspect",
            &[1.0, 1.3, 1.7],
            "distance of the overlap from the rings' inner length, over it",
            0.017,
            |aspect| meeting_error(of_aspect(aspect)).map_err(text),
        ),
        Family::new(
            "strike until the walls meet",
            "velocity_m_per_s",
            &[60.0],
            "largest overlap that is reported, over the rings' inner length,",
            1.0,
            folding,
        ),
    ]
}

const BALANCE: &str = "energy drift over 2e-3, or momentum drift over 1e-11,";

fn of_aspect(aspect: f64) -> Ring {
    let ring = Ring::PAPER;
    Ring { semi_minor_m: ring.semi_major_m / aspect, ..ring }
}

/// The larger of the drifts of energy and momentum over their bounds, of ten rings that are struck.
fn imbalance(ring: Ring, elements_per_ring: usize, velocity_m_per_s: f64) -> Result<f64, String> {
    let found = struck(ring, elements_per_ring, velocity_m_per_s)?;
    let momentum = found.momentum_drift.ok_or("the momentum was not booked")?;
    Ok((found.energy_drift / DRIFT).max(momentum / MOMENTUM))
}

/// The largest overlap of rings whose walls meet under the strike, over the length inside.
fn folding(velocity_m_per_s: f64) -> Result<f64, String> {
    let ring = Ring::PAPER;
    let found = struck(ring, 32, velocity_m_per_s)?;
    let contact = found.self_contact.ok_or("no contact of walls was reported")?;
    if found.trajectory.times_s.last().is_none_or(|last_s| *last_s >= contact.time_s) {
        return Err("the motion goes on behind the contact".into());
    }
    let x_m = &found.trajectory.displacement_m;
    let overlaps_m = (1..x_m.nrows()).flat_map(|n| (0..x_m.ncols()).map(move |k| (n, k)));
    let largest_m = overlaps_m.map(|(n, k)| x_m[(n - 1, k)] - x_m[(n, k)]).fold(0.0, f64::max);
    Ok(largest_m / (2.0 * ring.semi_major_m - ring.wall_m))
}

/// Ten rings that are struck.
fn struck(ring: Ring, elements_per_ring: usize, velocity_m_per_s: f64) -> Result<RingSimulation, String> {
    let striker = RingStriker {
        mass_kg: 4.3e-3,
        velocity_m_per_s,
        contact_stiffness_n_per_m: 1e5,
        damping_kg_per_s: 0.0,
    };
    let chain = RingChain {
        ring,
        n_rings: 10,
        elements_per_ring,
        damping_kg_per_s: 0.0,
        drive: RingDrive::Striker(striker),
        far_end: FarEnd::Free,
    };
    let schedule =
        RingSchedule { duration_s: 5e-3, output_interval_s: 1e-4, dt_s: None, shapes: false, n_threads: 1 };
    let found = simulate_rings(&chain, &schedule).map_err(text)?;
    match found.trajectory.displacement_m.iter().all(|x_m| x_m.is_finite()) {
        true => Ok(found),
        false => Err("a displacement is not finite".into()),
    }
}

/// How far the overlap at which the walls meet is from the length inside the ring, over it.
fn meeting_error(ring: Ring) -> Result<f64, MechanicsError> {
    const N_STEPS: usize = 200;
    let inner_m = 2.0 * ring.semi_major_m - ring.wall_m;
    let curve = compress(&ring, ring.section(), 48, 2.0 * ring.semi_major_m, N_STEPS)?;
    Ok(curve.self_contact_m.map_or(f64::INFINITY, |overlap_m| (overlap_m / inner_m - 1.0).abs()))
}
