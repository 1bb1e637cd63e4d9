//! Damping of a chain that is let go from a known state.

use chainwave_analysis::{exact_motion, replicate};
use chainwave_inference::{FitError, Prior, Quantity, ReleasedModel, fit_release};
use chainwave_measurement::{ChainMotion, Trajectory};
use chainwave_mechanics::{Chain, Drive, FarEnd, Schedule, simulate};
use ndarray::Array2;

use crate::common::{INTERVAL_S, with_late_view, with_sigma};

const N_BODIES: usize = 8;
const C_D: f64 = 0.003;
const RELEASE_S: f64 = 0.13e-3;

/// A softening chain held to a wall and to ground, pressed together unevenly and with a kick.
fn chain(damping_kg_per_s: f64) -> Chain {
    let along = |i: usize| (N_BODIES - i) as f64;
    Chain {
        damping_kg_per_s: vec![damping_kg_per_s; N_BODIES],
        ground_stiffness_n_per_m: vec![150.0; N_BODIES],
        drive: Drive::Free {
            displacement_m: (0..N_BODIES).map(|i| 2e-4 * along(i)).collect(),
            velocity_m_per_s: (0..N_BODIES).map(|i| 0.01 * along(i)).collect(),
        },
        far_end: FarEnd::Fixed,
        ..Chain::of_rings(N_BODIES)
    }
}

/// The chain's motion from where it is held, let go a little after the trigger, with noise and a view that is seen late.
fn motion() -> ChainMotion {
    let moved = simulate(&chain(C_D), &Schedule::automatic(0.012, INTERVAL_S / 4.0)).unwrap().trajectory;
    let times_s: Vec<f64> = (-20..240).map(|k| f64::from(k) * INTERVAL_S).collect();
    let of = |(row, k): (usize, usize),
              value: &dyn Fn(&chainwave_measurement::TrajectoryAt<'_>, usize) -> f64| {
        let since_s = times_s[k] - RELEASE_S;
        if since_s < 0.0 { 0.0 } else { moved.at(since_s).map_or(0.0, |moment| value(&moment, row)) }
    };
    let held_m = |row: usize| moved.displacement_m[(row, 0)];
    let shape = (N_BODIES, times_s.len());
    let seen = Trajectory {
        displacement_m: Array2::from_shape_fn(shape, |at| {
            of(at, &|moment, row| moment.displacement_m(row) - held_m(row))
        }),
        velocity_m_per_s: Array2::from_shape_fn(shape, |at| {
            of(at, &|moment, row| moment.velocity_m_per_s(row))
        }),
        times_s: times_s.clone(),
    };
    with_late_view(with_sigma(exact_motion(&seen), 0.3e-6), 4..N_BODIES, 0.1e-6)
}

fn model(priors: Vec<Prior>) -> ReleasedModel {
    ReleasedModel { chain: chain(0.001), state_sigma: 0.01, priors, drive_deviations: vec![0.0] }
}

#[test]
fn intervals_hold_damping_release_and_state_as_often_as_they_say() {
    const N: usize = 40;
    let mut squares = [0.0; 3];
    for noisy in replicate(&motion(), N, 77) {
        let fit = fit_release(&noisy, &model(Vec::new())).unwrap();
        let found = [(fit.chain_damping_kg_per_s, C_D), (fit.release_time_s, RELEASE_S), (fit.state, 1.0)];
        for (sum, (found, truth)) in squares.iter_mut().zip(found) {
            *sum += ((found.value - truth) / found.sigma).powi(2) / N as f64;
        }
        assert!(fit.chain_damping_kg_per_s.sigma < 0.01 * C_D, "{fit:?}");
        assert!(fit.release_time_s.sigma < 0.1 * INTERVAL_S && fit.state.sigma < 1e-3, "{fit:?}");
        assert!(fit.n_simulations < 60, "{}", fit.n_simulations);
    }
    for squares in squares {
        // The rms of 40 errors scatters by 11 %, and the late view is one error of thousands of samples.
        assert!((squares.sqrt() - 1.0).abs() < 0.4, "errors' rms is {} of what is stated", squares.sqrt());
    }
}

#[test]
fn a_spring_to_ground_known_within_an_uncertainty_is_fitted_along() {
    let noisy = replicate(&motion(), 1, 5).next().unwrap();
    let priors = Prior { quantity: Quantity::Ground, relative_sigma: 0.05 };
    let mut stiffer = model(vec![priors]);
    stiffer.chain.ground_stiffness_n_per_m.fill(150.0 * 1.03);
    let fit = fit_release(&noisy, &stiffer).unwrap();
    let (_, factor) = fit.factors[0];
    assert!((factor.value * 1.03 - 1.0).abs() < 4.0 * factor.sigma && factor.sigma < 0.01, "{factor:?}");
    let c_d = fit.chain_damping_kg_per_s;
    assert!((c_d.value - C_D).abs() < 4.0 * c_d.sigma, "{c_d:?}");
}

#[test]
fn another_chain_is_refused() {
    let mut other = model(Vec::new());
    other.chain.mass_kg.pop();
    let refused = fit_release(&motion(), &other);
    assert!(matches!(refused, Err(FitError::TooFew { what: "bodies in the model", .. })), "{refused:?}");
}
