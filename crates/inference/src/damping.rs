//! The damping that the fits find, and what they all assume of it.

use chainwave_analysis::probability::normal_beyond;
use chainwave_analysis::{Rule, SIGNIFICANCE_LEVEL};
use chainwave_measurement::Estimate;
use chainwave_mechanics::{Chain, Drive};

use crate::measured_rates;

/// c_d and c_s stand first among the unknowns of a fit with a striker.
pub(crate) const N_DAMPINGS: usize = 2;
/// Starting points of a fit: factors on the model's c_d and c_s.
pub(crate) const STARTS: [[f64; N_DAMPINGS]; 3] = [[1.0, 1.0], [10.0, 0.1], [0.1, 10.0]];

/// Most c_s over critical damping, and over what stops striker and body 1 against each other within a frame. A contact that is damped more shows
/// nothing else, and closes and opens ever faster, in as many more steps.
const MOST_STRIKER_DAMPING: [f64; 2] = [10.0, 3.0];

/// Critical damping of the first body on the first contact; a chain to be fitted has bodies.
pub fn critical_kg_per_s(chain: &Chain) -> f64 {
    chain.linear().map_or(0.0, |linear| linear.critical_damping_kg_per_s())
}

/// The largest c_s that a search tries, for frames so far apart.
pub(crate) fn most_striker_damping_kg_per_s(chain: &Chain, frame_s: f64) -> f64 {
    let Drive::Striker(striker) = &chain.drive else { return f64::INFINITY };
    let reduced_kg = (striker.mass_kg.recip() + chain.mass_kg[0].recip()).recip();
    let [of_critical, of_a_frame] = MOST_STRIKER_DAMPING;
    (of_critical * critical_kg_per_s(chain)).max(of_a_frame * reduced_kg / frame_s)
}

/// Mean c_d of the bodies.
pub(crate) fn mean_damping_kg_per_s(chain: &Chain) -> f64 {
    chain.damping_kg_per_s.iter().sum::<f64>() / chain.n_bodies() as f64
}

/// Dampings of the bodies whose mean is `c_d_kg_per_s`, in the proportions that the chain states; all alike where it states none.
pub(crate) fn damping_like(chain: &Chain, c_d_kg_per_s: f64) -> Vec<f64> {
    let (stated, mean) = (&chain.damping_kg_per_s, mean_damping_kg_per_s(chain));
    let are_alike = stated.windows(2).all(|pair| pair[0].total_cmp(&pair[1]).is_eq());
    match are_alike || mean <= 0.0 {
        true => vec![c_d_kg_per_s; stated.len()],
        false => stated.iter().map(|own| c_d_kg_per_s * own / mean).collect(),
    }
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
    /// With more variance of c_d and of c_s, of errors that do not go together.
    pub(crate) fn widened(self, more: [f64; N_DAMPINGS]) -> Self {
        let of = |found: Estimate, more: f64| Estimate::new(found.value, found.sigma.hypot(more.sqrt()));
        let (c_d, c_s) = (self.chain_damping_kg_per_s, self.striker_damping_kg_per_s);
        let (chain, striker) = (of(c_d, more[0]), of(c_s, more[1]));
        if more.iter().all(|more| *more <= 0.0) {
            return self;
        }
        Self {
            chain_damping_kg_per_s: chain,
            striker_damping_kg_per_s: striker,
            correlation: self.correlation * c_d.sigma * c_s.sigma / (chain.sigma * striker.sigma),
        }
    }

    /// How many times as large its sigmas are as another's.
    pub(crate) fn sigmas_over(&self, other: &Self) -> [f64; N_DAMPINGS] {
        [
            self.chain_damping_kg_per_s.sigma / other.chain_damping_kg_per_s.sigma,
            self.striker_damping_kg_per_s.sigma / other.striker_damping_kg_per_s.sigma,
        ]
    }

    /// Why c_d and c_s are no results, where they are none: at the bound of zero or of critical damping, which `critical_kg_per_s` is of each, or so
    /// uncertain that they may be anything up to that.
    pub fn refusals(&self, critical_kg_per_s: f64) -> [Option<String>; N_DAMPINGS] {
        [self.chain_damping_kg_per_s, self.striker_damping_kg_per_s]
            .map(|found| refusal(found, critical_kg_per_s))
    }

    /// Probabilities that c_d and c_s, were they zero, would be found so large or larger (one-sided, as neither can be negative).
    pub fn told_from_zero(&self) -> [f64; 2] {
        [self.chain_damping_kg_per_s, self.striker_damping_kg_per_s]
            .map(|found| normal_beyond(found.value / found.sigma))
    }
}

/// Below this many standard errors a search that ends at zero has ended there.
const AT_ZERO: f64 = 1e-3;
/// Beyond this share of critical damping a search that is bound by it has ended there.
const AT_CRITICAL: f64 = 0.999;

/// Why a damping is no result, where it is none.
pub fn refusal(found: Estimate, critical_kg_per_s: f64) -> Option<String> {
    let high = Estimate::COVERAGE_95 * found.sigma;
    if !(found.value.is_finite() && found.sigma < critical_kg_per_s) {
        return Some(format!(
            "not told: its sigma of {:.2e} kg/s is beyond critical damping ({critical_kg_per_s:.2e} kg/s)",
            found.sigma
        ));
    }
    if found.value <= AT_ZERO * found.sigma {
        return Some(format!("at its bound of zero: below {high:.2e} kg/s (95 %)"));
    }
    // Only a search that is bound by it ends there: what tracks tell may lie beyond.
    (AT_CRITICAL..=1.0)
        .contains(&(found.value / critical_kg_per_s))
        .then(|| format!("at its bound of critical damping ({critical_kg_per_s:.2e} kg/s)"))
}

/// The rule by which the dampings count as zero.
pub fn damping_rule() -> Rule {
    Rule {
        question: "damping",
        text: format!(
            "each of c_d and c_s is zero unless told from it (one-sided, {} % level)",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: measured_rates::DAMPING.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::PowerLaw;

    use super::*;

    #[test]
    fn a_search_tries_no_dashpot_that_locks_the_strikers_contact() {
        let chain = |contact: PowerLaw| Chain { contact: contact.into(), ..Chain::of_rings(5) };
        let (usual, frame_s) = (chain(PowerLaw::ELLIPTICAL_RING), 4e-5);
        let most = most_striker_damping_kg_per_s(&usual, frame_s);
        assert!((10.0..100.0).contains(&(most / critical_kg_per_s(&usual))), "{most}");
        // Bodies that hardly touch at rest have no critical damping to speak of, and may still be damped within a blow.
        let loose = chain(PowerLaw::from_stiffness(1e-6, 1e-9, 1.5).unwrap());
        assert!(most_striker_damping_kg_per_s(&loose, frame_s) > 10.0);
    }
}
