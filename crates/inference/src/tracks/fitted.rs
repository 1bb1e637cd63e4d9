//! The motion that a fitted chain model gives.

use chainwave_measurement::{Trajectory, map_in_parallel};
use chainwave_mechanics::{Chain, Resistance, Schedule, Sensitivities, simulate, simulate_with_resistance};
use nalgebra::DVector;
use ndarray::Array2;

use super::family::{Family, Struck};
use super::outcome::TrackFit;
use super::residuals::{SAMPLES_PER_FRAME, range_of, struck};
use super::resistances::resistance;
use crate::error::FitError;

/// The mean motion over the recordings' strikers at their mean impact, which is what stitching estimates.
///
/// # Errors
/// [`FitError::Model`] when the chain model refuses the values.
pub fn fitted_motion(fit: &TrackFit, times_s: &[f64]) -> Result<Trajectory, FitError> {
    let model = &fit.model;
    let impact_time_s = fit.impact_time_s.value;
    let strikers: Vec<f64> = fit.recordings.iter().map(|one| one.striker_velocity_m_per_s.value).collect();
    let moved = fit.factors.iter().chain(&fit.found);
    let resistance = resistance(moved.map(|(quantity, found)| (*quantity, found.value)));
    let struck = fitted_struck(fit)?;
    let span_s = (times_s.last().copied().unwrap_or(0.0) - impact_time_s).max(f64::MIN_POSITIVE);
    let interval_s = span_s / (times_s.len().max(2) - 1) as f64 / SAMPLES_PER_FRAME;
    let schedule = Schedule::automatic(span_s + 2.0 * interval_s, interval_s);
    let family = Family::new(range_of(&strikers, model));
    let struck: Vec<Chain> = (0..family.n_nodes()).map(|node| family.struck(node, &struck)).collect();
    // The mean of the strikers' motions is that of their weights.
    let weights: Vec<_> =
        strikers.iter().map(|velocity_m_per_s| family.weights(*velocity_m_per_s).0).collect();
    let of_node =
        |k: usize| weights.iter().map(|of_striker| of_striker[k]).sum::<f64>() / weights.len() as f64;
    let n_bodies = model.chain.n_bodies();
    let mut mean = Trajectory {
        times_s: times_s.to_vec(),
        displacement_m: Array2::zeros((n_bodies, times_s.len())),
        velocity_m_per_s: Array2::zeros((n_bodies, times_s.len())),
    };
    let motions =
        map_in_parallel(struck.len(), model.n_threads, |k| resisted(&struck[k], &schedule, resistance));
    for (k, motion) in motions.into_iter().enumerate() {
        let (motion, weight) = (motion?, of_node(k));
        // As pictures show it: from where the bodies were held.
        let held_m = motion.displacement_m.column(0);
        for (i, time_s) in times_s.iter().enumerate() {
            let Some(moment) = motion.at(time_s - impact_time_s) else { continue };
            for body in 0..n_bodies {
                mean.displacement_m[(body, i)] += weight * (moment.displacement_m(body) - held_m[body]);
                mean.velocity_m_per_s[(body, i)] += weight * moment.velocity_m_per_s(body);
            }
        }
    }
    Ok(mean)
}

/// The chain with the values that a fit found, but for what resists its bodies besides damping.
///
/// # Errors
/// [`FitError::NoStriker`] of a chain that is not struck.
pub fn fitted_chain(fit: &TrackFit) -> Result<Chain, FitError> {
    Ok(fitted_struck(fit)?.chain)
}

fn fitted_struck(fit: &TrackFit) -> Result<Struck, FitError> {
    let mut shared =
        vec![fit.damping.chain_damping_kg_per_s.value, fit.damping.striker_damping_kg_per_s.value];
    let moved = || fit.factors.iter().chain(&fit.found);
    shared.extend(moved().map(|(_, found)| found.value));
    struck(&fit.model, &DVector::from_vec(shared), moved().map(|(quantity, _)| *quantity))
}

/// The motion of a chain, with what resists its bodies.
fn resisted(chain: &Chain, schedule: &Schedule, resistance: Resistance) -> Result<Trajectory, FitError> {
    if resistance == Resistance::default() {
        return Ok(simulate(chain, schedule)?.trajectory);
    }
    let Sensitivities { simulation, derivatives } =
        simulate_with_resistance(chain, schedule, &[], &[resistance])?;
    let mut motion = simulation.trajectory;
    for added in &derivatives {
        motion.displacement_m += &added.displacement_m;
        motion.velocity_m_per_s += &added.velocity_m_per_s;
    }
    Ok(motion)
}
