//! Strikers and imposed motions against closed forms of an impact.

use std::f64::consts::PI;

use chainwave_mechanics::{Chain, Drive, ImposedMotion, Method, PowerLaw, Schedule, simulate};

use crate::scenes::{MASS_KG, STRIKER_KG, hec_chain, rk4_energy_loss, run, striker};

/// A striker and one body with a linear contact: Delta = v / omega sin(omega t) until t = pi / omega, then free flight
/// with the velocities of an elastic impact.
#[test]
fn an_elastic_impact_ends_with_its_closed_form() {
    let contact = PowerLaw::new(1474.0, 1e-3, 1.0).unwrap();
    let chain = Chain { contact: contact.into(), ..hec_chain(1, 0.0, striker(2.0, 0.0)) };
    let simulation = run(&chain, 0.01, 5e-6);
    let total_kg = STRIKER_KG + MASS_KG;
    let omega = (1474.0 * total_kg / (STRIKER_KG * MASS_KG)).sqrt();
    let body_v = 2.0 * 2.0 * STRIKER_KG / total_kg;
    // Centre of mass and relative coordinate meet again at t = pi / omega, at the centre's way.
    let meet_m = 2.0 * STRIKER_KG / total_kg * PI / omega;
    let end_m = meet_m + body_v * (0.01 - PI / omega);
    assert_eq!(simulation.contact_switch_times_s.len(), 1);
    let trajectory = &simulation.trajectory;
    // omega dt = 0.01: RK4's phase error over half a period is 3e-10.
    assert!((trajectory.velocity_m_per_s[[0, 100]] / body_v - 1.0).abs() < 1e-9);
    assert!((trajectory.displacement_m[[0, 100]] / end_m - 1.0).abs() < 1e-9);
}

/// With a dashpot in the contact, it opens when the force ends, at omega_d t = pi - atan(2 beta omega_d / (omega_d^2 -
/// beta^2)), while there is still overlap; the closing speed there is the restitution.
#[test]
fn a_damped_impact_opens_when_its_force_ends() {
    let (k, c_s, v) = (1474.0, 0.3, 2.0);
    let contact = PowerLaw::new(k, 1e-3, 1.0).unwrap();
    let chain = Chain { contact: contact.into(), ..hec_chain(1, 0.0, striker(v, c_s)) };
    let simulation = run(&chain, 0.01, 5e-6);
    let reduced_kg = STRIKER_KG * MASS_KG / (STRIKER_KG + MASS_KG);
    let beta = c_s / (2.0 * reduced_kg);
    let omega = (k / reduced_kg - beta * beta).sqrt();
    let angle = PI - (2.0 * beta * omega / (omega * omega - beta * beta)).atan();
    let left = v * (-beta * angle / omega).exp() * (angle.cos() - beta / omega * angle.sin());
    let body_v = simulation.trajectory.velocity_m_per_s[[0, 100]];
    let closing = simulation.striker.unwrap().velocity_m_per_s[100] - body_v;
    assert!(left < 0.0 && (closing / left - 1.0).abs() < 1e-9, "{closing} {left}");
    // The spring's rest goes to the dashpot, so the balance still closes, to (omega dt)^4 / 120 = 1e-10 as the motion does.
    assert!(simulation.energy_drift < 1e-9);
}

/// The long damped run of the experiment's chain: the striker bounces from 34.0 to 40.5 ms.
#[test]
fn the_striker_leaves_and_comes_back_nine_times() {
    let chain = hec_chain(300, 0.003, striker(2.73, 0.2));
    let switches = [0.0339, 0.0406, 0.080].map(|end_s| run(&chain, end_s, 1e-5).contact_switch_times_s.len());
    assert_eq!(switches, [0, 9, 9]);
}

/// The struck body's own motion, sampled at 50 kHz and imposed, moves the rest as the striker did.
#[test]
fn the_imposed_first_body_moves_the_others_as_the_striker_did() {
    let struck = hec_chain(26, 0.003, striker(2.73, 0.2));
    let fine = Schedule::with_steps(0.02, 2e-5, Method::Rk4, 5e-6);
    let truth = simulate(&struck, &fine).unwrap();
    let samples = truth.trajectory.displacement_m.row(0).to_vec();
    let motion = ImposedMotion::from_samples(truth.trajectory.times_s.clone(), samples).unwrap();
    let imposed = simulate(&hec_chain(26, 0.003, Drive::Imposed(motion)), &fine).unwrap();
    let difference = (&imposed.trajectory.displacement_m - &truth.trajectory.displacement_m)
        .fold(0.0_f64, |largest, d| largest.max(d.abs()));
    // The spline errs by up to 5 / 384 h^4 |x|, with h = 0.02 ms and |x| <= v omega^3 for the fastest oscillation.
    let omega_rad_per_s = 2.0 * (PowerLaw::ELLIPTICAL_RING.k_0_n_per_m() / MASS_KG).sqrt();
    assert!(difference < 5.0 / 384.0 * 2e-5_f64.powi(4) * 2.73 * omega_rad_per_s.powi(3), "{difference:e}");
    // The work of the drive is booked: energy balances although body 1 is not free.
    assert!(imposed.energy_drift < rk4_energy_loss(0.02, 5e-6), "{:e}", imposed.energy_drift);
    assert!(imposed.striker.is_none() && imposed.contact_switch_times_s.is_empty());
}

#[test]
fn outputs_do_not_change_the_motion() {
    let chain = hec_chain(26, 0.003, striker(2.73, 0.2));
    let at = |interval_s: f64| Schedule::with_steps(0.02, interval_s, Method::Rk4, 1e-5);
    let coarse = simulate(&chain, &at(2e-4)).unwrap();
    let fine = simulate(&chain, &at(1e-5)).unwrap();
    for (k, &time_s) in coarse.trajectory.times_s.iter().enumerate() {
        assert!((time_s - fine.trajectory.times_s[20 * k]).abs() < 1e-17);
        let difference =
            coarse.trajectory.displacement_m[[12, k]] - fine.trajectory.displacement_m[[12, 20 * k]];
        // Steps differ by a rounding of their length.
        assert!(difference.abs() < 1e-14);
    }
    assert_eq!(coarse, simulate(&chain, &at(2e-4)).unwrap());
}
