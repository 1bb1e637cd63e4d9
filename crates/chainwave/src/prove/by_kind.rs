//! What each kind of fault, or each effect of a real camera, does to the results.

use std::path::Path;

use chainwave_experiment::Table;
use chainwave_measurement::Estimate;

use super::coverage::Coverage;
use crate::error::Error;
use crate::table::{self, column};
use crate::terminal::say;

/// What experiments are counted by.
pub(super) struct Kinds {
    /// The column that holds the kind, here and in the proof's table.
    column: &'static str,
    /// The table's name.
    file: &'static str,
    /// The quantities that stand for the rest.
    quantities: &'static [&'static str],
}

/// What one kind does.
struct Row {
    kind: String,
    n_experiments: usize,
    /// Experiments whose failures, warnings or decisions name what is wrong; where nothing is, those with a warning.
    n_named: usize,
    coverage: Coverage,
}

/// What one kind does to one quantity.
struct Cell {
    within: Estimate,
    bias: Estimate,
    rms: f64,
}

impl Kinds {
    /// Of faults.
    pub(super) const FAULTS: Self = Self {
        column: "fault",
        file: "faults.parquet",
        quantities: &["displacement", "group velocity", "c_d, tracks", "trigger offset"],
    };
    /// Of the camera's effects.
    pub(super) const EFFECTS: Self = Self {
        column: "effect",
        file: "camera.parquet",
        quantities: &["displacement", "peak strain", "c_d, tracks", "c_s, tracks"],
    };
    /// Of chains that are not what is stated.
    pub(super) const CHAINS: Self = Self {
        column: "chain",
        file: "models.parquet",
        quantities: &["c_d, stated", "c_s, stated", "trigger offset", "drive", "peak energy"],
    };

    /// Writes the table (one row a kind and quantity), and prints it.
    pub(super) fn write(&self, folder: &Path, tables: &[Table]) -> Result<(), Error> {
        let rows = self.rows(tables)?;
        let cells: Vec<(&Row, &str, Cell)> = rows
            .iter()
            .flat_map(|row| {
                self.quantities.iter().filter_map(move |name| Some((row, *name, row.cell(name)?)))
            })
            .collect();
        let texts = |of: fn(&(&Row, &'static str, Cell)) -> String| cells.iter().map(of).collect::<Vec<_>>();
        let counts = |of: fn(&Row) -> usize| cells.iter().map(|cell| of(cell.0) as u64).collect::<Vec<_>>();
        let numbers = |of: fn(&Cell) -> f64| cells.iter().map(|cell| of(&cell.2)).collect::<Vec<_>>();
        let columns = vec![
            column(self.column, texts(|cell| cell.0.kind.clone())),
            column("n_experiments", counts(|row| row.n_experiments)),
            column("n_named", counts(|row| row.n_named)),
            column("quantity", texts(|cell| cell.1.to_owned())),
            column("within_95", numbers(|cell| cell.within.value)),
            column("within_95_uncertainty", numbers(|cell| cell.within.sigma)),
            column("bias_sigma", numbers(|cell| cell.bias.value)),
            column("bias_uncertainty", numbers(|cell| cell.bias.sigma)),
            column("rms_sigma", numbers(|cell| cell.rms)),
        ];
        table::write(&folder.join(self.file), columns)?;
        self.print(&rows);
        Ok(())
    }

    fn rows(&self, tables: &[Table]) -> Result<Vec<Row>, Error> {
        let mut by_kind: Vec<(String, usize, Vec<Table>)> = Vec::new();
        for table in tables {
            let kind = table.texts(self.column)?.into_iter().next().unwrap_or_default();
            let named = usize::from(table.full_numbers("named")?.first().is_some_and(|named| *named > 0.0));
            match by_kind.iter_mut().find(|(known, ..)| *known == kind) {
                Some((_, n_named, found)) => {
                    *n_named += named;
                    found.push(table.clone());
                }
                None => by_kind.push((kind, named, vec![table.clone()])),
            }
        }
        let row = |(kind, n_named, found): (String, usize, Vec<Table>)| {
            Ok(Row { kind, n_experiments: found.len(), n_named, coverage: Coverage::of(&found)? })
        };
        by_kind.into_iter().map(row).collect()
    }

    fn print(&self, rows: &[Row]) {
        say!("95 % intervals that hold, in per cent, and the rms error in sigma:");
        let names: String = self.quantities.iter().map(|name| format!("{name:>22}")).collect();
        say!("{:<26}{:>12}{:>8}{names}", self.column, "experiments", "named");
        for row in rows {
            let mut line = format!("{:<26}{:>12}{:>8}", row.kind, row.n_experiments, row.n_named);
            for name in self.quantities {
                let told = row.cell(name).map_or_else(
                    || "-".into(),
                    |Cell { within, rms, .. }| {
                        format!("{:.0} +- {:.0}; {rms:.1}", 100.0 * within.value, 100.0 * within.sigma)
                    },
                );
                line.push_str(&format!("{told:>22}"));
            }
            say!("{line}");
        }
    }
}

impl Row {
    /// `None` where nothing of a quantity was found.
    fn cell(&self, quantity: &str) -> Option<Cell> {
        let (within, bias) = self.coverage.of_quantity(quantity)?;
        Some(Cell { within, bias, rms: self.coverage.rms_of(quantity)? })
    }
}
