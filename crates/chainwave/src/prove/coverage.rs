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
    quantities: Vec<CoveredQuantity>,
}

/// One quantity over all experiments. Within an experiment its estimates share errors, so uncertainties come from the scatter
/// between experiments.
pub(super) struct CoveredQuantity {
    name: String,
    /// Intervals that were stated.
    pub(super) n: usize,
    /// Mean error in standard uncertainties.
    pub(super) bias: Mean,
    /// Root mean square error in standard uncertainties.
    pub(super) rms: f64,
    /// Share of the 68 % intervals that hold the truth.
    within_68: Mean,
    /// Share of the 95 % intervals.
    pub(super) within_95: Mean,
}

/// A mean over experiments with its standard uncertainty, which one experiment does not tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mean {
    pub(super) value: f64,
    pub(super) sigma: Option<f64>,
}

impl Mean {
    /// As a figure has it: without an error bar where the uncertainty is not known.
    fn drawn(self) -> Estimate {
        Estimate::new(self.value, self.sigma.unwrap_or(0.0))
    }

    /// With as many decimals as asked for.
    pub(super) fn in_per_cent(self, decimals: usize) -> String {
        let value = 100.0 * self.value;
        match self.sigma {
            Some(sigma) => format!("{value:.decimals$} +- {:.decimals$}", 100.0 * sigma),
            None => format!("{value:.decimals$}"),
        }
    }
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
        let quantities =
            names.into_iter().zip(&tallies).map(|(name, tallies)| CoveredQuantity::of(name, tallies));
        Ok(Self { quantities: quantities.collect() })
    }

    /// Writes `coverage.parquet` and its figure.
    pub(super) fn write(&self, folder: &Path) -> Result<(), Error> {
        let of =
            |value: &dyn Fn(&CoveredQuantity) -> f64| self.quantities.iter().map(value).collect::<Vec<f64>>();
        let sigmas = |mean: &dyn Fn(&CoveredQuantity) -> Mean| {
            self.quantities.iter().map(|one| mean(one).sigma).collect::<Vec<Option<f64>>>()
        };
        let columns = vec![
            column("quantity", self.quantities.iter().map(|one| one.name.as_str()).collect::<Vec<_>>()),
            column("n", self.quantities.iter().map(|one| one.n as u64).collect::<Vec<_>>()),
            column("bias_sigma", of(&|one| one.bias.value)),
            column("bias_uncertainty", sigmas(&|one| one.bias)),
            column("within_68", of(&|one| one.within_68.value)),
            column("within_68_uncertainty", sigmas(&|one| one.within_68)),
            column("within_95", of(&|one| one.within_95.value)),
            column("within_95_uncertainty", sigmas(&|one| one.within_95)),
        ];
        table::write(&folder.join("coverage.parquet"), columns)?;
        let row = |one: &CoveredQuantity| CoverageRow {
            quantity: one.name.clone(),
            within_68: one.within_68.drawn(),
            within_95: one.within_95.drawn(),
        };
        let rows: Vec<CoverageRow> = self.quantities.iter().map(row).collect();
        Ok(coverage(&folder.join("coverage"), &rows)?)
    }

    /// One quantity; `None` where no interval of it was stated.
    pub(super) fn quantity(&self, name: &str) -> Option<&CoveredQuantity> {
        self.quantities.iter().find(|one| one.name == name)
    }

    /// Prints the table.
    pub(super) fn print(&self) {
        let estimate = |found: Mean| json!({ "value": found.value, "sigma": found.sigma });
        let of = |one: &CoveredQuantity| {
            json!({
                "quantity": one.name, "n": one.n, "bias_sigma": estimate(one.bias),
                "within_68": estimate(one.within_68), "within_95": estimate(one.within_95),
            })
        };
        tell("coverage", self.quantities.iter().map(of).collect());
        say!("{:<28}{:>8}{:>18}{:>18}{:>18}", "", "n", "bias (sigma)", "within 68 %", "within 95 %");
        for one in &self.quantities {
            let bias = match one.bias.sigma {
                Some(sigma) => format!("{:+.2} +- {sigma:.2}", one.bias.value),
                None => format!("{:+.2}", one.bias.value),
            };
            let (inner, outer) = (one.within_68.in_per_cent(1), one.within_95.in_per_cent(1));
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

impl CoveredQuantity {
    fn of(name: String, tallies: &[Tally]) -> Self {
        let seen: Vec<Tally> = tallies.iter().copied().filter(|tally| tally.n > 0.0).collect();
        let n_intervals = seen.iter().map(|tally| tally.n).sum::<f64>();
        let of_each =
            |sum: fn(&Tally) -> f64| -> Vec<f64> { seen.iter().map(|tally| sum(tally) / tally.n).collect() };
        let share = |sum: fn(&Tally) -> f64| share(&of_each(sum), n_intervals);
        Self {
            name,
            n: n_intervals as usize,
            bias: mean(&of_each(|tally| tally.error)),
            rms: mean(&of_each(|tally| tally.square)).value.sqrt(),
            within_68: share(|tally| tally.within_68),
            within_95: share(|tally| tally.within_95),
        }
    }
}

/// The mean over experiments, uncertain by their scatter.
fn mean(of_each: &[f64]) -> Mean {
    let n = of_each.len() as f64;
    let mean = of_each.iter().sum::<f64>() / n;
    let variance = of_each.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Mean { value: mean, sigma: (n > 1.0).then(|| (variance / n).sqrt()) }
}

/// The share of intervals that hold, of so many in all, by the shares of each experiment. Its uncertainty is half of Wilson's 68 % interval (E. B. Wilson,
/// J. Am. Stat. Assoc. 22 (1927) 209), which has a length also where all hold, of as many independent intervals as scatter like that from experiment to
/// experiment: of one an experiment at least.
fn share(of_each: &[f64], n_intervals: f64) -> Mean {
    let Mean { value, sigma } = mean(of_each);
    let n_experiments = of_each.len() as f64;
    let wilson = |scatter: f64| {
        let of_one = value * (1.0 - value);
        let alike = of_one / scatter.powi(2);
        let n = if alike.is_finite() { alike.clamp(n_experiments, n_intervals) } else { n_experiments };
        (of_one / n + 0.25 / (n * n)).sqrt() / (1.0 + 1.0 / n)
    };
    Mean { value, sigma: sigma.map(wilson) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_uncertain_also_where_every_interval_holds() {
        // Closed form: with all of n inside, Wilson's interval for z = 1 is from n / (n + 1) to 1.
        let all = share(&[1.0; 8], 800.0);
        assert!((all.sigma.unwrap() - 0.5 / 9.0).abs() < 1e-12, "{all:?}");
        assert_eq!(share(&[1.0], 100.0).sigma, None, "one experiment does not tell");
        assert_eq!(all.in_per_cent(1), "100.0 +- 5.6");
        // Of one interval each, the binomial share's own error but for Wilson's shift.
        let some = share(&[[1.0; 60].as_slice(), &[0.0; 40]].concat(), 100.0);
        assert!((some.sigma.unwrap() / (0.6_f64 * 0.4 / 100.0).sqrt() - 1.0).abs() < 0.02, "{some:?}");
        // Of many, the scatter of the experiments.
        let scattered: Vec<f64> = (0..50).map(|k| if k % 2 == 0 { 0.9 } else { 1.0 }).collect();
        let found = share(&scattered, 50_000.0);
        assert!((found.sigma.unwrap() / mean(&scattered).sigma.unwrap() - 1.0).abs() < 0.02, "{found:?}");
    }
}
