//! The ladder of integrators on an experiment's chain.

use std::path::Path;

use chainwave_experiment::Experiment;
use chainwave_mechanics::{Integration, Method, Schedule, simulate};

use super::Rung;
use super::simulations::ladder;
use crate::error::Error;

/// Steps of the methods that take constant ones, in seconds: 1/90 to 1/1400 of the shortest period of the paper's chain.
const STEPS_S: [f64; 5] = [2e-5, 1e-5, 5e-6, 2.5e-6, 1.25e-6];
/// Accuracies of the methods that choose their own steps.
const ACCURACIES: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
/// Accuracy of the simulation that stands for the truth.
const REFERENCE: f64 = 1e-12;

/// Every integrator on an experiment's chain, while the wave crosses it.
pub(super) fn of_experiment(path: &Path) -> Result<Vec<Rung>, Error> {
    let experiment = Experiment::read(path)?;
    let chain = experiment.chain_model()?;
    let crossing_s = experiment.linear_chain()?.crossing_time_s(chain.n_bodies());
    let n_outputs = (1.5 * crossing_s / OUTPUT_INTERVAL_S).ceil();
    let schedule = |integration| Schedule {
        integration,
        ..Schedule::automatic(n_outputs * OUTPUT_INTERVAL_S, OUTPUT_INTERVAL_S)
    };
    let reference = Integration::Accuracy { method: Method::Dop853, accuracy: REFERENCE };
    let truth = simulate(&chain, &schedule(reference))?.trajectory;
    // A method that is not for this chain, or a step beyond its stability bound, is no rung here.
    Ok(ladder("integrator", &truth, settings(), |integration| {
        let found = simulate(&chain, &schedule(*integration)).ok()?;
        Some((found.method.into(), found.trajectory))
    }))
}

/// Interval between outputs: that of frames at 25 kHz.
const OUTPUT_INTERVAL_S: f64 = 4e-5;

/// Constant steps down the ladder, then the accuracies of what chooses its own steps.
fn settings() -> Vec<(String, Integration)> {
    let steps = |method| {
        STEPS_S.map(|dt_s| (format!("dt = {dt_s:e} s"), Integration::Steps { method, dt_s })).to_vec()
    };
    let accuracies = |method| {
        let named =
            |accuracy| (format!("accuracy = {accuracy:e}"), Integration::Accuracy { method, accuracy });
        ACCURACIES.map(named).to_vec()
    };
    let (adaptive, constant): (Vec<Method>, Vec<Method>) =
        Method::LADDER.into_iter().partition(|method| method.is_adaptive());
    constant.into_iter().flat_map(steps).chain(adaptive.into_iter().flat_map(accuracies)).collect()
}
