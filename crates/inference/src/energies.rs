//! Damping fitted to the peak potential energies.

mod model;
mod prediction;
mod residuals;
mod whitening;

use chainwave_analysis::probability::variance_ratio_beyond;
use chainwave_analysis::{PeakEnergies, exact_motion, pulses_and_energies, strain_map};
use chainwave_measurement::{ChainMotion, Estimate};
use chainwave_mechanics::Schedule;
use ndarray::Array2;

use crate::damping::{Damping, STARTS};
use crate::error::FitError;
use crate::excess::{degrees_of_freedom, inflation, reduced_chi_squared};
use crate::least_squares::{Failure, Stop, least_of};
use prediction::{DRIVE_SCALE, Prediction, Times, VELOCITY, priors_of};
use residuals::{Comparison, EnergyResiduals};
use whitening::cholesky_whitening;

pub use model::{EnergyFit, EnergyModel};

/// Fits c_d and c_s to the peak potential energies of the gaps, with their covariance (paper, Fig. 4).
///
/// The model's peaks are found as those of the `motion` that the energies were measured in: among the samples in which both bodies of a gap were
/// seen. A gap may hold more where nobody sees it, such as in tension, when the wave comes back from a free end.
///
/// # Errors
/// [`FitError`] as its variants say.
pub fn fit_peak_energies(
    energies: &PeakEnergies,
    motion: &ChainMotion,
    model: &EnergyModel,
) -> Result<EnergyFit, FitError> {
    let (expected, found) = (motion.n_bodies(), model.chain.n_bodies());
    if expected != found {
        return Err(FitError::TooFew { what: "bodies in the model", expected, found });
    }
    const LEAST_GAPS: usize = 5;
    let found = energies.gaps.len();
    if found < LEAST_GAPS {
        return Err(FitError::TooFew { what: "peak energies", expected: LEAST_GAPS, found });
    }
    let n_replicas = energies.n_replicas;
    if n_replicas < found + 3 {
        return Err(FitError::TooFew {
            what: "replicas in which every gap has its peak energy",
            expected: found + 3,
            found: n_replicas,
        });
    }
    // The inverse of a covariance that n replicas tell is too large by (n - 1)/(n - k - 2) for k energies (Hartlap, Simon and Schneider 2007).
    let correction = (n_replicas - 1) as f64 / (n_replicas - found - 2) as f64;
    let covariance_j2 = &energies.covariance_j2 * correction;
    let whiten = cholesky_whitening(&covariance_j2, "peak energies")?;
    let interval_s = interval_s(&motion.times_s);
    let duration_s = motion.times_s.last().copied().unwrap_or(0.0) + 2.0 * interval_s;
    let comparison = Comparison {
        measured: whiten(energies.energy_j.iter().map(|energy| energy.value).collect()),
        predict: Box::new(|prediction: &Prediction| {
            Ok(whiten(predicted_energies(prediction, (energies, &motion.displacement_m), model)?))
        }),
        times: Times { measured_s: &motion.times_s, schedule: Schedule::automatic(duration_s, interval_s) },
    };
    fit(&EnergyResiduals::new(model, &comparison), (found, n_replicas))
}

/// Probability that a number of energies, whose covariance so many replicas tell, leave by chance such a reduced chi squared, with so many
/// degrees of freedom, or a larger one.
///
/// With a covariance that is itself an estimate the sum of squares follows Hotelling's T^2, an F distribution of as many further degrees of freedom as
/// replicas are more than energies (T. W. Anderson, An Introduction to Multivariate Statistical Analysis (2003), theorem 5.2.2).
fn chance(
    reduced_chi_squared: f64,
    degrees_of_freedom: usize,
    (n_energies, n_replicas): (usize, usize),
) -> f64 {
    let more = n_replicas.saturating_sub(n_energies) as f64;
    // The mean of F, which the correction of the covariance has taken out.
    let mean = more / (more - 2.0);
    variance_ratio_beyond(mean * reduced_chi_squared, degrees_of_freedom as f64, more)
}

/// Follows several starting points, and takes the covariance at the lowest minimum; the `numbers` are of energies and of replicas.
fn fit(problem: &EnergyResiduals<'_>, numbers: (usize, usize)) -> Result<EnergyFit, FitError> {
    let failure = |why: Failure<FitError>| problem.failure(why);
    let starts = STARTS.map(|factors| problem.start(factors)).into_iter().collect::<Result<Vec<_>, _>>()?;
    let minimum = least_of(problem, starts, &[], &Stop::STATED).map_err(failure)?.minimum;
    let (_, covariance) = minimum.solved().map_err(failure)?;
    let values = &minimum.at.shared;
    let n_residuals = problem.n_residuals();
    let degrees_of_freedom = degrees_of_freedom(n_residuals, values.len());
    let reduced_chi_squared = reduced_chi_squared(minimum.chi_squared(), degrees_of_freedom);
    let inflation = inflation(reduced_chi_squared);
    let estimate = |i: usize| Estimate::new(values[i], inflation * covariance[(i, i)].sqrt());
    Ok(EnergyFit {
        damping: Damping {
            chain_damping_kg_per_s: estimate(0),
            striker_damping_kg_per_s: estimate(1),
            correlation: covariance[(0, 1)] / (covariance[(0, 0)] * covariance[(1, 1)]).sqrt(),
        },
        striker_velocity_m_per_s: estimate(VELOCITY),
        drive_scale: values[DRIVE_SCALE],
        factors: priors_of(problem.model).found(estimate),
        reduced_chi_squared,
        p_value: chance(reduced_chi_squared, degrees_of_freedom, numbers),
        n_residuals,
        n_simulations: problem.n_simulations(),
    })
}

/// Peak energies of the mean motion over the drives, found in it as in the measured motion: where that was seen, and by the law that the
/// experiment states, whatever law the trial values give the chain.
fn predicted_energies(
    prediction: &Prediction,
    (measured, seen): (&PeakEnergies, &Array2<Option<Estimate>>),
    model: &EnergyModel,
) -> Result<Vec<f64>, FitError> {
    let mut moved = exact_motion(&prediction.motion);
    let is_seen = |at: (usize, usize)| seen.get(at).is_some_and(Option::is_some);
    moved.displacement_m.indexed_iter_mut().for_each(|(at, x)| *x = x.filter(|_| is_seen(at)));
    let map = strain_map(&moved, model.spacing.clone())?;
    let n_gaps = model.chain.n_bodies().saturating_sub(1);
    let of_gaps: Vec<_> = (0..n_gaps).map(|gap| model.chain.contact.of_gap(gap).energy()).collect();
    let energy_of = |gap: usize, overlap_m: f64| of_gaps.get(gap - 1).map_or(0.0, |energy| energy(overlap_m));
    let (_, energies_j) = pulses_and_energies(&map, &measured.front, &energy_of);
    let found = |gap: &usize| energies_j.get(gap - 1).and_then(|energy| energy.ok());
    let beyond =
        |gap: &usize| prediction.peak_overlaps_m.get(gap - 1).map_or(0.0, |x_m| energy_of(*gap, *x_m));
    Ok(measured.gaps.iter().map(|gap| found(gap).unwrap_or_else(|| beyond(gap))).collect())
}

fn interval_s(times_s: &[f64]) -> f64 {
    match times_s {
        [first, .., last] => (last - first) / (times_s.len() - 1) as f64,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    /// Energies of which nothing is fitted, with a covariance told by few replicas: they are beyond a level as often as it says.
    #[test]
    fn chance_is_as_large_as_stated_however_few_replicas_tell_the_covariance() {
        const N_DRAWS: usize = 2000;
        let mut random = Pcg64::seed_from_u64(3);
        for (n_energies, n_replicas) in [(5, 20), (11, 40), (11, 200)] {
            let mut drawn = || DVector::<f64>::from_fn(n_energies, |_, _| StandardNormal.sample(&mut random));
            let mut n_beyond = [0.0; 2];
            for _ in 0..N_DRAWS {
                let replicas: Vec<DVector<f64>> = (0..n_replicas).map(|_| drawn()).collect();
                let mean = replicas.iter().sum::<DVector<f64>>() / n_replicas as f64;
                let about = replicas.iter().map(|one| one - &mean);
                let zero = DMatrix::zeros(n_energies, n_energies);
                let squares = about.fold(zero, |sum, one| sum + &one * one.transpose());
                // The covariance, over n - 1, with the correction that the fit makes.
                let covariance = squares / (n_replicas - n_energies - 2) as f64;
                let energies = drawn();
                let solved = covariance.cholesky().unwrap().solve(&energies);
                let p_value =
                    chance(energies.dot(&solved) / n_energies as f64, n_energies, (n_energies, n_replicas));
                for (n_beyond, level) in n_beyond.iter_mut().zip([0.01, 0.2]) {
                    *n_beyond += f64::from(u8::from(p_value < level));
                }
            }
            for (n_beyond, level) in n_beyond.into_iter().zip([0.01, 0.2]) {
                let (expected, n) = (level * N_DRAWS as f64, N_DRAWS as f64);
                // Four standard deviations of the binomial distribution.
                let scatter = (n * level * (1.0 - level)).sqrt();
                assert!((n_beyond - expected).abs() < 4.0 * scatter, "{n_energies} {n_replicas}: {n_beyond}");
            }
        }
    }
}
