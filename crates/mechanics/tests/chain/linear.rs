//! The linear chain's numbers against closed forms and against motions that the chain model computes.

use std::f64::consts::PI;

use chainwave_mechanics::{Chain, Drive, FarEnd, LinearChain, LinearLaw, Schedule, simulate};

use crate::scenes::{MASS_KG, PITCH_M, hec_chain, striker};

/// k = 1474 N/m and m = 0.455 g: omega_0 = sqrt(k / m) = 1799.88 rad/s, by hand.
const HEC: LinearChain = LinearChain { stiffness_n_per_m: 1474.0, mass_kg: MASS_KG, ground_n_per_m: 0.0 };

/// Relative roundings of a quotient, a root and a product or two, each of at most 2^-53 or, in a sine, twice that.
const ROUNDINGS: f64 = 6.0 * f64::EPSILON;

fn assert_close(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() <= ROUNDINGS, "{found} {expected}");
}

#[test]
fn units_of_mass_and_stiffness_give_the_textbooks_numbers() {
    let one = LinearChain { stiffness_n_per_m: 4.0, mass_kg: 1.0, ground_n_per_m: 0.0 };
    // omega = 2 sqrt(k / m) |sin(kappa / 2)| = 4 |sin(kappa / 2)|.
    assert_close(one.frequency_hz(PI / 3.0), 2.0 / (2.0 * PI));
    assert_close(one.frequency_hz(-PI / 2.0), 4.0 * 0.5_f64.sqrt() / (2.0 * PI));
    assert_close(one.band_edge_hz(), 4.0 / (2.0 * PI));
    assert_close(one.bodies_per_s(), 2.0);
    assert_close(one.sound_speed_m_per_s(0.5), 1.0);
    assert_close(one.crossing_time_s(10), 5.0);
    assert_close(one.critical_damping_kg_per_s(), 4.0);
}

/// The group velocity 2 pi df / dkappa of the longest waves is the speed of sound; that at the band's edge is zero.
#[test]
fn the_dispersions_slope_is_the_speed_of_sound() {
    // sin(x) = x (1 - x^2 / 6): at kappa = 1e-3 the chord lies 4e-8 below the tangent.
    assert!((2.0 * PI * HEC.frequency_hz(1e-3) / 1e-3 / HEC.bodies_per_s() - 1.0).abs() < 5e-8);
    // cos(x) = 1 - x^2 / 2: 1e-3 below the edge the frequency is lower by 1.25e-7.
    assert!((HEC.frequency_hz(PI - 1e-3) / HEC.band_edge_hz() - (1.0 - 1.25e-7)).abs() < 1e-12);
    // 54 m/s, the measured speed of sound of the experiment, to its two digits.
    assert!((HEC.sound_speed_m_per_s(PITCH_M) - 54.0).abs() < 0.5);
}

/// Neighbours that move oppositely swing with the band's edge: cos(2 pi f t).
#[test]
fn opposite_neighbours_swing_at_the_band_edge() {
    let n = 8;
    // cos(kappa (n - 1/2)) at kappa = pi (q - 1/2) / (n + 1/2), q = n: the shortest standing wave between a free end and a wall.
    let kappa = PI * (n as f64 - 0.5) / (n as f64 + 0.5);
    let shape = |i: usize| 1e-6 * (kappa * (i as f64 + 0.5)).cos();
    let drive = Drive::Free { displacement_m: (0..n).map(shape).collect(), velocity_m_per_s: vec![0.0; n] };
    let contact = LinearLaw::new(HEC.stiffness_n_per_m).unwrap().into();
    let chain = Chain { contact, far_end: FarEnd::Fixed, ..hec_chain(n, 0.0, drive) };
    assert_eq!(chain.linear(), Some(HEC));
    let found = simulate(&chain, &Schedule::automatic(5e-3, 1e-4)).unwrap().trajectory;
    for (t, x_m) in found.times_s.iter().zip(found.displacement_m.row(0)) {
        let expected = (2.0 * PI * HEC.frequency_hz(kappa) * t).cos();
        // The accuracy that the schedule asks for.
        assert!((x_m / shape(0) - expected).abs() < Schedule::ACCURACY, "{t}: {x_m}");
    }
}

/// A body on a wall's spring, let go with velocity v under critical damping: x = v t exp(-omega t), which never comes back.
#[test]
fn critical_damping_lets_a_body_return_without_a_swing() {
    let omega = HEC.bodies_per_s();
    let drive = Drive::Free { displacement_m: vec![0.0], velocity_m_per_s: vec![0.1] };
    let contact = LinearLaw::new(HEC.stiffness_n_per_m).unwrap().into();
    let chain =
        Chain { contact, far_end: FarEnd::Fixed, ..hec_chain(1, HEC.critical_damping_kg_per_s(), drive) };
    let found = simulate(&chain, &Schedule::automatic(5.0 / omega, 0.05 / omega)).unwrap().trajectory;
    let largest_m = 0.1 / omega * (-1.0_f64).exp();
    for (t, x_m) in found.times_s.iter().zip(found.displacement_m.row(0)) {
        // The accuracy that the schedule asks for, of the largest displacement at omega t = 1.
        let error_m = x_m - 0.1 * t * (-omega * t).exp();
        assert!(error_m.abs() < Schedule::ACCURACY * largest_m, "{t}: {error_m}");
    }
}

/// A weak pulse reaches a body no sooner than sound does but for its front, which has the shape of an Airy function's integral over
/// (n / 8)^(1/3) bodies; five of these widths are taken on either side.
#[test]
fn a_weak_pulse_crosses_the_chain_in_its_time() {
    let n = 100;
    let contact = LinearLaw::new(HEC.stiffness_n_per_m).unwrap().into();
    let chain = Chain { contact, ..hec_chain(2 * n, 0.0, striker(1e-6, 0.0)) };
    let width_s = 5.0 * (n as f64 / 8.0).cbrt() / HEC.bodies_per_s();
    let arrival_s = HEC.crossing_time_s(n);
    let found = simulate(&chain, &Schedule::automatic(arrival_s + width_s, width_s)).unwrap();
    let before_s = arrival_s - width_s;
    let early = simulate(&chain, &Schedule::automatic(before_s, before_s)).unwrap();
    let struck = |simulation: &chainwave_mechanics::Simulation| {
        let velocities = &simulation.trajectory.velocity_m_per_s;
        velocities[(n, velocities.ncols() - 1)].abs() / 1e-6
    };
    // Ai(5) = 1e-4. The front is narrower than the pulse of a striker of nine masses, which so keeps most of its peak.
    assert!(struck(&early) < 1e-3 && found.psi_max_j[n] > 0.1 * found.psi_max_j[0], "{}", struck(&early));
}
