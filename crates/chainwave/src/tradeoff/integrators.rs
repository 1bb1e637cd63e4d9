use std::time::Instant;

use chainwave_mechanics::{Chain, Integration, Method, Schedule, Simulation, simulate};

use super::Rung;
use crate::error::Error;
use crate::progress;
use crate::run::Job;

/// Steps of the methods that take constant ones, in seconds: 1/90 to 1/1400 of the shortest period of the paper's chain.
const STEPS_S: [f64; 5] = [2e-5, 1e-5, 5e-6, 2.5e-6, 1.25e-6];
/// Accuracies of the methods that choose their own steps.
const ACCURACIES: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
/// Accuracy of the simulation that stands for the truth.
const REFERENCE: f64 = 1e-12;
/// Repetitions of which the shortest counts.
const REPETITIONS: usize = 3;

/// Every integrator on an experiment's chain, while the wave crosses it.
pub(super) fn of_experiment(job: &Job) -> Result<Vec<Rung>, Error> {
    let chain = job.chain()?;
    let pitches_per_s = (job.experiment.contact.power_law()?.k_0_n_per_m() / chain.mass_kg[0]).sqrt();
    let frame_s = OUTPUT_INTERVAL_S;
    ladder(&chain, (1.5 * chain.n_bodies() as f64 / pitches_per_s / frame_s).ceil() * frame_s, frame_s)
}

/// Interval between outputs: that of frames at 25 kHz.
const OUTPUT_INTERVAL_S: f64 = 4e-5;

/// Every integrator on the experiment's chain: its largest error of a displacement over the largest displacement, and the time
/// of one simulation.
fn ladder(chain: &Chain, duration_s: f64, output_interval_s: f64) -> Result<Vec<Rung>, Error> {
    let schedule =
        |integration| Schedule { integration, ..Schedule::automatic(duration_s, output_interval_s) };
    let truth =
        simulate(chain, &schedule(Integration::Accuracy { method: Method::Dop853, accuracy: REFERENCE }))?;
    let constant = Method::LADDER.into_iter().filter(|method| !method.is_adaptive());
    let mut settings: Vec<(String, Integration)> = Vec::new();
    for method in constant {
        let steps = STEPS_S.map(|dt_s| (format!("dt = {dt_s:e} s"), Integration::Steps { method, dt_s }));
        settings.extend(steps);
    }
    for method in Method::LADDER.into_iter().filter(|method| method.is_adaptive()) {
        let accuracies = ACCURACIES
            .map(|accuracy| (format!("accuracy = {accuracy:e}"), Integration::Accuracy { method, accuracy }));
        settings.extend(accuracies);
    }
    let bar = progress::bar("integrators", settings.len() as u64);
    let mut rungs = Vec::with_capacity(settings.len());
    for (settings, integration) in settings {
        bar.inc(1);
        // A method that is not for this chain, or a step beyond its stability bound, is no rung here.
        let Some((found, seconds_per_item)) = timed(chain, &schedule(integration)) else { continue };
        rungs.push(Rung {
            step: "integrator",
            method: found.method.into(),
            settings,
            error: distance(&found, &truth),
            error_unit: "of largest displacement",
            seconds_per_item,
            items: REPETITIONS as u64,
        });
    }
    bar.finish_and_clear();
    Ok(rungs)
}

/// A simulation and the time that it takes, in seconds.
fn timed(chain: &Chain, schedule: &Schedule) -> Option<(Simulation, f64)> {
    let mut best: Option<(Simulation, f64)> = None;
    for _ in 0..REPETITIONS {
        let start = Instant::now();
        let found = simulate(chain, schedule).ok()?;
        let seconds = start.elapsed().as_secs_f64();
        if best.as_ref().is_none_or(|(_, shortest)| seconds < *shortest) {
            best = Some((found, seconds));
        }
    }
    best
}

/// Largest difference of displacements over the largest displacement.
fn distance(found: &Simulation, truth: &Simulation) -> f64 {
    let (found, truth) = (&found.trajectory.displacement_m, &truth.trajectory.displacement_m);
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |most, value| most.max(value.abs()));
    largest(&mut found.iter().zip(truth).map(|(a, b)| a - b)) / largest(&mut truth.iter().copied())
}
