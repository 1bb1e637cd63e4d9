//! The damping that the fits find, and what they all assume of it.

use chainwave_analysis::probability::normal_beyond;
use chainwave_analysis::{LEVEL, Rule};
use chainwave_measurement::Estimate;
use chainwave_mechanics::Chain;

use crate::measured_rates;

/// c_d and c_s stand first among the unknowns of a fit with a striker.
pub(crate) const N_DAMPINGS: usize = 2;
/// Starting points of a fit: factors on the model's c_d and c_s.
pub(crate) const STARTS: [[f64; N_DAMPINGS]; 3] = [[1.0, 1.0], [10.0, 0.1], [0.1, 10.0]];

/// Critical damping of the first body on the first contact; a chain to be fitted has bodies.
pub(crate) fn critical_kg_per_s(chain: &Chain) -> f64 {
    chain.linear().map_or(0.0, |linear| linear.critical_damping_kg_per_s())
}

/// Mean c_d of the bodies.
pub(crate) fn mean_damping_kg_per_s(chain: &Chain) -> f64 {
    chain.damping_kg_per_s.iter().sum::<f64>() / chain.n_bodies() as f64
}

/// Fitted damping with standard uncertainties.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    /// c_d, dashpot of each body to ground, in kilograms per second.
    pub chain_damping_kg_per_s: Estimate,
    /// c_s, damping of the striker's contact, in kilograms per second.
    pub striker_damping_kg_per_s: Estimate,
    /// Correlation of the errors of c_d and c_s.
    pub correlation: f64,
}

impl Damping {
    /// Probabilities that c_d and c_s, were they zero, would be found so large or larger (one-sided, as neither can be negative).
    pub fn told_from_zero(&self) -> [f64; 2] {
        [self.chain_damping_kg_per_s, self.striker_damping_kg_per_s]
            .map(|found| normal_beyond(found.value / found.sigma))
    }
}

/// The rule by which the dampings count as zero.
pub fn damping_rule() -> Rule {
    Rule {
        question: "damping",
        text: format!(
            "each of c_d and c_s is zero unless told from it (one-sided, {} % level)",
            100.0 * LEVEL
        ),
        level: Some(LEVEL),
        rates: measured_rates::DAMPING.to_vec(),
    }
}
