//! The rings' dynamics: conservation, convergence, threads, and slow obvious code.

use chainwave_mechanics::{
    FarEnd, ImposedMotion, MechanicsError, RingChain, RingDrive, RingSchedule, RingSimulation, RingStriker,
    simulate_rings,
};

use crate::plain;
use crate::scenes::{chain, schedule};

fn run(chain: &RingChain, schedule: &RingSchedule) -> RingSimulation {
    simulate_rings(chain, schedule).unwrap()
}

fn largest_difference(a: &RingSimulation, b: &RingSimulation) -> f64 {
    let (a, b) = (&a.trajectory.displacement_m, &b.trajectory.displacement_m);
    let largest = b.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / largest
}

/// Nine rings fill a block and begin the next. The vectors' polynomials err by 3e-10, so do the motions.
#[test]
fn vectors_move_rings_as_plain_code_does() {
    for (elements, velocity_m_per_s) in [(24, 2.0), (6, 6.0), (16, 12.0)] {
        let chain = chain(9, elements, velocity_m_per_s);
        let found = run(&chain, &schedule(1e-3));
        let plain = plain::joints_m(&chain, found.dt_s, found.steps as usize);
        let last = found.trajectory.displacement_m.ncols() - 1;
        for (joint, x_m) in plain.iter().enumerate() {
            let error_m = (found.trajectory.displacement_m[(joint, last)] - x_m).abs();
            assert!(error_m < 1e-8 * plain[0], "{elements} {joint}: {error_m}");
        }
        assert_eq!(found.wide_share > 0.0, elements < 24, "{elements}: {}", found.wide_share);
    }
}

#[test]
fn results_do_not_depend_on_the_threads() {
    let chain = chain(100, 8, 2.73);
    let one = run(&chain, &schedule(30e-3));
    for n_threads in [2, 3] {
        let more = run(&chain, &RingSchedule { n_threads, ..schedule(30e-3) });
        assert_eq!(one, more, "{n_threads} threads");
    }
}

/// The neglected forces are 1e-11 of the wave's. Waves along the walls run ahead of the others at some 1200 m/s, so what is
/// left out is what these have not reached.
#[test]
fn rings_ahead_of_the_wave_are_left_out_unnoticed() {
    let (long, short) =
        (run(&chain(400, 12, 2.73), &schedule(4e-3)), run(&chain(200, 12, 2.73), &schedule(4e-3)));
    let all = 400 * 6 * long.steps;
    assert!(long.element_steps < all / 2, "{} of {all}", long.element_steps);
    for joint in 0..100 {
        let rows = (long.trajectory.displacement_m.row(joint), short.trajectory.displacement_m.row(joint));
        for (x, y) in rows.0.iter().zip(rows.1) {
            assert!((x - y).abs() < 1e-11 * 0.015, "{joint}: {x} {y}");
        }
    }
}

#[test]
fn energy_and_momentum_are_kept() {
    let simulation = run(&chain(30, 16, 2.73), &schedule(20e-3));
    assert!(simulation.energy_drift < 1e-4, "{}", simulation.energy_drift);
    // Each step rounds what it adds to the momentum, all of them one way.
    let rounding = simulation.steps as f64 * f64::EPSILON;
    assert!(simulation.momentum_drift.unwrap() < rounding, "{:?}", simulation.momentum_drift);
    let half = RingSchedule { dt_s: Some(0.5 * simulation.dt_s), ..schedule(20e-3) };
    let finer = run(&chain(30, 16, 2.73), &half);
    // Second order: a quarter, but for where the striker's contact happens to switch.
    assert!(finer.energy_drift < 0.5 * simulation.energy_drift, "{}", finer.energy_drift);
    let weak = run(&chain(30, 16, 1e-6), &schedule(20e-3));
    // What is left is the contact's: each time it opens or closes within a step.
    assert!(weak.energy_drift < 1e-4, "{}", weak.energy_drift);
    assert!(weak.momentum_drift.unwrap() < rounding, "{:?}", weak.momentum_drift);
}

/// At t = 0 the first joint moves as its drive has it, and a damped striker that touches has given nothing away yet.
#[test]
fn the_first_joint_starts_as_its_drive_does() {
    let mut struck = chain(10, 16, 2.73);
    if let RingDrive::Striker(RingStriker { damping_kg_per_s, .. }) = &mut struck.drive {
        *damping_kg_per_s = 0.2;
    }
    let struck = run(&struck, &schedule(5e-3));
    assert!(struck.trajectory.velocity_m_per_s[(0, 0)].abs() < f64::MIN_POSITIVE, "it rests");
    let rounding = struck.steps as f64 * f64::EPSILON;
    assert!(struck.momentum_drift.unwrap() < rounding, "{:?}", struck.momentum_drift);
    let moved = RingChain { drive: ramp(1e-4, 0.0, 6e-3, 20e-3), ..chain(10, 16, 1.0) };
    let RingDrive::Imposed(motion) = &moved.drive else { panic!("expected an imposed motion") };
    let v_m_per_s = motion.velocity_m_per_s(0.0);
    let found = run(&moved, &schedule(1e-3)).trajectory.velocity_m_per_s[(0, 0)];
    assert!((found - v_m_per_s).abs() <= 1e-12 * v_m_per_s.abs(), "{found} {v_m_per_s}");
}

#[test]
fn dampers_take_the_energy_that_is_missed() {
    let mut damped = RingChain { damping_kg_per_s: 0.01, ..chain(20, 16, 2.73) };
    if let RingDrive::Striker(RingStriker { damping_kg_per_s, .. }) = &mut damped.drive {
        *damping_kg_per_s = 0.2;
    }
    let simulation = run(&damped, &schedule(20e-3));
    assert!(simulation.energy_drift < 1e-3, "{}", simulation.energy_drift);
    let undamped = run(&chain(20, 16, 2.73), &schedule(20e-3));
    assert!(simulation.psi_max_j[15] < 0.9 * undamped.psi_max_j[15]);
    assert_eq!(simulation.momentum_drift, None);
}

/// A smooth step of the first joint: `height_m` at `centre_s`, over some `width_s`.
fn ramp(height_m: f64, centre_s: f64, width_s: f64, end_s: f64) -> RingDrive {
    let step = |t: f64| 0.5 * height_m * (1.0 + ((t - centre_s) / width_s).tanh());
    let times_s: Vec<f64> = (0..=1000).map(|i| end_s * f64::from(i) / 1000.0).collect();
    let x_m = times_s.iter().map(|&t| step(t) - step(0.0)).collect();
    RingDrive::Imposed(ImposedMotion::from_samples(times_s, x_m).unwrap())
}

#[test]
fn the_step_converges_with_its_square() {
    // Smooth from the start: a jump of velocity would excite the fastest vibrations, for which no stable step is small.
    let chain = RingChain { drive: ramp(2e-3, 4e-3, 0.4e-3, 6e-3), ..chain(8, 12, 1.0) };
    let at = |dt_s: f64| run(&chain, &RingSchedule { dt_s: Some(dt_s), ..schedule(6e-3) });
    let exact = at(1e-7);
    let order = (largest_difference(&at(3.2e-6), &exact) / largest_difference(&at(1.6e-6), &exact)).log2();
    assert!((order - 2.0).abs() < 0.2, "order {order}");
}

/// A measured motion of body 1 begins with noise: counted from there it is no shock; one that begins far off is refused.
#[test]
fn an_imposed_motion_counts_from_where_it_begins() {
    let moved = |offset_m: f64| {
        let times_s: Vec<f64> = (0..=1000).map(|i| 6e-6 * f64::from(i)).collect();
        let step = |t: f64| 1e-3 * (1.0 + ((t - 4e-3) / 0.4e-3).tanh());
        let x_m = times_s.iter().map(|&t| step(t) - step(0.0) + offset_m).collect();
        let drive = RingDrive::Imposed(ImposedMotion::from_samples(times_s, x_m).unwrap());
        simulate_rings(&RingChain { drive, ..chain(8, 12, 1.0) }, &schedule(6e-3))
    };
    let (plain, noisy) = (moved(0.0).unwrap(), moved(1e-5).unwrap());
    for (noisy, plain) in noisy.psi_max_j.iter().zip(&plain.psi_max_j) {
        // Rounding of what is subtracted, 1e-16 of the offset over the displacement.
        assert!((noisy / plain - 1.0).abs() < 1e-9, "{noisy:e} {plain:e}");
    }
    assert!(noisy.energy_drift < 2.0 * plain.energy_drift + 1e-12, "{:e}", noisy.energy_drift);
    let refused = moved(5e-4).unwrap_err().to_string();
    assert!(refused.contains("at t = 0") && refused.contains("hint"), "{refused}");
}

#[test]
fn weak_waves_are_those_of_the_linear_chain() {
    // A smooth step of the first joint runs along the chain at c_0 = a sqrt(k_0 / m). Its width of 6 ms leaves a dispersion of
    // (a / 8 c_0 6 ms)^2 / 8, far below 0.1 %.
    let chain = RingChain { drive: ramp(2e-7, 20e-3, 6e-3, 60e-3), ..chain(80, 24, 1.0) };
    let simulation = run(&chain, &schedule(60e-3));
    // k_0 = 1469.9 N/m (24 elements), mass 1237 x 4.8e-6 x 75.28 mm: 1813 rings a second.
    let arrival = |joint: usize| {
        let row = simulation.trajectory.displacement_m.row(joint);
        let k = row.iter().position(|x| *x > 1e-7).unwrap();
        let (before, after) = (row[k - 1], row[k]);
        1e-4 * (k as f64 - 1.0 + (1e-7 - before) / (after - before))
    };
    let rings_per_s = 15.0 / (arrival(20) - arrival(5));
    assert!((rings_per_s / 1813.0 - 1.0).abs() < 0.003, "{rings_per_s}");
    assert!(simulation.energy_drift < 1e-6, "{}", simulation.energy_drift);
}

#[test]
fn a_fixed_end_stays_and_reflects() {
    let chain = RingChain { far_end: FarEnd::Fixed, ..chain(10, 12, 1.0) };
    let simulation = run(&chain, &schedule(15e-3));
    assert!(simulation.trajectory.displacement_m.row(10).iter().all(|x| *x == 0.0));
    assert!(simulation.energy_drift < 1e-4);
    assert!(simulation.psi_max_j[9] > simulation.psi_max_j[5]);
}

#[test]
fn shapes_hang_together_and_keep_their_length() {
    let simulation = run(&chain(10, 16, 2.73), &RingSchedule { shapes: true, ..schedule(5e-3) });
    let shapes = simulation.shapes_m.unwrap();
    assert_eq!(shapes.dim(), (10, 51, 9, 2));
    for (ring, k) in (0..10).flat_map(|ring| (0..51).map(move |k| (ring, k))) {
        let joint = simulation.trajectory.displacement_m[(ring, k)] + 29.6e-3 * ring as f64;
        assert!((shapes[(ring, k, 0, 0)] - joint).abs() < 1e-15);
        if ring > 0 {
            assert!((shapes[(ring, k, 0, 0)] - shapes[(ring - 1, k, 8, 0)]).abs() < 1e-15);
        }
        let length_m: f64 = (0..8)
            .map(|e| {
                let by = |axis| shapes[(ring, k, e + 1, axis)] - shapes[(ring, k, e, axis)];
                by(0_usize).hypot(by(1))
            })
            .sum();
        // Chords change by the strain of 1e-3 and by their curvature.
        assert!((length_m / 37.3e-3 - 1.0).abs() < 0.01, "{ring} {k}: {length_m}");
    }
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let refused = |chain: &RingChain, schedule: &RingSchedule| simulate_rings(chain, schedule).unwrap_err();
    let unstable = RingSchedule { dt_s: Some(1e-5), ..schedule(1e-3) };
    assert!(matches!(refused(&chain(3, 16, 1.0), &unstable), MechanicsError::UnstableStep { .. }));
    let broken = refused(&chain(3, 8, 300.0), &schedule(20e-3));
    assert!(matches!(broken, MechanicsError::RingBroken { .. }), "{broken}");
    assert!(matches!(refused(&chain(0, 8, 1.0), &schedule(1e-3)), MechanicsError::NotPhysical { .. }));
    let endless = RingSchedule { duration_s: 1e6, output_interval_s: 1.0, ..schedule(1.0) };
    assert!(matches!(refused(&chain(300, 64, 1.0), &endless), MechanicsError::TooLarge { .. }));
}
