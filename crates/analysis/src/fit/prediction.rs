use chainwave_measurement::{Trajectory, map_in_parallel};
use chainwave_mechanics::{
    Chain, Change, Drive, Schedule, Sensitivities, Striker, simulate_with_sensitivities,
};
use ndarray::Array2;

use super::{EnergyModel, FitError, Quantity};

/// c_d, c_s, the striker's velocity, and the scale of the drives' deviations; factors on what is known within an uncertainty follow.
pub(super) const N_UNKNOWNS: usize = 4;

/// What the fit varies.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parameters {
    pub(super) chain_damping_kg_per_s: f64,
    pub(super) striker_damping_kg_per_s: f64,
    pub(super) striker_velocity_m_per_s: f64,
    /// Factor on the deviations of the recordings' drives.
    pub(super) drive_scale: f64,
    /// Factors on the model's quantities that are known within an uncertainty.
    pub(super) factors: Vec<f64>,
}

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
    /// The prediction and its derivatives by the unknowns; `steps` says how far the chains on both sides of each are from it, and none
    /// asks for no derivatives.
    pub(super) fn with_slopes(
        model: &EnergyModel,
        parameters: &Parameters,
        times: Times<'_>,
        steps: &[f64],
    ) -> Result<(Self, Vec<Self>), FitError> {
        let runs = quadrature(&model.drive_deviations);
        let solved = map_in_parallel(runs.len(), model.n_threads, |i| {
            let chain = |parameters: &Parameters| with_parameters(model, parameters, runs[i].1);
            let change = |(unknown, step): (usize, &f64)| -> Result<Change, FitError> {
                let side = |step: f64| chain(&parameters.moved(unknown, step));
                Ok(Change { below: side(-step)?, above: side(*step)?, width: 2.0 * step })
            };
            let changes = steps.iter().enumerate().map(change).collect::<Result<Vec<_>, _>>()?;
            let found = simulate_with_sensitivities(&chain(parameters)?, &times.schedule, &changes)?;
            Ok::<_, FitError>((runs[i].0, found))
        });
        let solved = solved.into_iter().collect::<Result<Vec<_>, _>>()?;
        let scale = picture_scale(model, parameters);
        let mean = |of_run: &dyn Fn(&Sensitivities) -> &Trajectory| {
            let mut mean = Self::zero(model.chain.n_bodies(), times.measured_s);
            for (weight, found) in &solved {
                mean.add(weight * scale, of_run(found), &found.simulation.peak_times_s);
            }
            mean
        };
        let here = mean(&|found| &found.simulation.trajectory);
        let mut slopes: Vec<Self> =
            (0..steps.len()).map(|unknown| mean(&|found| &found.derivatives[unknown])).collect();
        for (known, slope) in model.known.iter().zip(slopes.iter_mut().skip(N_UNKNOWNS)) {
            if known.quantity == Quantity::Scale {
                *slope = here.scaled(scale.recip());
            }
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

impl Parameters {
    /// With one of the unknowns moved.
    fn moved(&self, unknown: usize, step: f64) -> Self {
        let mut moved = self.clone();
        match unknown {
            0 => moved.chain_damping_kg_per_s += step,
            1 => moved.striker_damping_kg_per_s += step,
            2 => moved.striker_velocity_m_per_s += step,
            3 => moved.drive_scale += step,
            _ => moved.factors[unknown - N_UNKNOWNS] += step,
        }
        moved
    }
}

/// Length in the pictures over true length.
fn picture_scale(model: &EnergyModel, parameters: &Parameters) -> f64 {
    let known = model.known.iter().zip(&parameters.factors);
    known.filter(|(known, _)| known.quantity == Quantity::Scale).map(|(_, factor)| factor).product()
}

/// Weights and nodes of the two-point Gauss quadrature whose mean, mean square and mean cube are those of the deviations from
/// their mean; one node where they do not scatter.
pub(super) fn quadrature(deviations: &[f64]) -> Vec<(f64, f64)> {
    let n = deviations.len().max(1) as f64;
    let mean = deviations.iter().sum::<f64>() / n;
    let moment =
        |power: i32| deviations.iter().map(|deviation| (deviation - mean).powi(power)).sum::<f64>() / n;
    let sigma = moment(2).sqrt();
    if sigma < 1e-12 {
        return vec![(1.0, mean)];
    }
    let skewness = moment(3) / sigma.powi(3);
    let root = (skewness * skewness + 4.0).sqrt();
    let (low, high) = (0.5 * (skewness - root), 0.5 * (skewness + root));
    vec![(high / root, mean + sigma * low), (-low / root, mean + sigma * high)]
}

/// The chain with trial values in place, struck by one of the drives; negative dampings are mirrored, so the search may step across
/// zero.
fn with_parameters(
    model: &EnergyModel,
    parameters: &Parameters,
    drive_deviation: f64,
) -> Result<Chain, FitError> {
    let Drive::Striker(striker) = &model.chain.drive else { return Err(FitError::NoStriker) };
    let n_bodies = model.chain.n_bodies();
    let damping_kg_per_s = vec![parameters.chain_damping_kg_per_s.abs(); n_bodies];
    let mut chain = Chain { damping_kg_per_s, ..model.chain.clone() };
    let faster = 1.0 + parameters.drive_scale * drive_deviation;
    let mut striker = Striker {
        velocity_m_per_s: parameters.striker_velocity_m_per_s * faster,
        damping_kg_per_s: parameters.striker_damping_kg_per_s.abs(),
        ..*striker
    };
    for (known, factor) in model.known.iter().zip(&parameters.factors) {
        known.quantity.apply(*factor, &mut chain, &mut striker);
    }
    Ok(Chain { drive: Drive::Striker(striker), ..chain })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quadrature_has_the_first_three_moments() {
        let deviations = [0.01, -0.02, 0.03, 0.0, -0.005];
        let nodes = quadrature(&deviations);
        for power in 0..=3 {
            let wanted = deviations.iter().map(|x: &f64| (x - 0.003).powi(power)).sum::<f64>() / 5.0;
            let found: f64 = nodes.iter().map(|(weight, x)| weight * (x - 0.003).powi(power)).sum();
            // Rounding of terms of at most 1.
            assert!((found - wanted).abs() < 1e-15, "moment {power}");
        }
        assert_eq!(quadrature(&[0.0, 0.0]), vec![(1.0, 0.0)]);
    }
}
