//! The displacement field behind body 1 against the chain model's, as a least-squares problem.

use std::sync::atomic::{AtomicU64, Ordering};

use chainwave_measurement::{ChainMotion, map_in_parallel};
use chainwave_mechanics::{Chain, Change, Drive, ImposedMotion, Kept, ReferenceMotion, Schedule};
use nalgebra::DVector;
use ndarray::Array2;

use super::model::ImposedModel;
use crate::damping::mean_damping_kg_per_s;
use crate::displacements::Displacements;
use crate::error::FitError;
use crate::least_squares::{Bounds, Failure, LeastSquares, NormalEquations, Unknowns};
use crate::priors::PriorFactors;
use crate::quadrature::quadrature;
use crate::steps::{BESIDE_FACTOR, DERIVATIVES_TOGETHER, beside_c_d};

/// Unknowns of every fit: c_d. Factors on what is known within an uncertainty follow.
pub(super) const N_ALWAYS: usize = 1;

/// Values of the unknowns, and a motion of body 1.
type Moved = (DVector<f64>, Vec<f64>);

/// By what the prediction's derivative is asked.
pub(super) enum By<'a> {
    /// An unknown.
    Unknown(usize),
    /// An error of body 1, sample by sample, in metres.
    Driving(&'a [f64]),
}

/// Displacements behind body 1, in units of their independent noise.
pub(super) struct ImposedResiduals<'a> {
    /// Those compared: behind body 1, within the span.
    pub(super) displacements: Displacements<'a>,
    pub(super) model: &'a ImposedModel,
    /// First and last sample at which body 1 was seen.
    pub(super) span: (usize, usize),
    driving_m: Vec<f64>,
    nodes: Vec<(f64, f64)>,
    schedule: Schedule,
    bounds: Bounds,
    n_simulations: AtomicU64,
}

impl<'a> ImposedResiduals<'a> {
    pub(super) fn new(motion: &'a ChainMotion, model: &'a ImposedModel) -> Result<Self, FitError> {
        const LEAST: usize = Displacements::LEAST;
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
        let compared = (1..motion.n_bodies(), first..last + 1);
        let displacements = Displacements::new(motion, model.chain.n_bodies(), compared)?;
        let interval_s = (motion.times_s[last] - motion.times_s[first]) / (last - first) as f64;
        let schedule = Schedule::automatic(interval_s * (last - first) as f64, interval_s);
        let nodes = quadrature(&model.drive_deviations);
        let mut shared = vec![(0.0, f64::INFINITY)];
        shared.extend(PriorFactors::new(&model.priors, N_ALWAYS).bounds());
        Ok(Self {
            displacements,
            model,
            span: (first, last),
            driving_m,
            nodes,
            schedule,
            bounds: Bounds::dense(shared),
            n_simulations: AtomicU64::new(0),
        })
    }

    /// Where the search begins.
    pub(super) fn start(&self) -> Unknowns {
        let mut start = vec![mean_damping_kg_per_s(&self.model.chain)];
        start.resize(N_ALWAYS + self.model.priors.len(), 1.0);
        Unknowns::dense(DVector::from_vec(start))
    }

    /// Chain simulations carried out.
    pub(super) fn n_simulations(&self) -> u64 {
        self.n_simulations.load(Ordering::Relaxed)
    }

    /// A search's failure in words.
    pub(super) fn failure(&self, failure: Failure<FitError>) -> FitError {
        FitError::of(failure, "the motion behind body 1", |unknown| match unknown {
            0 => "c_d".into(),
            factor => self.priors().name(factor),
        })
    }

    /// The factors on what is known within an uncertainty.
    pub(super) fn priors(&self) -> PriorFactors<'a> {
        PriorFactors::new(&self.model.priors, N_ALWAYS)
    }

    /// Displacements at the samples compared, and their derivatives by what is asked.
    pub(super) fn predicted(
        &self,
        unknowns: &DVector<f64>,
        asked: &[By<'_>],
    ) -> Result<(DVector<f64>, Vec<DVector<f64>>), FitError> {
        let chains = self.chains(unknowns)?;
        let motions = self.solved(&chains)?;
        let scale = self.priors().picture_scale(unknowns);
        let mut sum = DVector::zeros(self.displacements.samples.len());
        for ((weight, _), motion) in self.nodes.iter().zip(&motions) {
            self.add(&mut sum, &motion.simulation().trajectory.displacement_m, weight * scale);
        }
        Ok((sum, self.derivatives(&motions, unknowns, asked)?))
    }

    /// The chain at each of the drives.
    fn chains(&self, unknowns: &DVector<f64>) -> Result<Vec<Chain>, FitError> {
        let here = (unknowns.clone(), self.driving_m.clone());
        self.nodes.iter().map(|(_, deviation)| self.chain(&here, *deviation)).collect()
    }

    /// How these chains move.
    fn solved<'b>(&self, chains: &'b [Chain]) -> Result<Vec<ReferenceMotion<'b>>, FitError> {
        self.n_simulations.fetch_add(chains.len() as u64, Ordering::Relaxed);
        let solve = |node: usize| ReferenceMotion::solve(&chains[node], &self.schedule, Kept::Steps);
        let solved = map_in_parallel(chains.len(), self.model.n_threads, solve);
        solved.into_iter().map(|solved| Ok(solved?)).collect()
    }

    /// Derivatives of the displacements at the samples compared by what is asked, along the motions at the drives.
    fn derivatives(
        &self,
        motions: &[ReferenceMotion<'_>],
        unknowns: &DVector<f64>,
        asked: &[By<'_>],
    ) -> Result<Vec<DVector<f64>>, FitError> {
        let scale = self.priors().picture_scale(unknowns);
        let mut derivatives = vec![DVector::zeros(self.displacements.samples.len()); asked.len()];
        for ((weight, deviation), motion) in self.nodes.iter().zip(motions) {
            let change = |asked: &By<'_>| -> Result<Change, FitError> {
                let steps = self.steps(unknowns, asked);
                let [below, above] =
                    steps.map(|step| self.chain(&self.moved(unknowns, asked, step), *deviation));
                Ok(Change { below: below?, above: above?, width: steps[1] - steps[0] })
            };
            let changes = asked.iter().map(change).collect::<Result<Vec<_>, _>>()?;
            let moved_m = &motion.simulation().trajectory.displacement_m;
            let found = motion.derivatives(&changes, &[])?;
            for ((derivative, found), asked) in derivatives.iter_mut().zip(&found).zip(asked) {
                self.add(derivative, &found.displacement_m, weight * scale);
                if self.is_scale(asked) {
                    self.add(derivative, moved_m, *weight);
                }
            }
        }
        Ok(derivatives)
    }

    /// The same by every unknown.
    pub(super) fn predicted_by_unknowns(
        &self,
        unknowns: &DVector<f64>,
    ) -> Result<(DVector<f64>, Vec<DVector<f64>>), FitError> {
        self.predicted(unknowns, &(0..unknowns.len()).map(By::Unknown).collect::<Vec<_>>())
    }

    /// Adds the samples compared of a motion since body 1 was first seen.
    fn add(&self, sum: &mut DVector<f64>, moved_m: &Array2<f64>, weight: f64) {
        let last = moved_m.ncols().saturating_sub(1);
        for (entry, (row, k)) in sum.iter_mut().zip(&self.displacements.samples) {
            *entry += weight * moved_m[(*row, (k - self.span.0).min(last))];
        }
    }

    /// The chain with trial values in place, behind a motion of body 1 at one of the drives.
    fn chain(&self, (unknowns, driving_m): &Moved, deviation: f64) -> Result<Chain, FitError> {
        let mut chain = self.priors().without_striker(&self.model.chain, unknowns[0], unknowns);
        let seen_s = &self.displacements.motion.times_s[self.span.0..=self.span.1];
        let times_s = seen_s.iter().map(|time_s| time_s - seen_s[0]).collect();
        let share = (1.0 + deviation) / self.priors().picture_scale(unknowns);
        let driven_m = driving_m.iter().map(|x_m| x_m * share).collect();
        chain.drive = Drive::Imposed(ImposedMotion::from_samples(times_s, driven_m)?);
        Ok(chain)
    }

    fn is_scale(&self, asked: &By<'_>) -> bool {
        matches!(asked, By::Unknown(unknown) if self.priors().is_picture_scale(*unknown))
    }

    /// How far the chains on both sides of what is asked are from it: a step of a damping, but no farther than to none; a step of a factor;
    /// or all of an error, to which the chain responds in proportion.
    fn steps(&self, unknowns: &DVector<f64>, asked: &By<'_>) -> [f64; 2] {
        match asked {
            By::Unknown(0) => beside_c_d(&self.model.chain, unknowns[0]),
            By::Unknown(_) => BESIDE_FACTOR,
            By::Driving(_) => [-1.0, 1.0],
        }
    }

    fn moved(&self, unknowns: &DVector<f64>, asked: &By<'_>, step: f64) -> Moved {
        let (mut unknowns, mut driving_m) = (unknowns.clone(), self.driving_m.clone());
        match asked {
            By::Unknown(unknown) => unknowns[*unknown] += step,
            By::Driving(error_m) => {
                driving_m.iter_mut().zip(*error_m).for_each(|(x_m, error_m)| *x_m += step * error_m);
            }
        }
        (unknowns, driving_m)
    }

    /// What `told` makes of what errors of body 1, sample by sample, do to the prediction, one after the other, each with its number: there may be as
    /// many of them as recordings, and nothing of what they do is kept. Nothing is solved for an error that body 1 does not have.
    pub(super) fn passed_on<T: Send + Sync>(
        &self,
        unknowns: &DVector<f64>,
        errors_m: &[Vec<f64>],
        told: impl Fn(usize, Option<&DVector<f64>>) -> T + Sync,
    ) -> Result<Vec<T>, FitError> {
        let (felt, unfelt): (Vec<usize>, Vec<usize>) =
            (0..errors_m.len()).partition(|k| errors_m[*k].iter().any(|error| error.abs() > 0.0));
        let groups: Vec<&[usize]> = felt.chunks(DERIVATIVES_TOGETHER).collect();
        let chains = self.chains(unknowns)?;
        let motions = if groups.is_empty() { Vec::new() } else { self.solved(&chains)? };
        let solved = map_in_parallel(groups.len(), self.model.n_threads, |group| {
            let asked: Vec<By<'_>> = groups[group].iter().map(|k| By::Driving(&errors_m[*k])).collect();
            let passed_on = self.derivatives(&motions, unknowns, &asked)?;
            let told = groups[group].iter().zip(&passed_on).map(|(k, passed_on)| told(*k, Some(passed_on)));
            Ok::<_, FitError>(told.collect::<Vec<T>>())
        });
        let solved: Vec<Vec<T>> = solved.into_iter().collect::<Result<_, _>>()?;
        let not_solved = map_in_parallel(unfelt.len(), self.model.n_threads, |k| told(unfelt[k], None));
        let mut all: Vec<(usize, T)> = felt
            .into_iter()
            .zip(solved.into_iter().flatten())
            .chain(unfelt.into_iter().zip(not_solved))
            .collect();
        all.sort_by_key(|(k, _)| *k);
        Ok(all.into_iter().map(|(_, told)| told).collect())
    }
}

impl LeastSquares for ImposedResiduals<'_> {
    type Error = FitError;

    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    fn equations(&self, at: &Unknowns) -> Result<NormalEquations, FitError> {
        let (predicted, columns) = self.predicted_by_unknowns(&at.shared)?;
        let mut equations = self.displacements.equations(&predicted, &columns);
        self.priors().add_priors(&mut equations, &at.shared);
        Ok(equations)
    }
}
