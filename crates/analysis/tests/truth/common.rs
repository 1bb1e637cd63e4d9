//! Motions with known answers.

use chainwave_measurement::{ChainMotion, ErrorModes, Estimate};
use chainwave_mechanics::{Chain, Drive, FarEnd, Schedule, Simulation, Striker, simulate};
use ndarray::Array2;

pub(crate) const PITCH_M: f64 = 0.030;
pub(crate) const INTERVAL_S: f64 = 4e-5;

/// A motion without error whose gaps have the given strain: x_1 = 0, x_{n+1} = x_n + a u_n.
pub(crate) fn motion_of_strain(
    n_gaps: usize,
    n_times: usize,
    strain: impl Fn(usize, f64) -> f64,
) -> ChainMotion {
    let times_s: Vec<f64> = (0..n_times).map(|k| k as f64 * INTERVAL_S).collect();
    let mut x = Array2::zeros((n_gaps + 1, n_times));
    for gap in 1..=n_gaps {
        for (k, t_s) in times_s.iter().enumerate() {
            x[(gap, k)] = x[(gap - 1, k)] + PITCH_M * strain(gap, *t_s);
        }
    }
    ChainMotion {
        times_s,
        displacement_m: x.mapv(|x| Some(Estimate::new(x, 0.0))),
        independent_sigma_m: Array2::zeros(x.dim()),
        modes: ErrorModes::default(),
        n_trials: Array2::ones(x.dim()),
    }
}

/// The paper's chain with its striker, sampled at 25 kHz.
pub(crate) fn paper_chain(
    n_bodies: usize,
    velocity_m_per_s: f64,
    far_end: FarEnd,
    duration_s: f64,
) -> Simulation {
    damped_chain(n_bodies, velocity_m_per_s, far_end, duration_s, 0.003)
}

/// The same with dampers of so many kilograms per second.
pub(crate) fn damped_chain(
    n_bodies: usize,
    velocity_m_per_s: f64,
    far_end: FarEnd,
    duration_s: f64,
    c_d_kg_per_s: f64,
) -> Simulation {
    let chain = Chain {
        damping_kg_per_s: vec![c_d_kg_per_s; n_bodies],
        drive: Drive::Striker(Striker { velocity_m_per_s, ..Striker::OF_RINGS }),
        far_end,
        ..Chain::of_rings(n_bodies)
    };
    let schedule = Schedule::automatic(duration_s, INTERVAL_S);
    simulate(&chain, &schedule).unwrap()
}

/// The motion with its independent sigma set.
pub(crate) fn with_sigma(mut motion: ChainMotion, sigma_m: f64) -> ChainMotion {
    motion.independent_sigma_m.fill(sigma_m);
    motion.displacement_m.iter_mut().flatten().for_each(|x| x.sigma = sigma_m);
    motion
}

/// The motion with an error mode: every body in `bodies` (from 0) is seen `shift_s` late, at one standard deviation.
pub(crate) fn with_late_view(
    mut motion: ChainMotion,
    bodies: std::ops::Range<usize>,
    shift_s: f64,
) -> ChainMotion {
    let last = motion.times_s.len() - 1;
    let x = motion.displacement_m.mapv(|x| x.map_or(0.0, |x| x.value));
    let error = Array2::from_shape_fn(x.dim(), |(body, k)| {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
        let slope = (x[(body, after)] - x[(body, before)]) / ((after - before) as f64 * INTERVAL_S);
        if bodies.contains(&body) { -shift_s * slope } else { 0.0 }
    });
    motion.modes.push(format!("timing of bodies {bodies:?}").into(), &error);
    motion
}
