//! Factors on what is known within an uncertainty, among the unknowns of a fit.

use chainwave_measurement::Estimate;
use chainwave_mechanics::{Chain, Striker};
use nalgebra::DVector;

use crate::damping::damping_like;
use crate::least_squares::NormalEquations;
use crate::quantity::{Prior, Quantity};

/// The factors of a model, which stand one behind the other among the unknowns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PriorFactors<'a> {
    priors: &'a [Prior],
    /// Where the first one stands.
    first: usize,
}

/// Factors stay within this of one, up and down, where that is no bound to what is known.
const LARGEST: f64 = 2.0;
/// So many standard uncertainties lie within.
const SIGMAS_WITHIN: f64 = 3.0;
/// The least factor of what is known so badly that it may be anything: no mass and no stiffness is none.
const LEAST: f64 = 1e-3;

impl<'a> PriorFactors<'a> {
    pub(crate) fn new(priors: &'a [Prior], first: usize) -> Self {
        Self { priors, first }
    }

    /// Between what the factors lie: the model refuses what is not above zero, and a search has no business far from one.
    pub(crate) fn bounds(self) -> impl Iterator<Item = (f64, f64)> + 'a {
        self.priors.iter().map(|prior| match 1.0 - SIGMAS_WITHIN * prior.relative_sigma >= LARGEST.recip() {
            true => (LARGEST.recip(), LARGEST),
            false => (LEAST, f64::INFINITY),
        })
    }

    /// The name of a factor, by its place among the unknowns.
    pub(crate) fn name(self, unknown: usize) -> String {
        self.at(unknown).map_or_else(|| "?".into(), Quantity::name)
    }

    /// Multiplies what the factors are of.
    pub(crate) fn apply(self, unknowns: &DVector<f64>, chain: &mut Chain, striker: &mut Striker) {
        self.with_values(unknowns).for_each(|(quantity, factor)| quantity.apply(factor, chain, striker));
    }

    /// A chain that no striker drives, with a trial value of c_d and the factors in place.
    pub(crate) fn without_striker(self, chain: &Chain, c_d_kg_per_s: f64, unknowns: &DVector<f64>) -> Chain {
        let mut chain = Chain { damping_kg_per_s: damping_like(chain, c_d_kg_per_s), ..chain.clone() };
        // Quantities of a striker change nothing here.
        let mut striker = Striker {
            mass_kg: 1.0,
            velocity_m_per_s: 0.0,
            damping_kg_per_s: 0.0,
            ground_damping_kg_per_s: 0.0,
        };
        self.apply(unknowns, &mut chain, &mut striker);
        chain
    }

    /// Length in the pictures over true length.
    pub(crate) fn picture_scale(self, unknowns: &DVector<f64>) -> f64 {
        let of_pictures = |(quantity, _): &(Quantity, f64)| *quantity == Quantity::Scale;
        self.with_values(unknowns).filter(of_pictures).map(|(_, factor)| factor).product()
    }

    /// Whether an unknown is that length's factor.
    pub(crate) fn is_picture_scale(self, unknown: usize) -> bool {
        self.at(unknown) == Some(Quantity::Scale)
    }

    /// Adds what is known to the equations.
    pub(crate) fn add_priors(self, equations: &mut NormalEquations, unknowns: &DVector<f64>) {
        for (prior, unknown) in self.priors.iter().zip(self.first..) {
            let residual = (unknowns[unknown] - 1.0) / prior.relative_sigma;
            equations.add_prior(unknown, residual, prior.relative_sigma.recip());
        }
    }

    /// The quantities with what was found of each, by its place among the unknowns.
    pub(crate) fn found(self, estimate: impl Fn(usize) -> Estimate) -> Vec<(Quantity, Estimate)> {
        self.priors.iter().zip(self.first..).map(|(prior, i)| (prior.quantity, estimate(i))).collect()
    }

    fn at(self, unknown: usize) -> Option<Quantity> {
        let prior = self.priors.get(unknown.checked_sub(self.first)?)?;
        Some(prior.quantity)
    }

    fn with_values(self, unknowns: &DVector<f64>) -> impl Iterator<Item = (Quantity, f64)> {
        let factors = unknowns.iter().skip(self.first);
        self.priors.iter().zip(factors).map(|(prior, factor)| (prior.quantity, *factor))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_leave_what_is_known_its_uncertainty_and_nothing_of_the_chain_is_none() {
        let priors =
            [0.01, 0.15, 0.3, 2.0].map(|relative_sigma| Prior { quantity: Quantity::Ground, relative_sigma });
        let bounds: Vec<(f64, f64)> = PriorFactors::new(&priors, 1).bounds().collect();
        assert_eq!(bounds[..2], [(0.5, 2.0); 2]);
        assert!(bounds.iter().all(|(lowest, _)| *lowest > 0.0), "{bounds:?}");
        for ((lowest, highest), prior) in bounds.iter().zip(&priors[..3]) {
            let away = SIGMAS_WITHIN * prior.relative_sigma;
            assert!(*lowest < (1.0 - away).max(0.01) && *highest > 1.0 + away, "{prior:?}");
        }
    }
}
