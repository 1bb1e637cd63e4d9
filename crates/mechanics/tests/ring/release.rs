//! Chains that are let go from a state.

use chainwave_mechanics::{
    Compression, FarEnd, MechanicsError, Ring, RingChain, RingDrive, RingSchedule, RingSimulation, compress,
    simulate_rings,
};

use crate::scenes::{chain, schedule};

fn let_go(
    displacement_m: Vec<f64>,
    velocity_m_per_s: Vec<f64>,
    elements_per_ring: usize,
    schedule: &RingSchedule,
) -> RingSimulation {
    let n_rings = displacement_m.len() - 1;
    let drive = RingDrive::Free { displacement_m, velocity_m_per_s };
    simulate_rings(&RingChain { drive, ..chain(n_rings, elements_per_ring, 1.0) }, schedule).unwrap()
}

#[test]
fn a_chain_that_moves_as_a_whole_is_not_strained() {
    let simulation = let_go(vec![3e-3; 10], vec![-2.0; 10], 12, &schedule(5e-3));
    for ((_, k), x_m) in simulation.trajectory.displacement_m.indexed_iter() {
        let expected_m = 3e-3 - 2.0 * simulation.trajectory.times_s[k];
        assert!((x_m - expected_m).abs() < 1e-14, "{k}: {x_m} {expected_m}");
    }
    // Each step rounds what it adds to the momentum, all of them one way.
    let rounding = simulation.steps as f64 * f64::EPSILON;
    assert!(simulation.momentum_drift.unwrap() < rounding, "{:?}", simulation.momentum_drift);
    assert!(simulation.striker.is_none());
}

#[test]
fn a_compressed_ring_starts_with_the_work_done_on_it_and_springs_back_evenly() {
    let overlap_m = 2e-3;
    let simulation = let_go(vec![0.5 * overlap_m, -0.5 * overlap_m], vec![0.0; 2], 24, &schedule(10e-3));
    let Compression { overlap_m: overlaps_m, force_n, .. } =
        compress(&Ring::PAPER, Ring::PAPER.section(), 24, overlap_m, 400).unwrap();
    let work_j: f64 = overlaps_m
        .windows(2)
        .zip(force_n.windows(2))
        .map(|(x, force)| 0.5 * (force[0] + force[1]) * (x[1] - x[0]))
        .sum();
    // The trapezoidal rule errs by 1e-6 of the work in 400 steps.
    assert!((simulation.psi_max_j[0] / work_j - 1.0).abs() < 1e-5, "{} {work_j}", simulation.psi_max_j[0]);
    assert!(simulation.energy_drift < 1e-4, "{}", simulation.energy_drift);
    let x_m = &simulation.trajectory.displacement_m;
    let largest_m = x_m.row(0).iter().copied().fold(0.0, f64::max);
    assert!((largest_m / (0.5 * overlap_m) - 1.0).abs() < 1e-3, "{largest_m}");
    for (left, right) in x_m.row(0).iter().zip(x_m.row(1)) {
        assert!((left + right).abs() < 1e-12, "{left} {right}");
    }
}

/// A long pulse whose velocity is that of a wave to the right, v_n = c (x_n - x_{n+1}) with c rings a second, has no part that
/// runs to the left, but for 1 / (8 width) that the difference between joints and rings leaves.
#[test]
fn a_pulse_let_go_runs_to_the_right() {
    let (rings_per_s, width, height_m) = (1813.0, 6.0, 1e-7);
    let at = |joint: f64| height_m * (-((joint - 30.0) / width).powi(2)).exp();
    let rate = |joint: f64| rings_per_s * 2.0 * (joint - 30.0) / (width * width) * at(joint);
    let joints = (0..=100).map(f64::from);
    let simulation =
        let_go(joints.clone().map(at).collect(), joints.map(rate).collect(), 16, &schedule(20e-3));
    let last = simulation.trajectory.displacement_m.column(200);
    let (place, height) = last
        .iter()
        .enumerate()
        .fold((0, 0.0), |(at, most), (joint, &x_m)| if x_m > most { (joint, x_m) } else { (at, most) });
    // 20 ms at 1813 rings a second are 36.3; dispersion holds it back by a fraction of a ring.
    assert!((65..=67).contains(&place), "{place}");
    assert!((height / height_m - 1.0).abs() < 0.1, "{height}");
    let left_behind_m = last.iter().take(30).map(|x_m| x_m.abs()).fold(0.0, f64::max);
    assert!(left_behind_m < 0.02 * height_m, "{left_behind_m}");
    assert!(simulation.energy_drift < 1e-4, "{}", simulation.energy_drift);
}

#[test]
fn states_without_meaning_are_refused() {
    let refused = |displacement_m: Vec<f64>, velocity_m_per_s: Vec<f64>, far_end| {
        let drive = RingDrive::Free { displacement_m, velocity_m_per_s };
        simulate_rings(&RingChain { drive, far_end, ..chain(2, 8, 1.0) }, &schedule(1e-3)).unwrap_err()
    };
    let short = refused(vec![0.0; 2], vec![0.0; 3], FarEnd::Free);
    assert!(matches!(short, MechanicsError::Length { .. }), "{short}");
    let nan = refused(vec![0.0, f64::NAN, 0.0], vec![0.0; 3], FarEnd::Free);
    assert!(matches!(nan, MechanicsError::NotPhysical { .. }), "{nan}");
    let moving_wall = refused(vec![0.0; 3], vec![0.0, 0.0, 1.0], FarEnd::Fixed);
    assert!(matches!(moving_wall, MechanicsError::NotPhysical { .. }), "{moving_wall}");
    let torn = refused(vec![0.0, 0.2, 0.0], vec![0.0; 3], FarEnd::Free);
    let has_reason = matches!(torn, MechanicsError::NoEquilibrium { .. } | MechanicsError::RingBroken { .. });
    assert!(has_reason, "{torn}");
}
