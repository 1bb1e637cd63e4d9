//! Dispersion, speed of sound, and the energy that rarefaction takes.

use std::f64::consts::PI;

use chainwave_mechanics::{Chain, Drive, FarEnd, PowerLaw, Simulation};

use crate::scenes::{MASS_KG, PITCH_M, hec_chain, run, striker};

/// A standing wave of amplitude far below delta_0: cos(kappa (n - 1/2)) fits the free end at body 1.
fn standing_wave(n_bodies: usize, kappa: f64, far_end: FarEnd) -> Chain {
    let amplitude_m = 1e-13 * PowerLaw::ELLIPTICAL_RING.delta_0_m;
    let shape = |i: usize| amplitude_m * (kappa * (i as f64 + 0.5)).cos();
    let drive = Drive::Free {
        displacement_m: (0..n_bodies).map(shape).collect(),
        velocity_m_per_s: vec![0.0; n_bodies],
    };
    Chain { far_end, ..hec_chain(n_bodies, 0.0, drive) }
}

/// omega = 2 sqrt(k_0/m) |sin(kappa/2)|, from the longest standing wave to the shortest, for both kinds of far end.
#[test]
fn small_standing_waves_follow_the_dispersion_relation() {
    let n = 20;
    let free = [1, 5, 10, 19].map(|q| (FarEnd::Free, PI * f64::from(q) / n as f64));
    let fixed = [1, 5, 10, 20].map(|q| (FarEnd::Fixed, PI * (f64::from(q) - 0.5) / (n as f64 + 0.5)));
    for (far_end, kappa) in free.into_iter().chain(fixed) {
        let simulation = run(&standing_wave(n, kappa, far_end), 0.01, 2e-6);
        let omega = 2.0 * (PowerLaw::ELLIPTICAL_RING.k_0_n_per_m() / MASS_KG).sqrt() * (kappa / 2.0).sin();
        let displacement_m = &simulation.trajectory.displacement_m;
        let first_m = displacement_m[[0, 0]];
        for (k, time_s) in simulation.trajectory.times_s.iter().enumerate() {
            let error = displacement_m[[0, k]] / first_m - (omega * time_s).cos();
            // Over 36 rad the step's phase error is (omega dt)^4 / 120 of it, 1e-9; the amplitude's is below.
            assert!(error.abs() < 3e-9, "kappa {kappa}, t {time_s}: {error:e}");
        }
    }
}

/// Time at which the compression of gap n peaks, from the parabola through the largest outputs.
fn peak_time_s(simulation: &Simulation, gap: usize) -> f64 {
    let x = &simulation.trajectory.displacement_m;
    let overlap = |k: usize| x[[gap - 1, k]] - x[[gap, k]];
    let n_outputs = simulation.trajectory.times_s.len();
    let k = (1..n_outputs - 1).max_by(|&i, &j| overlap(i).total_cmp(&overlap(j))).unwrap();
    let (before, at, after) = (overlap(k - 1), overlap(k), overlap(k + 1));
    let shift = 0.5 * (before - after) / (before - 2.0 * at + after);
    simulation.trajectory.times_s[k] + shift * simulation.trajectory.times_s[1]
}

/// Velocity of the compression's peak between two gaps.
fn group_velocity(simulation: &Simulation, from: usize, to: usize) -> f64 {
    (to - from) as f64 * PITCH_M / (peak_time_s(simulation, to) - peak_time_s(simulation, from))
}

/// c_0 = a sqrt(k_0 / m) is 54 m/s for k_0 = 1474 N/m. The peak of a weak pulse lags behind it by the width of the front,
/// which still grows with the cube root of the distance: 1 % in velocity at gap 200.
#[test]
fn a_weak_pulse_travels_at_the_speed_of_sound() {
    let contact = PowerLaw::from_stiffness(1474.0, 2.9e-3, 0.1).unwrap();
    let c_0 = PITCH_M * (contact.k_0_n_per_m() / MASS_KG).sqrt();
    assert!((c_0 - 54.0).abs() < 0.01);
    let chain = Chain { contact: contact.into(), ..hec_chain(300, 0.0, striker(1e-6, 0.0)) };
    let c_g = group_velocity(&run(&chain, 0.16, 2e-5), 150, 250);
    assert!(c_g < c_0 && c_g > 0.98 * c_0, "{c_g}");
}

#[test]
fn faster_strikers_send_slower_waves() {
    let c_g = [0.01, 0.83, 1.89, 2.73].map(|v| {
        let chain = hec_chain(40, 0.003, striker(v, 0.2));
        group_velocity(&run(&chain, 0.03, 1e-5), 5, 20)
    });
    assert!(c_g.windows(2).all(|pair| pair[1] < pair[0] - 1.0), "{c_g:?}");
}

/// The derived drops of the peak potential energy between gap 1 and gap 250: N = 300, 2.73 m/s, undamped, k_0 = 1474 N/m.
/// They are stated to 0.1 %; the step changes them by less than 0.001 %.
#[test]
fn rarefaction_takes_the_derived_share_of_the_energy() {
    for (p, delta_0_m, drop_percent) in
        [(0.01, 2.9e-3, 80.4), (0.1, 2.9e-3, 78.5), (0.3, 3e-3, 72.4), (0.3, 5e-3, 63.7), (0.5, 3e-3, 65.5)]
    {
        let contact = PowerLaw::from_stiffness(1474.0, delta_0_m, p).unwrap();
        let chain = Chain { contact: contact.into(), ..hec_chain(300, 0.0, striker(2.73, 0.0)) };
        let psi_max_j = run(&chain, 0.18, 2.5e-5).psi_max_j;
        let found = 100.0 * (1.0 - psi_max_j[249] / psi_max_j[0]);
        assert!((found - drop_percent).abs() < 0.06, "p {p}, delta_0 {delta_0_m}: {found}");
    }
}
