//! What was measured, as a map over time and place, for the page.

use serde_json::{Value, json};

use crate::page::wave_section;

/// Most instants that are sent: a screen has fewer columns.
const MOST_INSTANTS: usize = 1200;
/// Most strains that a page of one file holds: some megabytes of text with the displacements beside them.
const MOST_HELD: usize = 200_000;

/// A quantity of a chain over time, row by row along the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownWave {
    /// Instants, in seconds after the trigger.
    pub times_s: Vec<f64>,
    /// Strain of each gap at each instant; none where it was not measured.
    pub strain: Vec<Vec<Option<f64>>>,
    /// Displacement of each body at each instant, in metres.
    pub displacement_m: Vec<Vec<Option<f64>>>,
}

impl ShownWave {
    /// The map by itself as a section of a page, with what it shows: the page needs no server. It defines the colours `--ink`, `--soft`, `--line`,
    /// `--field` and `--accent`.
    pub fn as_section(&self) -> String {
        wave_section(&self.thinned(MOST_INSTANTS.min(MOST_HELD / self.strain.len().max(1))))
    }

    /// As JSON for a screen.
    pub(crate) fn as_json(&self) -> Value {
        self.thinned(MOST_INSTANTS)
    }

    /// As JSON: every so many instants that they are at most so many, with four digits.
    fn thinned(&self, most: usize) -> Value {
        let every = self.times_s.len().div_ceil(most.max(1)).max(1);
        let thinned = |row: &Vec<Option<f64>>| -> Vec<Value> {
            row.iter().step_by(every).map(|value| value.map_or(Value::Null, rounded)).collect()
        };
        let times_s: Vec<f64> = self.times_s.iter().step_by(every).copied().collect();
        json!({
            "times_s": times_s, "every": every,
            "strain": self.strain.iter().map(thinned).collect::<Vec<_>>(),
            "displacement_m": self.displacement_m.iter().map(thinned).collect::<Vec<_>>(),
        })
    }
}

/// A number with four digits.
fn rounded(value: f64) -> Value {
    format!("{value:.3e}").parse::<f64>().map_or(Value::Null, |value| json!(value))
}
