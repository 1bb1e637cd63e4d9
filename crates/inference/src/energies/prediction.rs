//! Peak energies of the chain model: its mean motion over the drives, and how that changes with the unknowns.

use chainwave_measurement::{Trajectory, map_in_parallel};
use chainwave_mechanics::{
    Chain, Change, Drive, Schedule, Sensitivities, Striker, simulate_with_sensitivities,
};
use nalgebra::DVector;
use ndarray::Array2;

use super::model::EnergyModel;
use crate::damping::{N_DAMPINGS, damping_like};
use crate::error::FitError;
use crate::priors::PriorFactors;
use crate::quadrature::quadrature;

/// Unknowns of every fit: c_d, c_s, the striker's velocity, and the scale of the drives' deviations; factors on what is known within an
/// uncertainty follow.
pub(super) const N_ALWAYS: usize = N_DAMPINGS + 2;
/// Where the striker's velocity stands.
pub(super) const VELOCITY: usize = N_DAMPINGS;
/// Where the scale of the drives' deviations stands.
pub(super) const DRIVE_SCALE: usize = N_DAMPINGS + 1;

/// A step down and a step up in an unknown.
pub(super) type Beside = [f64; 2];

/// The model's answer: the weighted mean of its runs at a slower and a faster drive, as the pictures show it; or how that changes with
/// an unknown.
#[derive(Debug, Clone)]
pub(super) struct Prediction {
    /// Motion at the measured times after the impact, at rest before it.
    pub(super) motion: Trajectory,
    /// Overlap of each gap when it is closed the most, filmed or not, in metres.
    pub(super) peak_overlaps_m: Vec<f64>,
}

/// When the model is asked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Times<'a> {
    /// The measured times, in seconds.
    pub(super) measured_s: &'a [f64],
    /// How the simulations go, and how far beyond them.
    pub(super) schedule: Schedule,
}

impl Prediction {
    /// The prediction and its derivatives by the unknowns; `beside` says how far the chains on both sides of each are from it.
    pub(super) fn with_slopes(
        model: &EnergyModel,
        unknowns: &DVector<f64>,
        times: Times<'_>,
        beside: &[Beside],
    ) -> Result<(Self, Vec<Self>), FitError> {
        let runs = quadrature(&model.drive_deviations);
        let solved = map_in_parallel(runs.len(), model.n_threads, |i| {
            let chain = |unknowns: &DVector<f64>| with_values(model, unknowns, runs[i].1);
            let change = |(unknown, steps): (usize, &Beside)| -> Result<Change, FitError> {
                let [below, above] = steps.map(|step| {
                    let mut moved = unknowns.clone();
                    moved[unknown] += step;
                    chain(&moved)
                });
                Ok(Change { below: below?, above: above?, width: steps[1] - steps[0] })
            };
            let changes = beside.iter().enumerate().map(change).collect::<Result<Vec<_>, _>>()?;
            let found = simulate_with_sensitivities(&chain(unknowns)?, &times.schedule, &changes)?;
            Ok::<_, FitError>((runs[i].0, found))
        });
        let solved = solved.into_iter().collect::<Result<Vec<_>, _>>()?;
        let scale = priors_of(model).picture_scale(unknowns);
        let mean = |of_run: &dyn Fn(&Sensitivities) -> &Trajectory| {
            let mut mean = Self::zero(model.chain.n_bodies(), times.measured_s);
            for (weight, found) in &solved {
                mean.add(weight * scale, of_run(found), &found.simulation.peak_times_s);
            }
            mean
        };
        let here = mean(&|found| &found.simulation.trajectory);
        let mut slopes: Vec<Self> =
            (0..beside.len()).map(|unknown| mean(&|found| &found.derivatives[unknown])).collect();
        for (_, slope) in slopes.iter_mut().enumerate().filter(|(i, _)| priors_of(model).is_picture_scale(*i))
        {
            *slope = here.scaled(scale.recip());
        }
        Ok((here, slopes))
    }

    /// The prediction where an unknown lies `step` farther, along its derivative.
    pub(super) fn along(&self, slope: &Self, step: f64) -> Self {
        let mut moved = self.clone();
        moved.motion.displacement_m.scaled_add(step, &slope.motion.displacement_m);
        moved.motion.velocity_m_per_s.scaled_add(step, &slope.motion.velocity_m_per_s);
        let overlaps = moved.peak_overlaps_m.iter_mut().zip(&slope.peak_overlaps_m);
        overlaps.for_each(|(overlap_m, slope)| *overlap_m += step * slope);
        moved
    }

    fn zero(n_bodies: usize, times_s: &[f64]) -> Self {
        let rest = Array2::zeros((n_bodies, times_s.len()));
        let motion =
            Trajectory { times_s: times_s.to_vec(), displacement_m: rest.clone(), velocity_m_per_s: rest };
        Self { motion, peak_overlaps_m: vec![0.0; n_bodies.saturating_sub(1)] }
    }

    fn scaled(&self, factor: f64) -> Self {
        let zero = Self::zero(self.motion.displacement_m.nrows(), &self.motion.times_s);
        zero.along(self, factor)
    }

    fn add(&mut self, share: f64, run: &Trajectory, peak_times_s: &[Option<f64>]) {
        for (i, time_s) in self.motion.times_s.iter().enumerate() {
            let Some(moment) = run.at(*time_s) else { continue };
            for body in 0..self.motion.displacement_m.nrows() {
                self.motion.displacement_m[(body, i)] += share * moment.displacement_m(body);
                self.motion.velocity_m_per_s[(body, i)] += share * moment.velocity_m_per_s(body);
            }
        }
        let last_s = run.times_s.last().copied().unwrap_or(0.0);
        for (gap, (overlap_m, peak_s)) in self.peak_overlaps_m.iter_mut().zip(peak_times_s).enumerate() {
            let Some(moment) = run.at(peak_s.unwrap_or(last_s).min(last_s)) else { continue };
            *overlap_m += share * (moment.displacement_m(gap) - moment.displacement_m(gap + 1));
        }
    }
}

/// The factors on what is known within an uncertainty.
pub(super) fn priors_of(model: &EnergyModel) -> PriorFactors<'_> {
    PriorFactors::new(&model.priors, N_ALWAYS)
}

/// The chain with trial values in place, struck by one of the drives.
fn with_values(
    model: &EnergyModel,
    unknowns: &DVector<f64>,
    drive_deviation: f64,
) -> Result<Chain, FitError> {
    let Drive::Striker(striker) = &model.chain.drive else { return Err(FitError::NoStriker) };
    let damping_kg_per_s = damping_like(&model.chain, unknowns[0]);
    let mut chain = Chain { damping_kg_per_s, ..model.chain.clone() };
    let mut striker = Striker {
        velocity_m_per_s: unknowns[VELOCITY] * (1.0 + unknowns[DRIVE_SCALE] * drive_deviation),
        damping_kg_per_s: unknowns[1],
        ..*striker
    };
    priors_of(model).apply(unknowns, &mut chain, &mut striker);
    Ok(Chain { drive: Drive::Striker(striker), ..chain })
}
