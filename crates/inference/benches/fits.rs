//! Time of the fits to an experiment of the paper's size: 26 bodies, five views of six, five trials each, 540 frames.

use std::hint::black_box;
use std::num::NonZero;

use chainwave_inference::{FitError, TrackModel, fit_tracks, scatter_of_bodies};
use chainwave_measurement::{BodyTrack, Estimate, Observation, Trajectory};
use chainwave_mechanics::{Chain, Drive, MechanicsError, Schedule, Striker, simulate};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

fn main() {
    divan::main();
}

const N_BODIES: usize = 26;
const FRAME_S: f64 = 4e-5;
const N_FRAMES: i32 = 540;
const NOISE_M: f64 = 0.4e-6;
const VELOCITY: Estimate = Estimate { value: 2.73, sigma: 0.05 };

fn chain(velocity_m_per_s: f64) -> Chain {
    Chain {
        drive: Drive::Striker(Striker { velocity_m_per_s, ..Striker::OF_RINGS }),
        ..Chain::of_rings(N_BODIES)
    }
}

fn moved(velocity_m_per_s: f64) -> Result<Trajectory, MechanicsError> {
    Ok(simulate(&chain(velocity_m_per_s), &Schedule::automatic(0.022, FRAME_S))?.trajectory)
}

fn observations() -> Result<Vec<Observation>, MechanicsError> {
    let mut random = Pcg64::seed_from_u64(1);
    let mut normal = |sigma: f64| -> f64 { sigma * random.sample::<f64, _>(StandardNormal) };
    let mut observations = Vec::new();
    for (view, trial) in (0..5_u32).flat_map(|view| (0..5).map(move |trial| (view, trial))) {
        let motion = moved(VELOCITY.value + normal(VELOCITY.sigma))?;
        let (impact_s, times_s) = (normal(1e-5), (-40..N_FRAMES - 40).map(|k| f64::from(k) * FRAME_S));
        let times_s: Vec<f64> = times_s.collect();
        let bodies = (1..=6).map(|k| 5 * view as usize + k).map(|body| {
            let place_m = |t_s: &f64| {
                let at = motion.at(t_s - impact_s).map(|moment| moment.displacement_m(body - 1));
                Some(Estimate::new(at? + normal(NOISE_M), NOISE_M))
            };
            BodyTrack { body, position_m: times_s.iter().map(place_m).collect() }
        });
        let bodies = bodies.collect();
        observations.push(Observation { recording: format!("{view}-{trial}"), view, trial, times_s, bodies });
    }
    Ok(observations)
}

fn model() -> TrackModel {
    TrackModel {
        chain: chain(VELOCITY.value),
        striker_velocity_m_per_s: VELOCITY,
        priors: Vec::new(),
        reading_errors: Vec::new(),
        usual_errors: Vec::new(),
        n_threads: NonZero::<usize>::MIN,
    }
}

fn prepared() -> Result<(Vec<Observation>, TrackModel), FitError> {
    Ok((observations()?, model()))
}

/// Three starts, intervals by profile likelihood, bootstrap over the 25 trials.
#[divan::bench(sample_count = 3)]
fn fit_to_the_tracks(bencher: divan::Bencher<'_, '_>) {
    if let Ok((observations, model)) = prepared() {
        bencher.bench(|| fit_tracks(black_box(&observations), &[0.0; 25], &model, None));
    }
}

/// A mass of its own for each of 26 bodies.
#[divan::bench(sample_count = 3)]
fn test_of_scatter(bencher: divan::Bencher<'_, '_>) {
    if let Ok((observations, model)) = prepared()
        && let Ok(fit) = fit_tracks(&observations, &[0.0; 25], &model, None)
    {
        bencher.bench(|| scatter_of_bodies(black_box(&observations), &fit));
    }
}
