//! What lies at the ends of the model's range: finished, finite and right, or refused with a reason.

use chainwave_mechanics::{
    MechanicsError, Ring, RingChain, RingSchedule, RingSimulation, compress, simulate_rings,
    simulate_rings_within,
};

use crate::scenes::{chain, schedule};

fn run(chain: &RingChain) -> Result<RingSimulation, MechanicsError> {
    simulate_rings(chain, &RingSchedule { output_interval_s: 1e-3, ..schedule(5e-3) })
}

/// Finite, and momentum and energy kept.
fn assert_sound(what: &str, simulation: &RingSimulation) {
    assert!(simulation.trajectory.displacement_m.iter().all(|x| x.is_finite()), "{what}");
    assert!(simulation.energy_drift < 2e-3, "{what}: energy drift {}", simulation.energy_drift);
    assert!(simulation.momentum_drift.unwrap() < 1e-11, "{what}: {:?}", simulation.momentum_drift);
}

/// The stiffness of a thin ring goes with the cube of its wall, its mass with the wall.
#[test]
fn walls_from_a_twentieth_to_four_millimetres() {
    let stiffness = |wall_m: f64| {
        let ring = Ring { wall_m, ..Ring::PAPER };
        let curve = compress(&ring, ring.section(), 32, 1e-8, 1).unwrap();
        curve.force_n[1] / 1e-8
    };
    let thin = stiffness(0.05e-3) / 0.05e-3_f64.powi(3);
    assert!((stiffness(0.4e-3) / 0.4e-3_f64.powi(3) / thin - 1.0).abs() < 5e-3);
    // Shear and stretching soften a thick wall: by 0.34 % of (4 / 0.4)^2, over one plus that.
    let thick = stiffness(4e-3) / 4e-3_f64.powi(3) / thin;
    assert!((thick - 1.0 / 1.34).abs() < 0.03, "{thick}");
    for wall_m in [0.05e-3, 0.2e-3, 1e-3, 4e-3] {
        let ring = Ring { wall_m, ..Ring::PAPER };
        assert_sound(&format!("wall {wall_m}"), &run(&RingChain { ring, ..chain(10, 16, 0.1) }).unwrap());
    }
}

#[test]
fn aspects_from_one_to_four() {
    for aspect in [1.0, 2.0, 3.0, 4.0] {
        let ring = Ring { semi_minor_m: 14.8e-3 / aspect, ..Ring::PAPER };
        assert_sound(&format!("aspect {aspect}"), &run(&RingChain { ring, ..chain(10, 24, 1.0) }).unwrap());
    }
}

#[test]
fn velocities_from_a_micrometre_to_thirty_metres_a_second() {
    let slow = run(&chain(10, 16, 1e-6)).unwrap();
    let faster = run(&chain(10, 16, 1e-4)).unwrap();
    assert_sound("1e-6 m/s", &slow);
    // Such waves are linear, so one is the other times a hundred.
    let largest = faster.trajectory.displacement_m[(0, 5)];
    for (x, y) in slow.trajectory.displacement_m.iter().zip(&faster.trajectory.displacement_m) {
        assert!((100.0 * x - y).abs() < 1e-3 * largest, "{x} {y}");
    }
    for velocity_m_per_s in [0.1, 3.0, 10.0, 30.0] {
        assert_sound(&format!("{velocity_m_per_s} m/s"), &run(&chain(10, 32, velocity_m_per_s)).unwrap());
    }
}

#[test]
fn meshes_from_four_to_256_elements() {
    for elements in [4, 8, 64, 256] {
        let simulation = run(&chain(4, elements, 1.0)).unwrap();
        assert_sound(&format!("{elements} elements"), &simulation);
    }
}

#[test]
fn compression_to_self_contact_at_every_aspect() {
    for (aspect, wall_m) in [(1.0, 0.4e-3), (1.0, 3e-3), (1.7, 0.4e-3), (2.0, 1e-3)] {
        let ring = Ring { semi_minor_m: 14.8e-3 / aspect, wall_m, ..Ring::PAPER };
        let curve = compress(&ring, ring.section(), 48, 2.0 * ring.semi_major_m, 200).unwrap();
        let contact_m = curve.self_contact_m.unwrap();
        assert!((contact_m - (29.6e-3 - wall_m)).abs() < 0.5e-3, "{aspect} {wall_m}: {contact_m}");
        assert!(curve.force_n.iter().all(|force| force.is_finite()));
    }
}

/// A strike that folds the first ring up ends the motion at the last output before its walls touch.
#[test]
fn motion_ends_where_walls_touch() {
    let schedule = RingSchedule { output_interval_s: 1e-4, ..schedule(5e-3) };
    let simulation = simulate_rings(&chain(6, 32, 60.0), &schedule).unwrap();
    let contact = simulation.self_contact.unwrap();
    assert_eq!(contact.ring, 1);
    let last_s = *simulation.trajectory.times_s.last().unwrap();
    assert!(last_s < contact.time_s && contact.time_s <= last_s + 1e-4, "{last_s} {contact:?}");
    let column = simulation.trajectory.displacement_m.column(simulation.trajectory.times_s.len() - 1);
    let overlap_m = column[0] - column[1];
    assert!((10e-3..29.2e-3).contains(&overlap_m), "{overlap_m}");
    let more = simulate_rings(&chain(6, 32, 60.0), &RingSchedule { n_threads: 2, ..schedule }).unwrap();
    assert_eq!(simulation, more);
    let harmless = simulate_rings(&chain(6, 32, 3.0), &schedule).unwrap();
    assert_eq!(harmless.self_contact, None);
}

/// Walls meet sooner or later with another mesh, so that two motions have outputs of their own number: what they share is compared.
#[test]
fn meshes_are_compared_up_to_where_walls_touch() {
    let schedule = RingSchedule { output_interval_s: 2e-6, ..schedule(5e-3) };
    let struck = |elements| chain(3, elements, 60.0);
    let n_outputs = |elements| simulate_rings(&struck(elements), &schedule).unwrap().trajectory.times_s.len();
    assert_ne!(n_outputs(16), n_outputs(24));
    let found = simulate_rings_within(&struck(16), &schedule, 0.05).unwrap();
    // Joints shifted against each other differ by as much as they move.
    assert!(found.elements_per_ring <= 64 && found.difference <= 0.05, "{found:?}");
}
