//! How often stated intervals hold the truth.

use std::path::Path;

use chainwave_experiment::Table;
use chainwave_figures::{CoverageRow, coverage};
use chainwave_measurement::Estimate;
use serde_json::json;

use crate::error::Error;
use crate::table::{self, column};
use crate::terminal::{say, tell};

/// How often the intervals of each quantity hold the truth.
pub(super) struct Coverage {
    quantities: Vec<Quantity>,
}

/// One quantity over all experiments. Within an experiment its estimates share errors, so uncertainties come from the scatter
/// between experiments.
pub(super) struct Quantity {
    name: String,
    /// Intervals that were stated.
    pub(super) n: usize,
    /// Mean error in standard uncertainties.
    pub(super) bias: Estimate,
    /// Root mean square error in standard uncertainties.
    pub(super) rms: f64,
    /// Share of the 68 % intervals that hold the truth.
    within_68: Estimate,
    /// Share of the 95 % intervals.
    pub(super) within_95: Estimate,
}

/// Sums over one experiment's estimates of one quantity.
#[derive(Default, Clone, Copy)]
struct Tally {
    n: f64,
    error: f64,
    square: f64,
    within_68: f64,
    within_95: f64,
}

impl Coverage {
    /// Counts over the tables of all experiments.
    pub(super) fn of(tables: &[Table]) -> Result<Self, Error> {
        let mut names: Vec<String> = Vec::new();
        let mut tallies: Vec<Vec<Tally>> = Vec::new();
        for (experiment, table) in tables.iter().enumerate() {
            let (quantities, values) = (table.texts("quantity")?, table.full_numbers("value")?);
            let (sigmas, truths) = (table.full_numbers("sigma")?, table.full_numbers("truth")?);
            for (row, name) in quantities.into_iter().enumerate() {
                let index = names.iter().position(|known| *known == name).unwrap_or_else(|| {
                    names.push(name);
                    tallies.push(vec![Tally::default(); tables.len()]);
                    names.len() - 1
                });
                let estimate = Estimate::new(values[row], sigmas[row]);
                tallies[index][experiment].add(estimate, truths[row]);
            }
        }
        let quantities = names.into_iter().zip(&tallies).map(|(name, tallies)| Quantity::of(name, tallies));
        Ok(Self { quantities: quantities.collect() })
    }

    /// Writes `coverage.parquet` and its figure.
    pub(super) fn write(&self, folder: &Path) -> Result<(), Error> {
        let of = |value: &dyn Fn(&Quantity) -> f64| self.quantities.iter().map(value).collect::<Vec<f64>>();
        let columns = vec![
            column("quantity", self.quantities.iter().map(|one| one.name.as_str()).collect::<Vec<_>>()),
            column("n", self.quantities.iter().map(|one| one.n as u64).collect::<Vec<_>>()),
            column("bias_sigma", of(&|one| one.bias.value)),
            column("bias_uncertainty", of(&|one| one.bias.sigma)),
            column("within_68", of(&|one| one.within_68.value)),
            column("within_68_uncertainty", of(&|one| one.within_68.sigma)),
            column("within_95", of(&|one| one.within_95.value)),
            column("within_95_uncertainty", of(&|one| one.within_95.sigma)),
        ];
        table::write(&folder.join("coverage.parquet"), columns)?;
        let row = |one: &Quantity| CoverageRow {
            quantity: one.name.clone(),
            within_68: one.within_68,
            within_95: one.within_95,
        };
        let rows: Vec<CoverageRow> = self.quantities.iter().map(row).collect();
        Ok(coverage(&folder.join("coverage"), &rows)?)
    }

    /// One quantity; `None` where no interval of it was stated.
    pub(super) fn quantity(&self, name: &str) -> Option<&Quantity> {
        self.quantities.iter().find(|one| one.name == name)
    }

    /// Prints the table.
    pub(super) fn print(&self) {
        let estimate = |found: Estimate| json!({ "value": found.value, "sigma": found.sigma });
        let of = |one: &Quantity| {
            json!({
                "quantity": one.name, "n": one.n, "bias_sigma": estimate(one.bias),
                "within_68": estimate(one.within_68), "within_95": estimate(one.within_95),
            })
        };
        tell("coverage", self.quantities.iter().map(of).collect());
        say!("{:<28}{:>8}{:>18}{:>18}{:>18}", "", "n", "bias (sigma)", "within 68 %", "within 95 %");
        for one in &self.quantities {
            let percent =
                |share: Estimate| format!("{:.1} +- {:.1}", 100.0 * share.value, 100.0 * share.sigma);
            let bias = format!("{:+.2} +- {:.2}", one.bias.value, one.bias.sigma);
            let (inner, outer) = (percent(one.within_68), percent(one.within_95));
            say!("{:<28}{:>8}{bias:>18}{inner:>18}{outer:>18}", one.name, one.n);
        }
    }
}

impl Tally {
    fn add(&mut self, estimate: Estimate, truth: f64) {
        let error = (estimate.value - truth) / estimate.sigma;
        self.n += 1.0;
        self.error += error;
        self.square += error * error;
        self.within_68 += f64::from(u8::from(error.abs() <= 1.0));
        self.within_95 += f64::from(u8::from(estimate.covers_95(truth)));
    }
}

impl Quantity {
    fn of(name: String, tallies: &[Tally]) -> Self {
        let seen: Vec<Tally> = tallies.iter().copied().filter(|tally| tally.n > 0.0).collect();
        let mean = |sum: fn(&Tally) -> f64| {
            let shares: Vec<f64> = seen.iter().map(|tally| sum(tally) / tally.n).collect();
            let n = shares.len() as f64;
            let mean = shares.iter().sum::<f64>() / n;
            let variance =
                shares.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
            Estimate::new(mean, (variance / n).sqrt())
        };
        Self {
            name,
            n: seen.iter().map(|tally| tally.n).sum::<f64>() as usize,
            bias: mean(|tally| tally.error),
            rms: mean(|tally| tally.square).value.sqrt(),
            within_68: mean(|tally| tally.within_68),
            within_95: mean(|tally| tally.within_95),
        }
    }
}
