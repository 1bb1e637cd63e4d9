//! What is evaluated of an experiment, and how.

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// What is evaluated.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Analysis {
    /// The leading edge is where a gap first exceeds this fraction of its peak.
    pub edge_fraction: f64,
    /// First gap of the fit of the group velocity: where the pulse counts as formed.
    pub first_gap: Option<usize>,
    /// Last gap of the fit of the group velocity; as far as the pulse is one when left out.
    pub last_gap: Option<usize>,
    /// Times of the strain profiles; where none are named, those at which the pulse has passed a quarter, half and three quarters of the
    /// gaps that it was seen in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile_times_s: Option<Vec<f64>>,
    /// Replicas of the measured motion behind each uncertainty.
    pub n_replicas: usize,
    /// Seed of the replicas' noise.
    pub seed: u64,
    /// Whether c_d and c_s are fitted; without them no chain model stands beside the motion.
    #[serde(skip_serializing_if = "is_wanted")]
    pub fits: bool,
    /// Whether pulses are followed one by one.
    #[serde(skip_serializing_if = "is_wanted")]
    pub pulses: bool,
}

fn is_wanted(wanted: &bool) -> bool {
    *wanted
}

impl Default for Analysis {
    fn default() -> Self {
        Self {
            edge_fraction: 0.1,
            first_gap: None,
            last_gap: None,
            profile_times_s: None,
            n_replicas: 200,
            seed: 1,
            fits: true,
            pulses: true,
        }
    }
}

/// Replicas that tell an uncertainty to a sixth.
const LEAST_REPLICAS: usize = 20;
/// Replicas that tell it to one in four hundred; more fill the memory and tell nothing.
const MOST_REPLICAS: usize = 100_000;

impl Analysis {
    /// Refuses what cannot be asked of a chain of `n_gaps` gaps, before anything is tracked.
    pub(crate) fn check(&self, n_gaps: usize) -> Result<(), Error> {
        let refused = |key: &str, expected: String, found: String| {
            Err(Error::Value(format!("analysis.{key}: expected {expected}, found {found}")))
        };
        if !(self.edge_fraction > 0.0 && self.edge_fraction < 1.0) {
            return refused(
                "edge_fraction",
                "a number between 0 and 1".into(),
                self.edge_fraction.to_string(),
            );
        }
        if !(LEAST_REPLICAS..=MOST_REPLICAS).contains(&self.n_replicas) {
            let expected = format!("{LEAST_REPLICAS} to {MOST_REPLICAS}");
            return refused("n_replicas", expected, self.n_replicas.to_string());
        }
        for (key, gap) in [("first_gap", self.first_gap), ("last_gap", self.last_gap)] {
            if let Some(gap) = gap.filter(|gap| !(1..=n_gaps).contains(gap)) {
                return refused(key, format!("a gap from 1 to {n_gaps}"), gap.to_string());
            }
        }
        match (self.first_gap, self.last_gap) {
            (Some(first), Some(last)) if first >= last => {
                refused("last_gap", format!("a gap behind first_gap = {first}"), last.to_string())
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_asked_is_refused_by_its_key() {
        let usual = Analysis::default();
        assert!(usual.check(11).is_ok());
        let refused = |analysis: Analysis| analysis.check(11).unwrap_err().to_string();
        assert!(
            refused(Analysis { n_replicas: 1, ..usual.clone() })
                .contains("analysis.n_replicas: expected 20 to 100000, found 1")
        );
        assert!(refused(Analysis { edge_fraction: 7.0, ..usual.clone() }).contains("analysis.edge_fraction"));
        assert!(
            refused(Analysis { first_gap: Some(0), ..usual.clone() }).contains("a gap from 1 to 11, found 0")
        );
        let turned = Analysis { first_gap: Some(9), last_gap: Some(2), ..usual };
        assert!(refused(turned).contains("behind first_gap = 9, found 2"));
    }
}
