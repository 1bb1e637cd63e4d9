//! Whether the tracks ask for more than the simplest model.

use chainwave_analysis::probability::{chi_squared_beyond, normal_beyond};
use chainwave_analysis::{Departure, Rule, SIGNIFICANCE_LEVEL};
use chainwave_measurement::{Estimate, Observation};
use nalgebra::{DMatrix, DVector};

use super::hypothesis::mass_of;
use super::model::TrackModel;
use super::neighbours::Neighbours;
use super::outcome::{FittedRecording, TrackFit};
use super::residuals::{TrackResiduals, degrees_of_freedom};
use crate::damping::N_DAMPINGS;
use crate::error::FitError;
use crate::excess::{excess, reduced_chi_squared};
use crate::least_squares::{Failure, LeastSquares, Own, Unknowns};
use crate::measured_rates;
use crate::quantity::Quantity;

/// Whether the contact law softens at all: the factor on its softening (1 as stated, 0 for a spring of the same stiffness), against 0.
///
/// It is one Gauss-Newton step from the fit, all other unknowns moving along, so a spring far from the stated law is told by a
/// statistic that is too large to be exact, and one near it, where the decision is close, by an exact one.
///
/// # Errors
/// [`FitError`] when the tracks do not determine it.
pub fn softening(observations: &[Observation], fit: &TrackFit) -> Result<Departure, FitError> {
    match fit.found.iter().find(|(quantity, _)| *quantity == Quantity::Softening) {
        // The fit has freed it already.
        Some((_, found)) => Ok(softened(*found)),
        None => softening_at(observations, (&fit.model, &asked_of(fit)), &unknowns_of(fit)),
    }
}

fn softened(size: Estimate) -> Departure {
    let z = size.value / size.sigma;
    Departure { size, chi_squared: z * z, degrees_of_freedom: 1, p_value: normal_beyond(z) }
}

/// The same at the unknowns of a minimum of a model, and what is asked of it.
pub(crate) fn softening_at(
    observations: &[Observation],
    model: (&TrackModel, &[Quantity]),
    at: &Unknowns,
) -> Result<Departure, FitError> {
    let asked = FreedQuantities::of(observations, model, at, &[Quantity::Softening])?;
    Ok(softened(Estimate::new(1.0 + asked.step[0], asked.covariance[(0, 0)].sqrt())))
}

/// The rule by which the contact law counts as a spring.
pub fn softening_rule() -> Rule {
    Rule {
        question: "contact law",
        text: format!(
            "a spring unless the tracks tell the law's softening from zero (one-sided, {} % level); 1 is the law that the experiment gives",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: measured_rates::SOFTENING.to_vec(),
    }
}

/// The rule by which bodies count as alike.
pub fn scatter_of_bodies_rule() -> Rule {
    Rule {
        question: "differences between bodies",
        text: format!(
            "none unless masses that are free in each body, or in {MOST_MASSES} groups of neighbours where there are more, scatter by more than \
             their errors (chi squared, {} % level); a stiffness that scatters from gap to gap shows as well",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: measured_rates::SCATTER.to_vec(),
    }
}

/// Masses that are free at most. Where there are more bodies, neighbours share one: what a wave tells of masses is when it comes, which adds up over
/// neighbours, so that few slow changes along the chain hold nearly all of it, and a number for each body would add degrees of freedom, and effort that
/// grows with the cube of their number, without evidence.
const MOST_MASSES: usize = 64;

/// Whether bodies differ: a factor on each body's mass about their mean, against none. Its size is the standard deviation of the masses
/// beyond what their own errors make of it, relative to the mean. Masses that differ from body to body make the mean of n neighbours, which share a factor
/// where there are more than 64 bodies, differ by 1 / sqrt(n) of that.
///
/// A stiffness that scatters from gap to gap shows here too, as it delays the wave as a heavier body does.
///
/// # Errors
/// [`FitError`] when the tracks do not determine it.
pub fn scatter_of_bodies(observations: &[Observation], fit: &TrackFit) -> Result<Departure, FitError> {
    scatter_of_bodies_at(observations, (&fit.model, &asked_of(fit)), &unknowns_of(fit))
}

/// The same at the unknowns of a minimum of a model, and what is asked of it.
pub(crate) fn scatter_of_bodies_at(
    observations: &[Observation],
    model: (&TrackModel, &[Quantity]),
    at: &Unknowns,
) -> Result<Departure, FitError> {
    let mut bodies: Vec<usize> = observations
        .iter()
        .flat_map(|observation| observation.bodies.iter().map(|track| track.body))
        .collect();
    bodies.sort_unstable();
    bodies.dedup();
    scatter_of_groups(observations, model, at, &Neighbours::of(&bodies, MOST_MASSES))
}

/// The same of groups of neighbours that share a factor.
fn scatter_of_groups(
    observations: &[Observation],
    (model, asked): (&TrackModel, &[Quantity]),
    at: &Unknowns,
    groups: &[Neighbours],
) -> Result<Departure, FitError> {
    let quantities: Vec<Quantity> = groups.iter().map(mass_of).collect();
    let masses = FittedMasses::of(model, at);
    let freed = FreedQuantities::of(observations, (&masses.model, asked), &masses.at, &quantities)?;
    let (factors, covariance) = masses.factors(groups, &freed);
    let open = || FitError::Undetermined { what: "the tracks", unknowns: "the masses of bodies".into() };
    let inverse = covariance.clone().cholesky().ok_or_else(open)?.inverse();
    let ones = DVector::repeat(quantities.len(), 1.0);
    let common = (&inverse * &ones).dot(&factors) / (&inverse * &ones).dot(&ones);
    let about_mean = factors.add_scalar(-common);
    let chi_squared = about_mean.dot(&(&inverse * &about_mean));
    let degrees_of_freedom = quantities.len().saturating_sub(1).max(1);
    let n = degrees_of_freedom as f64;
    let together = groups.len() as f64 / groups.iter().map(|group| (group.n as f64).recip()).sum::<f64>();
    let of_errors = together * covariance.trace() / n;
    let variance = together * (about_mean.norm_squared() - covariance.trace()) / n;
    // The standard error of a variance from n values, over twice the deviation.
    let deviation = variance.max(0.0).sqrt();
    let total = variance.max(0.0) + of_errors;
    let sigma = total * (0.5 / n).sqrt() / deviation.max(total.sqrt() * (0.5 / n).powf(0.25));
    let p_value = chi_squared_beyond(chi_squared, degrees_of_freedom as f64);
    Ok(Departure { size: Estimate::new(deviation, sigma), chi_squared, degrees_of_freedom, p_value })
}

/// A model whose bodies have the masses that a fit found, none of them known: a prior of the masses that are asked about would hold the new factors
/// as well, which multiply the fitted ones, and so hide that bodies differ.
struct FittedMasses {
    model: TrackModel,
    at: Unknowns,
    /// What the fit made of each body's mass beside that of all, less one.
    moved: Vec<f64>,
}

impl FittedMasses {
    fn of(model: &TrackModel, at: &Unknowns) -> Self {
        let mut moved = vec![0.0; model.chain.n_bodies()];
        let mut fitted = model.clone();
        let mut shared: Vec<f64> = at.shared.iter().copied().collect();
        // From behind, so that places before it stay.
        for (place, prior) in model.priors.iter().enumerate().rev() {
            let bodies = match prior.quantity {
                Quantity::MassOfBody(body) => body..=body,
                Quantity::MassOfNeighbours(first, last) => first..=last,
                _ => continue,
            };
            fitted.priors.remove(place);
            let factor = shared.remove(N_DAMPINGS + place);
            let of_bodies = (1..).zip(fitted.chain.mass_kg.iter_mut().zip(&mut moved));
            for (_, (mass_kg, moved)) in of_bodies.filter(|(body, _)| bodies.contains(body)) {
                *mass_kg *= factor;
                *moved = (1.0 + *moved) * factor - 1.0;
            }
        }
        let at = Unknowns { shared: DVector::from_vec(shared), own: at.own.clone() };
        Self { model: fitted, at, moved }
    }

    /// Factors on the masses of groups less one, and their covariance: what the fit made of them on average, times what is asked for.
    fn factors(&self, groups: &[Neighbours], freed: &FreedQuantities) -> (DVector<f64>, DMatrix<f64>) {
        let moved = |group: &Neighbours| {
            let bodies = self.moved.get(group.first.saturating_sub(1)..group.last).unwrap_or(&[]);
            bodies.iter().sum::<f64>() / bodies.len().max(1) as f64
        };
        let moved = DVector::from_iterator(groups.len(), groups.iter().map(moved));
        let times = moved.add_scalar(1.0);
        let factors = &moved + times.component_mul(&freed.step);
        let covariance = DMatrix::from_fn(groups.len(), groups.len(), |i, j| {
            freed.covariance[(i, j)] * times[i] * times[j]
        });
        (factors, covariance)
    }
}

/// Quantities that the fit left at one, as one step from it would move them.
struct FreedQuantities {
    step: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl FreedQuantities {
    fn of(
        observations: &[Observation],
        (model, asked): (&TrackModel, &[Quantity]),
        at: &Unknowns,
        quantities: &[Quantity],
    ) -> Result<Self, FitError> {
        let all = [asked, quantities].concat();
        let problem = TrackResiduals::new(observations, model, &all)?;
        let failed = |failure: Failure<FitError>| problem.failure(failure);
        let at = problem.equations(&problem.extended(at, (model.priors.len(), asked.len())))?;
        let system = at.reduced(0.0).ok_or_else(|| failed(Failure::Undetermined(Vec::new())))?.system();
        let covariance = system.covariance().map_err(|open| failed(Failure::Undetermined(open)))?;
        let step = system.step().ok_or_else(|| failed(Failure::Undetermined(Vec::new())))?;
        let (first, n) = (problem.n_shared() - quantities.len(), quantities.len());
        // With these quantities free.
        let left =
            reduced_chi_squared(at.chi_squared() - system.length2(&step), degrees_of_freedom(&problem));
        Ok(Self {
            step: step.rows(first, n).into_owned(),
            covariance: covariance.view((first, first), (n, n)) * excess(left),
        })
    }
}

/// The quantities without a prior that a fit found.
fn asked_of(fit: &TrackFit) -> Vec<Quantity> {
    fit.found.iter().map(|(quantity, _)| *quantity).collect()
}

fn unknowns_of(fit: &TrackFit) -> Unknowns {
    let damping = &fit.damping;
    let mut shared = vec![damping.chain_damping_kg_per_s.value, damping.striker_damping_kg_per_s.value];
    shared.extend(fit.factors.iter().chain(&fit.found).map(|(_, found)| found.value));
    let own = |one: &FittedRecording| Own::new(one.striker_velocity_m_per_s.value, one.impact_time_s.value);
    Unknowns { shared: DVector::from_vec(shared), own: fit.recordings.iter().map(own).collect() }
}

#[cfg(test)]
mod tests {
    use std::num::NonZero;

    use chainwave_measurement::BodyTrack;
    use chainwave_mechanics::{Chain, Drive, Schedule, Striker, simulate};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::super::residuals::TrackResiduals;
    use super::*;
    use crate::damping::STARTS;
    use crate::least_squares::{Stop, minimise};

    const N_BODIES: usize = 96;
    const NOISE_M: f64 = 1e-6;

    /// What a test with so many groups says of a chain that is seen as a whole in two trials, and whose masses scatter.
    fn scatter(mass_scatter: f64, seed: u64, n_groups: &[usize]) -> Vec<Departure> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut normal = |sigma: f64| -> f64 {
            let deviate: f64 = StandardNormal.sample(&mut random);
            sigma * deviate
        };
        let velocity = Estimate::new(0.3, 0.006);
        let striker =
            |velocity_m_per_s: f64| Drive::Striker(Striker { velocity_m_per_s, ..Striker::OF_RINGS });
        let chain = Chain { drive: striker(velocity.value), ..Chain::of_rings(N_BODIES) };
        let masses_kg = chain.mass_kg.iter().map(|mass_kg| mass_kg * (1.0 + normal(mass_scatter))).collect();
        let truth = Chain { mass_kg: masses_kg, ..chain.clone() };
        let times_s: Vec<f64> = (-10..300).map(|k| 2e-4 * f64::from(k)).collect();
        let mut filmed = |trial: u32| {
            let drive = striker(velocity.value + normal(velocity.sigma));
            let schedule = Schedule::automatic(0.062, 5e-5);
            let moved = simulate(&Chain { drive, ..truth.clone() }, &schedule).unwrap().trajectory;
            let mut track = |body: usize| {
                let at = |t_s: f64| moved.at(t_s).map_or(0.0, |moment| moment.displacement_m(body - 1));
                let position = |t_s: &f64| Some(Estimate::new(at(*t_s) + normal(NOISE_M), NOISE_M));
                BodyTrack { body, position_m: times_s.iter().map(position).collect() }
            };
            let bodies = (1..=N_BODIES).map(&mut track).collect();
            Observation { recording: trial.to_string(), view: 1, trial, times_s: times_s.clone(), bodies }
        };
        let observations = [filmed(1), filmed(2)];
        let model = TrackModel {
            chain,
            striker_velocity_m_per_s: velocity,
            priors: Vec::new(),
            reading_errors: Vec::new(),
            usual_errors: Vec::new(),
            n_threads: NonZero::<usize>::MIN,
        };
        let problem = TrackResiduals::new(&observations, &model, &[]).unwrap();
        let start = problem.start(&[], STARTS[0]).unwrap();
        let at = minimise(&problem, start, &[], &Stop::STATED).unwrap().at;
        let bodies: Vec<usize> = (1..=N_BODIES).collect();
        let found = |n: &usize| {
            let groups = Neighbours::of(&bodies, *n);
            scatter_of_groups(&observations, (&model, &[]), &at, &groups).unwrap()
        };
        n_groups.iter().map(found).collect()
    }

    #[test]
    fn a_scatter_of_masses_is_told_by_neighbours_that_share_a_factor() {
        // Of 96 masses drawn with 1.3 % the standard deviation is known to 7 % of that, of the means of 12 groups to 21 %.
        for found in scatter(0.013, 1, &[N_BODIES, MOST_MASSES, 12]) {
            assert!(found.p_value < 1e-9, "{found:?}");
            assert!((found.size.value - 0.013).abs() < 3.0 * found.size.sigma, "{found:?}");
            assert!(found.size.sigma < 0.005, "{found:?}");
        }
    }

    #[test]
    fn bodies_that_are_alike_do_not_scatter_by_neighbours_either() {
        for found in scatter(0.0, 2, &[N_BODIES, MOST_MASSES, 12]) {
            // Less often than once in a thousand by chance.
            assert!(found.p_value > 1e-3, "{found:?}");
        }
    }

    #[test]
    fn effort_does_not_grow_with_the_bodies_beyond_some_number_of_masses() {
        let asked = |n_bodies: usize| {
            let bodies: Vec<usize> = (1..=n_bodies).collect();
            Neighbours::of(&bodies, MOST_MASSES).iter().map(mass_of).collect::<Vec<_>>()
        };
        // What is integrated along a chain is as long as it and its time, once for each of these: with a number for each body it would be the cube.
        assert_eq!(asked(64), (1..=64).map(Quantity::MassOfBody).collect::<Vec<_>>());
        assert_eq!([65, 300, 1000].map(|n_bodies| asked(n_bodies).len()), [MOST_MASSES; 3]);
    }
}
