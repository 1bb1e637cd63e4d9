//! The experiment's chain, and shorthands.

use chainwave_mechanics::{Chain, Drive, FarEnd, Method, PowerLaw, Schedule, Simulation, Striker, simulate};

pub(crate) use crate::paper::{MASS_KG, STRIKER_KG};

pub(crate) const PITCH_M: f64 = 0.030;

/// Striker of the experiment with contact damping c_s.
pub(crate) fn striker(velocity_m_per_s: f64, damping_kg_per_s: f64) -> Drive {
    Drive::Striker(Striker {
        mass_kg: STRIKER_KG,
        velocity_m_per_s,
        damping_kg_per_s,
        ground_damping_kg_per_s: 0.0,
    })
}

/// `n` bodies of the experiment with the ring's law, ground damping c_d and a free far end.
pub(crate) fn hec_chain(n: usize, damping_kg_per_s: f64, drive: Drive) -> Chain {
    Chain {
        mass_kg: vec![MASS_KG; n],
        damping_kg_per_s: vec![damping_kg_per_s; n],
        ground_stiffness_n_per_m: Vec::new(),
        ground_law: None,
        contact: PowerLaw::ELLIPTICAL_RING.into(),
        drive,
        far_end: FarEnd::Free,
    }
}

/// Simulates with outputs every 0.1 ms and steps up to `dt_s`.
pub(crate) fn run(chain: &Chain, duration_s: f64, dt_s: f64) -> Simulation {
    simulate(chain, &Schedule::with_steps(duration_s, 1e-4, Method::Rk4, dt_s)).unwrap()
}

/// What RK4 takes at most of the energy: (omega dt)^6 / 72 in each step, all of it held by the fastest oscillation, omega =
/// 2 sqrt(k_0 / m) (the amplification factor's size is 1 - (omega dt)^6 / 144).
pub(crate) fn rk4_energy_loss(duration_s: f64, dt_s: f64) -> f64 {
    let omega_rad_per_s = 2.0 * (PowerLaw::ELLIPTICAL_RING.k_0_n_per_m() / MASS_KG).sqrt();
    duration_s / dt_s * (omega_rad_per_s * dt_s).powi(6) / 72.0
}

/// Largest difference of displacement over the largest displacement.
pub(crate) fn relative_error(found: &Simulation, truth: &Simulation) -> f64 {
    let (found, truth) = (&found.trajectory.displacement_m, &truth.trajectory.displacement_m);
    let largest = truth.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    found.iter().zip(truth).fold(0.0_f64, |error, (x, y)| error.max((x - y).abs())) / largest
}
