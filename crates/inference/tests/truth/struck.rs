//! Synthetic recordings of a struck chain, each with its own striker and trigger.

use std::num::NonZero;

use chainwave_inference::{Prior, TrackFit, TrackModel, fit_tracks};
use chainwave_measurement::{BodyTrack, Estimate, Observation};
use chainwave_mechanics::{Chain, Drive, Schedule, Striker, simulate};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;

use crate::common::INTERVAL_S;

pub(crate) const N_BODIES: usize = 12;
pub(crate) const C_D: f64 = 0.003;
pub(crate) const C_S: f64 = 0.2;
pub(crate) const NOISE_M: f64 = 0.4e-6;
pub(crate) const VELOCITY: Estimate = Estimate { value: 2.73, sigma: 0.05 };

/// The chain as the experimenter knows it, with starting values for the damping.
pub(crate) fn model(priors: Vec<Prior>) -> TrackModel {
    TrackModel {
        chain: chain(0.001, 0.1, VELOCITY.value),
        striker_velocity_m_per_s: VELOCITY,
        priors,
        reading_errors: Vec::new(),
        usual_errors: Vec::new(),
        n_threads: NonZero::<usize>::MIN,
    }
}

pub(crate) fn chain(c_d: f64, c_s: f64, velocity_m_per_s: f64) -> Chain {
    Chain {
        damping_kg_per_s: vec![c_d; N_BODIES],
        drive: Drive::Striker(Striker { velocity_m_per_s, damping_kg_per_s: c_s, ..Striker::OF_RINGS }),
        ..Chain::of_rings(N_BODIES)
    }
}

/// Two views of seven bodies, two trials each, at 25 kHz.
pub(crate) struct Experiment {
    pub(crate) observations: Vec<Observation>,
    pub(crate) impacts_s: Vec<f64>,
    pub(crate) strikers: Vec<f64>,
}

pub(crate) fn experiment(seed: u64, mass_factor: f64) -> Experiment {
    filmed(seed, mass_factor, NOISE_M)
}

pub(crate) fn filmed(seed: u64, mass_factor: f64, noise_m: f64) -> Experiment {
    filmed_of(seed, noise_m, |_, striker_m_per_s| {
        let mut struck = chain(C_D, C_S, striker_m_per_s);
        struck.mass_kg.iter_mut().for_each(|mass_kg| *mass_kg *= mass_factor);
        struck
    })
}

/// Of the chain of each recording, by its number and its striker's velocity in metres per second.
pub(crate) fn filmed_of(seed: u64, noise_m: f64, chain_of: impl Fn(usize, f64) -> Chain) -> Experiment {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut normal = |sigma: f64| Normal::new(0.0, sigma).unwrap().sample(&mut random);
    let mut made = Experiment { observations: Vec::new(), impacts_s: Vec::new(), strikers: Vec::new() };
    for view in 0..2_u32 {
        for trial in 0..2 {
            let (striker, impact_s) = (VELOCITY.value + normal(VELOCITY.sigma), normal(1e-5));
            let struck = chain_of(made.strikers.len(), striker);
            let times_s: Vec<f64> = (-20..230).map(|k| (f64::from(k) + 0.3) * INTERVAL_S).collect();
            // Simulated so finely that linear interpolation between samples is exact to 1e-10 m.
            let schedule = Schedule::automatic(0.0095, 5e-7);
            let moved = simulate(&struck, &schedule).unwrap().trajectory.displacement_m;
            let bodies = (1..=7).map(|k| 5 * view as usize + k).map(|body| {
                let rest_m = 0.03 * body as f64;
                let at = |time_s: f64| {
                    let place = ((time_s - impact_s) / 5e-7).max(0.0);
                    let (left, share) = (place as usize, place.fract());
                    (1.0 - share) * moved[(body - 1, left)] + share * moved[(body - 1, left + 1)]
                };
                let position =
                    |time_s: &f64| Some(Estimate::new(rest_m + at(*time_s) + normal(noise_m), noise_m));
                BodyTrack { body, position_m: times_s.iter().map(position).collect() }
            });
            let bodies = bodies.collect();
            let recording = format!("view{view}_trial{trial}");
            made.observations.push(Observation { recording, view, trial, times_s, bodies });
            made.impacts_s.push(impact_s);
            made.strikers.push(striker);
        }
    }
    made
}

pub(crate) fn fitted(experiment: &Experiment, model: &TrackModel) -> TrackFit {
    fit_tracks(&experiment.observations, &[0.0; 4], model, None).unwrap()
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
