//! Conservation of energy and momentum in the chain model.

use std::f64::consts::TAU;

use chainwave_mechanics::{Drive, ImposedMotion, Integration, Method, Schedule, Striker, simulate};
use ndarray::Axis;

use crate::scenes::{MASS_KG, STRIKER_KG, hec_chain, rk4_energy_loss, run, striker};

/// The project's target for the automatic step.
#[test]
fn a_long_undamped_run_keeps_its_energy() {
    let chain = hec_chain(300, 0.0, striker(2.73, 0.0));
    let schedule = Schedule::automatic(0.15, 1e-3);
    let drift = simulate(&chain, &schedule).unwrap().energy_drift;
    assert!(drift <= 1e-9, "{drift:e}");
}

/// What the dampers take is integrated like the motion, so the balance closes to the same order, over switches too.
#[test]
fn energy_and_what_the_dampers_took_balance() {
    let simulation = run(&hec_chain(60, 0.003, striker(2.73, 0.2)), 0.042, 5e-6);
    assert_eq!(simulation.contact_switch_times_s.len(), 9);
    assert!(simulation.energy_drift < rk4_energy_loss(0.042, 5e-6), "{:e}", simulation.energy_drift);
}

/// Linear invariants survive every Runge-Kutta step; what is left is rounding, of 5000 steps by 2e-16 each if all go one way.
#[test]
fn momentum_without_ground_damping_is_kept() {
    for c_s in [0.0, 0.2] {
        let simulation = run(&hec_chain(26, 0.0, striker(2.73, c_s)), 0.05, 1e-5);
        let chain_momentum = simulation.trajectory.velocity_m_per_s.sum_axis(Axis(0)) * MASS_KG;
        let striker_v = simulation.striker.unwrap().velocity_m_per_s;
        for (chain, v) in chain_momentum.iter().zip(striker_v) {
            assert!(((chain + STRIKER_KG * v) / (STRIKER_KG * 2.73) - 1.0).abs() < 5000.0 * f64::EPSILON);
        }
    }
}

/// A striker that has bounced off for good slows as exp(-c t / m), and what its dashpot takes is in the balance, by every kind of method.
#[test]
fn a_striker_on_a_dashpot_slows_as_an_exponential() {
    let c_kg_per_s = 0.02;
    let light = Striker {
        mass_kg: 1e-4,
        velocity_m_per_s: 2.0,
        damping_kg_per_s: 0.05,
        ground_damping_kg_per_s: c_kg_per_s,
    };
    let chain = hec_chain(6, 0.003, Drive::Striker(light));
    let steps = |method| Integration::Steps { method, dt_s: 2e-6 };
    let accuracy = 1e-9;
    for integration in [
        steps(Method::Verlet),
        steps(Method::Symplectic4),
        steps(Method::Rk4),
        Integration::Accuracy { method: Method::Dop853, accuracy },
        Integration::Accuracy { method: Method::Esdirk4, accuracy },
        Integration::Automatic { accuracy },
    ] {
        let schedule = Schedule { integration, ..Schedule::automatic(0.02, 1e-4) };
        let found = simulate(&chain, &schedule).unwrap();
        let left_s = *found.contact_switch_times_s.last().unwrap();
        let striker = found.striker.unwrap();
        let first = (left_s / 1e-4).ceil() as usize;
        let speed = |k: usize| striker.velocity_m_per_s[k];
        assert!(speed(first) < -0.1, "it bounced off: {}", speed(first));
        for k in first..first + 100 {
            let expected = speed(first) * (-c_kg_per_s / light.mass_kg * 1e-4 * (k - first) as f64).exp();
            // Steps of c h / m = 4e-4 err by that to the fourth, those that adapt by the accuracy asked for, of 2 m/s and in each of some ten.
            assert!((speed(k) - expected).abs() < 2e-8, "{integration:?}, {k}: {} of {expected}", speed(k));
        }
        // The balance errs by the square of the steps at most: some (omega h)^2 with omega 6000 per second.
        assert!(found.energy_drift < 2e-4, "{integration:?}: {:e}", found.energy_drift);
    }
}

/// The potential energy at a peak stands still, so its maximum must not depend on where the steps fall.
#[test]
fn peak_energies_converge_with_the_fourth_power_of_the_step() {
    let chain = hec_chain(26, 0.003, striker(2.73, 0.2));
    let truth = run(&chain, 0.02, 1e-6).psi_max_j;
    let error = |dt_s: f64| {
        let found = run(&chain, 0.02, dt_s).psi_max_j;
        found.iter().zip(&truth).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
    };
    let order = (error(2e-5) / error(1e-5)).log2();
    assert!(order > 3.8, "{order}");
}

#[test]
fn a_chain_at_rest_stays_at_rest() {
    let drive = Drive::Free { displacement_m: vec![0.0; 5], velocity_m_per_s: vec![0.0; 5] };
    let simulation = run(&hec_chain(5, 0.0, drive), 0.01, 1e-5);
    assert!(simulation.trajectory.displacement_m.iter().all(|&x| x.abs() == 0.0));
    assert!(simulation.energy_drift.abs() == 0.0 && simulation.striker.is_none());
    let rests = Drive::Free { displacement_m: vec![0.0; 5], velocity_m_per_s: vec![0.0; 5] };
    let nobody = Drive::Imposed(
        ImposedMotion::from_samples((0..21).map(|i| 1e-3 * f64::from(i)).collect(), vec![0.0; 21]).unwrap(),
    );
    for drive in [rests, nobody] {
        // Errors relative to what never moved are none.
        let simulation = simulate(&hec_chain(5, 0.0, drive), &Schedule::automatic(0.01, 1e-3)).unwrap();
        assert!(simulation.trajectory.displacement_m.iter().all(|&x| x.abs() == 0.0));
    }
}

/// What moves it may come late: until then nothing says how large a motion will be.
#[test]
fn a_chain_that_rests_at_first_is_followed_when_it_moves() {
    let times_s: Vec<f64> = (0..401).map(|i| 1e-4 * f64::from(i)).collect();
    let pushed = |late_s: f64| {
        let push = |time_s: &f64| 1e-3 * (1.0 - (-((time_s - late_s).max(0.0) / 2e-3).powi(4)).exp());
        let moved_m = times_s.iter().map(push).collect();
        let drive = Drive::Imposed(ImposedMotion::from_samples(times_s.clone(), moved_m).unwrap());
        simulate(&hec_chain(5, 0.01, drive), &Schedule::automatic(0.01 + late_s, 1e-3)).unwrap().trajectory
    };
    let (soon, late) = (pushed(0.0), pushed(0.02));
    for (step, row) in soon.displacement_m.columns().into_iter().enumerate() {
        for (body, x_m) in row.iter().enumerate() {
            // Both are within 1e-6 of a millimetre of the truth.
            assert!((late.displacement_m[(body, step + 20)] - x_m).abs() < 2e-9, "{step} {body}");
        }
    }
}

/// The gap behind a body whose motion is imposed peaks between two steps as the others do: the drive's own acceleration bends its course.
#[test]
fn the_gap_behind_an_imposed_body_peaks_where_it_does() {
    let times_s: Vec<f64> = (0..2001).map(|i| 1e-5 * f64::from(i)).collect();
    let shaken = times_s.iter().map(|time_s| 5e-4 * (TAU * 300.0 * time_s).sin()).collect();
    let drive = Drive::Imposed(ImposedMotion::from_samples(times_s, shaken).unwrap());
    let chain = hec_chain(6, 0.01, drive);
    let psi_max_j = |schedule: &Schedule| simulate(&chain, schedule).unwrap().psi_max_j;
    let fine = psi_max_j(&Schedule::with_steps(0.02, 1e-4, Method::Rk4, 5e-7));
    let found = psi_max_j(&Schedule::automatic(0.02, 1e-4));
    for (gap, (found, fine)) in found.iter().zip(&fine).enumerate() {
        // An energy errs by twice what its overlap does, which is 1e-6 of the largest displacement, here up to ten times the overlap.
        assert!((found / fine - 1.0).abs() < 2e-5, "gap {}: {found:e} {fine:e}", gap + 1);
    }
    // Steps of a third of that of the drive's own peak: the interpolant is of sixth order in the step for all gaps alike.
    let rough = psi_max_j(&Schedule::with_steps(0.02, 1e-4, Method::Rk4, 2e-5));
    let errors: Vec<f64> = rough.iter().zip(&fine).map(|(rough, fine)| (rough / fine - 1.0).abs()).collect();
    let of_others = errors[1..].iter().copied().fold(0.0, f64::max);
    assert!(errors[0] < 10.0 * of_others, "{errors:?}");
}
