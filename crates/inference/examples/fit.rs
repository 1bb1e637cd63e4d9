//! Fits the damping of a chain to the tracks of three trials, which the chain model itself moved and noise of 0.4 um blurred.

use std::num::NonZero;

use chainwave_inference::{FitError, TrackModel, fit_tracks};
use chainwave_measurement::{BodyTrack, Estimate, Observation};
use chainwave_mechanics::{Chain, Drive, PowerLaw, Schedule, Striker, simulate};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

const N_BODIES: usize = 8;
const NOISE_M: f64 = 0.4e-6;

#[expect(clippy::print_stdout, reason = "the fitted numbers are the program's result")]
fn main() -> Result<(), FitError> {
    let observations = (0..3).map(filmed).collect::<Result<Vec<_>, _>>()?;
    let model = TrackModel {
        // The search begins at a third of c_d and half of c_s.
        chain: chain(0.001, 0.1, 2.73)?,
        striker_velocity_m_per_s: Estimate::new(2.73, 0.05),
        priors: Vec::new(),
        reading_errors: Vec::new(),
        usual_errors: Vec::new(),
        n_threads: std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN),
    };
    let fit = fit_tracks(&observations, &[0.0; 3], &model, None)?;
    let (c_d, c_s) = (fit.damping.chain_damping_kg_per_s, fit.damping.striker_damping_kg_per_s);
    println!("c_d = {:.5} +- {:.5} kg/s (true: 0.003)", c_d.value, c_d.sigma);
    println!("c_s = {:.4} +- {:.4} kg/s (true: 0.2)", c_s.value, c_s.sigma);
    println!("reduced chi squared {:.3}", fit.reduced_chi_squared);
    Ok(())
}

fn chain(c_d: f64, c_s: f64, velocity_m_per_s: f64) -> Result<Chain, FitError> {
    Ok(Chain {
        damping_kg_per_s: vec![c_d; N_BODIES],
        contact: PowerLaw::new(60.1, 2.27e-3, 0.114)?.into(),
        drive: Drive::Striker(Striker { velocity_m_per_s, damping_kg_per_s: c_s, ..Striker::OF_RINGS }),
        ..Chain::of_rings(N_BODIES)
    })
}

fn filmed(trial: u32) -> Result<Observation, FitError> {
    let mut random = Pcg64::seed_from_u64(u64::from(trial));
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let struck = chain(0.003, 0.2, 2.73 + 0.05 * normal())?;
    let moved = simulate(&struck, &Schedule::automatic(8e-3, 1e-5))?.trajectory;
    let impact_s = 1e-5 * normal();
    let times_s: Vec<f64> = (-20..180).map(|k| 4e-5 * f64::from(k)).collect();
    let mut track = |body: usize| {
        let at_m = |t_s: f64| moved.at(t_s - impact_s).map_or(0.0, |moment| moment.displacement_m(body - 1));
        let position = |t_s: &f64| Some(Estimate::new(at_m(*t_s) + NOISE_M * normal(), NOISE_M));
        BodyTrack { body, position_m: times_s.iter().map(position).collect() }
    };
    let bodies = (1..=N_BODIES).map(&mut track).collect();
    Ok(Observation { recording: format!("trial {trial}"), view: 0, trial, times_s, bodies })
}
