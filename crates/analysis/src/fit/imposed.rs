use std::num::NonZero;
use std::sync::atomic::{AtomicU64, Ordering};

use chainwave_measurement::{ChainMotion, Estimate, map_in_parallel};
use chainwave_mechanics::{
    Chain, Change, Drive, ImposedMotion, Schedule, Striker, simulate_with_sensitivities,
};
use nalgebra::{DMatrix, DVector};
use ndarray::Array2;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::FitError;
use super::prediction::quadrature;
use super::quantity::{Known, Quantity};

/// What is assumed of the chain behind body 1.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedModel {
    /// The chain; its damping is the starting value, and its drive stands back behind the measured motion of body 1.
    pub chain: Chain,
    /// Quantities that are known only within an uncertainty; the others count as exact.
    pub known: Vec<Known>,
    /// Drive of each recording behind the motion, relative to the mean drive, less one.
    pub drive_deviations: Vec<f64>,
    /// Threads that carry the simulations; the result does not depend on their number.
    pub n_threads: NonZero<usize>,
}

/// Damping of the chain fitted to the motion behind body 1. The striker's contact does not act on it, so c_s is not identifiable.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedFit {
    /// c_d.
    pub chain_damping_kg_per_s: Estimate,
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
    /// Sum of squared residuals, relative to the samples' total sigma, over their number.
    pub reduced_chi_squared: f64,
    /// Displacements compared.
    pub n_residuals: usize,
    /// Chain simulations carried out.
    pub n_simulations: u64,
}

impl ImposedFit {
    /// Why it gives no c_s.
    pub const NO_STRIKER_DAMPING: &'static str = "not identifiable: the measured motion of body 1 drives the chain, and the striker's contact acts on no other body";
}

const MAX_ROUNDS: usize = 20;
/// A step shorter than a hundredth of a standard error changes nothing.
const CONVERGED_LENGTH2: f64 = 1e-4;
/// Draws of body 1's noise, whose effect is known to 1/sqrt(2 n).
const N_DRAWS: usize = 50;
const SEED: u64 = 1;

/// Fits c_d to the displacement field of a motion, whose body 1 drives the chain as it was measured.
///
/// The motion is a mean over drives, and so is the model's, by the quadrature that the fit to the peak energies uses, with body 1 in
/// proportion to the drive. Samples are weighted by their independent noise; the errors that many of them share (the motion's modes)
/// and the noise of body 1 itself, which the model passes on, go through the estimator into the uncertainty.
///
/// # Errors
/// [`FitError`] as its variants say.
pub fn fit_imposed(motion: &ChainMotion, model: &ImposedModel) -> Result<ImposedFit, FitError> {
    let problem = Problem::new(motion, model)?;
    let mut unknowns = problem.start();
    for _ in 0..MAX_ROUNDS {
        let asked: Vec<Asked<'_>> = (0..unknowns.len()).map(Asked::Unknown).collect();
        let (predicted, columns) = problem.predicted(&unknowns, &asked)?;
        let jacobian = DMatrix::from_columns(&columns);
        let (normal, side) = problem.equations(&jacobian, &predicted, &unknowns);
        let covariance = normal.cholesky().ok_or_else(undetermined)?.inverse();
        let step = &covariance * &side;
        let length2 = side.dot(&step);
        unknowns += &step;
        unknowns[0] = unknowns[0].max(0.0);
        if length2 < CONVERGED_LENGTH2 {
            return problem.finish(&unknowns, (&predicted, &jacobian), &covariance);
        }
    }
    Err(FitError::NotConverged(format!("{MAX_ROUNDS} rounds did not settle")))
}

fn undetermined() -> FitError {
    FitError::NotConverged("the motion behind body 1 does not determine the damping".into())
}

/// Errors of body 1 that go through one simulation.
const TOGETHER: usize = 8;

/// Values of the unknowns, and a motion of body 1.
type Moved = (DVector<f64>, Vec<f64>);

/// What the prediction's derivative is asked by.
enum Asked<'a> {
    /// An unknown.
    Unknown(usize),
    /// An error of body 1, sample by sample, in metres.
    Driving(&'a [f64]),
}

struct Problem<'a> {
    motion: &'a ChainMotion,
    model: &'a ImposedModel,
    /// First and last sample at which body 1 was seen.
    span: (usize, usize),
    driving_m: Vec<f64>,
    nodes: Vec<(f64, f64)>,
    schedule: Schedule,
    /// Samples compared: row and time, within the span.
    samples: Vec<(usize, usize)>,
    n_simulations: AtomicU64,
}

impl<'a> Problem<'a> {
    fn new(motion: &'a ChainMotion, model: &'a ImposedModel) -> Result<Self, FitError> {
        const LEAST: usize = 100;
        let seen = |k: &usize| motion.displacement_m[(0, *k)].is_some();
        let n_times = motion.times_s.len();
        let (first, last) = ((0..n_times).find(seen).unwrap_or(0), (0..n_times).rfind(seen).unwrap_or(0));
        let driving_m: Vec<f64> =
            (first..=last).filter_map(|k| Some(motion.displacement_m[(0, k)]?.value)).collect();
        if driving_m.len() != last + 1 - first || driving_m.len() < LEAST {
            return Err(FitError::TooFew {
                what: "samples of body 1 without a hole",
                expected: (last + 1 - first).max(LEAST),
                found: driving_m.len(),
            });
        }
        if model.chain.n_bodies() != motion.n_bodies() {
            let (expected, found) = (motion.n_bodies(), model.chain.n_bodies());
            return Err(FitError::TooFew { what: "bodies in the model", expected, found });
        }
        let rows = 1..motion.n_bodies();
        let told = |(row, k): &(usize, usize)| {
            motion.displacement_m[(*row, *k)].is_some() && motion.independent_sigma_m[(*row, *k)] > 0.0
        };
        let samples: Vec<(usize, usize)> =
            rows.flat_map(|row| (first..=last).map(move |k| (row, k))).filter(told).collect();
        if samples.len() < LEAST {
            return Err(FitError::TooFew { what: "positions", expected: LEAST, found: samples.len() });
        }
        let interval_s = (motion.times_s[last] - motion.times_s[first]) / (last - first) as f64;
        let schedule = Schedule::automatic(interval_s * (last - first) as f64, interval_s);
        let nodes = quadrature(&model.drive_deviations);
        let n_simulations = AtomicU64::new(0);
        Ok(Self { motion, model, span: (first, last), driving_m, nodes, schedule, samples, n_simulations })
    }

    fn start(&self) -> DVector<f64> {
        let chain = &self.model.chain;
        let mut start = vec![chain.damping_kg_per_s.iter().sum::<f64>() / chain.n_bodies() as f64];
        start.resize(1 + self.model.known.len(), 1.0);
        DVector::from_vec(start)
    }

    /// Displacements at the samples compared, and their derivatives by what is asked.
    fn predicted(
        &self,
        unknowns: &DVector<f64>,
        asked: &[Asked<'_>],
    ) -> Result<(DVector<f64>, Vec<DVector<f64>>), FitError> {
        let scale = self.picture_scale(unknowns);
        let mut sum = DVector::zeros(self.samples.len());
        let mut derivatives = vec![sum.clone(); asked.len()];
        for (weight, deviation) in &self.nodes {
            let change = |asked: &Asked<'_>| -> Result<Change, FitError> {
                let steps = self.steps(unknowns, asked);
                let [below, above] =
                    steps.map(|step| self.chain(&self.moved(unknowns, asked, step), *deviation));
                Ok(Change { below: below?, above: above?, width: steps[1] - steps[0] })
            };
            let changes = asked.iter().map(change).collect::<Result<Vec<_>, _>>()?;
            let here = self.chain(&(unknowns.clone(), self.driving_m.clone()), *deviation)?;
            let found = simulate_with_sensitivities(&here, &self.schedule, &changes)?;
            self.n_simulations.fetch_add(1, Ordering::Relaxed);
            let moved_m = &found.simulation.trajectory.displacement_m;
            self.add(&mut sum, moved_m, weight * scale);
            for ((derivative, found), asked) in derivatives.iter_mut().zip(&found.derivatives).zip(asked) {
                self.add(derivative, &found.displacement_m, weight * scale);
                if self.is_scale(asked) {
                    self.add(derivative, moved_m, *weight);
                }
            }
        }
        Ok((sum, derivatives))
    }

    /// Adds the samples compared of a motion since body 1 was first seen.
    fn add(&self, sum: &mut DVector<f64>, moved_m: &Array2<f64>, weight: f64) {
        let last = moved_m.ncols().saturating_sub(1);
        for (entry, (row, k)) in sum.iter_mut().zip(&self.samples) {
            *entry += weight * moved_m[(*row, (k - self.span.0).min(last))];
        }
    }

    /// The chain with trial values in place, behind a motion of body 1 at one of the drives.
    fn chain(&self, (unknowns, driving_m): &Moved, deviation: f64) -> Result<Chain, FitError> {
        let n = self.model.chain.n_bodies();
        let mut chain = Chain { damping_kg_per_s: vec![unknowns[0]; n], ..self.model.chain.clone() };
        // Quantities of the striker change nothing here.
        let mut striker = Striker { mass_kg: 1.0, velocity_m_per_s: 0.0, damping_kg_per_s: 0.0 };
        for (known, factor) in self.model.known.iter().zip(unknowns.iter().skip(1)) {
            known.quantity.apply(*factor, &mut chain, &mut striker);
        }
        let first_s = self.motion.times_s[self.span.0];
        let times_s = (self.span.0..=self.span.1).map(|k| self.motion.times_s[k] - first_s).collect();
        let share = (1.0 + deviation) / self.picture_scale(unknowns);
        let driven_m = driving_m.iter().map(|x_m| x_m * share).collect();
        chain.drive = Drive::Imposed(ImposedMotion::from_samples(times_s, driven_m)?);
        Ok(chain)
    }

    fn is_scale(&self, asked: &Asked<'_>) -> bool {
        let of_unknown = |unknown: usize| self.model.known.get(unknown.checked_sub(1)?);
        match asked {
            Asked::Unknown(unknown) => {
                of_unknown(*unknown).is_some_and(|known| known.quantity == Quantity::Scale)
            }
            Asked::Driving(_) => false,
        }
    }

    /// Length in the pictures over true length.
    fn picture_scale(&self, unknowns: &DVector<f64>) -> f64 {
        let known = self.model.known.iter().zip(unknowns.iter().skip(1));
        known.filter(|(known, _)| known.quantity == Quantity::Scale).map(|(_, factor)| factor).product()
    }

    /// How far the chains on both sides of what is asked are from it: a thousandth of one per cent of critical, but no farther than to
    /// no damping; a part of a factor; or all of an error, to which the chain responds in proportion.
    fn steps(&self, unknowns: &DVector<f64>, asked: &Asked<'_>) -> [f64; 2] {
        match asked {
            Asked::Unknown(0) => {
                let chain = &self.model.chain;
                let step = 1e-5 * 2.0 * (chain.contact.k_0_n_per_m() * chain.mass_kg[0]).sqrt();
                [-step.min(unknowns[0]), step]
            }
            Asked::Unknown(_) => [-1e-4, 1e-4],
            Asked::Driving(_) => [-1.0, 1.0],
        }
    }

    fn moved(&self, unknowns: &DVector<f64>, asked: &Asked<'_>, step: f64) -> Moved {
        let (mut unknowns, mut driving_m) = (unknowns.clone(), self.driving_m.clone());
        match asked {
            Asked::Unknown(unknown) => unknowns[*unknown] += step,
            Asked::Driving(error_m) => {
                driving_m.iter_mut().zip(*error_m).for_each(|(x_m, error_m)| *x_m += step * error_m);
            }
        }
        (unknowns, driving_m)
    }

    fn weight(&self, sample: (usize, usize)) -> f64 {
        self.motion.independent_sigma_m[sample].powi(-2)
    }

    /// J' W e.
    fn projected(&self, jacobian: &DMatrix<f64>, errors_m: impl Fn(usize) -> f64) -> DVector<f64> {
        let mut side = DVector::zeros(jacobian.ncols());
        for (i, sample) in self.samples.iter().enumerate() {
            side.axpy(self.weight(*sample) * errors_m(i), &jacobian.row(i).transpose(), 1.0);
        }
        side
    }

    fn equations(
        &self,
        jacobian: &DMatrix<f64>,
        predicted: &DVector<f64>,
        unknowns: &DVector<f64>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let n = jacobian.ncols();
        let column = |j: usize| self.projected(jacobian, |i| jacobian[(i, j)]);
        let mut normal = DMatrix::from_columns(&(0..n).map(column).collect::<Vec<_>>());
        let measured = |i: usize| self.motion.displacement_m[self.samples[i]].map_or(0.0, |x| x.value);
        let mut side = self.projected(jacobian, |i| measured(i) - predicted[i]);
        for (known, i) in self.model.known.iter().zip(1..) {
            normal[(i, i)] += known.relative_sigma.powi(-2);
            side[i] -= (unknowns[i] - 1.0) * known.relative_sigma.powi(-2);
        }
        (normal, side)
    }

    fn finish(
        self,
        unknowns: &DVector<f64>,
        (predicted, jacobian): (&DVector<f64>, &DMatrix<f64>),
        covariance: &DMatrix<f64>,
    ) -> Result<ImposedFit, FitError> {
        let mut total = covariance.clone();
        let modes = &self.motion.modes;
        let of_body_1 =
            |k: usize| (self.span.0..=self.span.1).map(|i| modes[k].displacement_m[(0, i)]).collect();
        let errors_m: Vec<Vec<f64>> = (0..modes.len()).map(of_body_1).collect();
        let passed_on = self.passed_on(unknowns, &errors_m)?;
        for (mode, passed_on) in modes.iter().zip(&passed_on) {
            let error_m = |i: usize| mode.displacement_m[self.samples[i]] - passed_on[i];
            let shift = covariance * self.projected(jacobian, error_m);
            total += &shift * shift.transpose();
        }
        let mut random = Pcg64::seed_from_u64(SEED);
        let draws_m: Vec<Vec<f64>> = (0..N_DRAWS).map(|_| self.noise_of_body_1(&mut random)).collect();
        for passed_on in self.passed_on(unknowns, &draws_m)? {
            let shift = covariance * self.projected(jacobian, |i| -passed_on[i]);
            total += &shift * shift.transpose() / N_DRAWS as f64;
        }
        let residual = |(i, sample): (usize, &(usize, usize))| {
            let x = self.motion.displacement_m[*sample]?;
            Some(((x.value - predicted[i]) / x.sigma).powi(2))
        };
        let squares: f64 = self.samples.iter().enumerate().filter_map(residual).sum();
        let estimate = |i: usize| Estimate::new(unknowns[i], total[(i, i)].sqrt());
        Ok(ImposedFit {
            chain_damping_kg_per_s: estimate(0),
            factors: self
                .model
                .known
                .iter()
                .zip(1..)
                .map(|(known, i)| (known.quantity, estimate(i)))
                .collect(),
            reduced_chi_squared: squares / self.samples.len() as f64,
            n_residuals: self.samples.len(),
            n_simulations: self.n_simulations.into_inner(),
        })
    }

    fn noise_of_body_1(&self, random: &mut Pcg64) -> Vec<f64> {
        let noise_m = |k: usize| {
            let deviate: f64 = StandardNormal.sample(random);
            self.motion.independent_sigma_m[(0, k)] * deviate
        };
        (self.span.0..=self.span.1).map(noise_m).collect()
    }

    /// What errors of body 1, sample by sample, do to the prediction; nothing is solved for one that has none.
    fn passed_on(
        &self,
        unknowns: &DVector<f64>,
        errors_m: &[Vec<f64>],
    ) -> Result<Vec<DVector<f64>>, FitError> {
        let felt: Vec<usize> =
            (0..errors_m.len()).filter(|k| errors_m[*k].iter().any(|error| error.abs() > 0.0)).collect();
        let groups: Vec<&[usize]> = felt.chunks(TOGETHER).collect();
        let solved = map_in_parallel(groups.len(), self.model.n_threads, |group| {
            let asked: Vec<Asked<'_>> = groups[group].iter().map(|k| Asked::Driving(&errors_m[*k])).collect();
            Ok::<_, FitError>(self.predicted(unknowns, &asked)?.1)
        });
        let mut all = vec![DVector::zeros(self.samples.len()); errors_m.len()];
        for (group, solved) in groups.iter().zip(solved) {
            for (k, passed_on) in group.iter().zip(solved?) {
                all[*k] = passed_on;
            }
        }
        Ok(all)
    }
}
