//! What each kind of fault, effect of a real camera, wrong or other chain or protocol does to the results.

use std::collections::BTreeMap;
use std::path::Path;

use chainwave_experiment::Table;

use super::coverage::{Coverage, CoveredQuantity, Mean};
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
struct KindRow {
    kind: String,
    n_experiments: usize,
    /// Experiments whose failures, warnings or decisions name what is wrong; where nothing is, those with a warning.
    n_named: usize,
    /// What its experiments are warned of, each kind of warning with how many are.
    warned_of: Vec<(String, usize)>,
    coverage: Coverage,
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
    /// Of protocols.
    pub(super) const PROTOCOLS: Self = Self {
        column: "protocol",
        file: "protocols.parquet",
        quantities: &[
            "displacement",
            "displacement by model",
            "group velocity",
            "peak time",
            "peak strain",
            "peak energy",
            "c_d, stated",
            "c_s, stated",
        ],
    };
    /// Of chains in place of the experiment's own.
    pub(super) const OTHER_CHAINS: Self = Self {
        column: "other_chain",
        file: "chains.parquet",
        quantities: &[
            "displacement",
            "displacement by model",
            "peak strain",
            "peak time",
            "peak energy",
            "trigger offset",
            "drive",
            "group velocity",
            "c_d, stated",
            "c_s, stated",
        ],
    };

    /// Writes the table (one row a kind and quantity), and prints it.
    pub(super) fn write(&self, folder: &Path, tables: &[Table]) -> Result<(), Error> {
        let rows = self.rows(tables)?;
        let cells: Vec<(&KindRow, &str)> =
            rows.iter().flat_map(|row| self.quantities.iter().map(move |name| (row, *name))).collect();
        let texts = |of: fn(&(&KindRow, &'static str)) -> String| cells.iter().map(of).collect::<Vec<_>>();
        let counts = |of: fn(&(&KindRow, &'static str)) -> usize| {
            cells.iter().map(|cell| of(cell) as u64).collect::<Vec<_>>()
        };
        let numbers = |of: fn(&CoveredQuantity) -> f64| {
            cells.iter().map(|(row, name)| row.coverage.quantity(name).map(of)).collect::<Vec<_>>()
        };
        let sigmas = |of: fn(&CoveredQuantity) -> Mean| {
            let sigma = |(row, name): &(&KindRow, &str)| {
                row.coverage.quantity(name).and_then(|found| of(found).sigma)
            };
            cells.iter().map(sigma).collect::<Vec<_>>()
        };
        let columns = vec![
            column(self.column, texts(|(row, _)| row.kind.clone())),
            column("n_experiments", counts(|(row, _)| row.n_experiments)),
            column("n_named", counts(|(row, _)| row.n_named)),
            column("warned_of", texts(|(row, _)| row.warnings())),
            column("quantity", texts(|(_, name)| (*name).to_owned())),
            column("n_stated", counts(|(row, name)| row.n_stated(name))),
            column("within_95", numbers(|found| found.within_95.value)),
            column("within_95_uncertainty", sigmas(|found| found.within_95)),
            column("bias_sigma", numbers(|found| found.bias.value)),
            column("bias_uncertainty", sigmas(|found| found.bias)),
            column("rms_sigma", numbers(|found| found.rms)),
        ];
        table::write(&folder.join(self.file), columns)?;
        self.print(&rows);
        Ok(())
    }

    fn rows(&self, tables: &[Table]) -> Result<Vec<KindRow>, Error> {
        let mut by_kind: Vec<(String, Vec<Table>)> = Vec::new();
        for table in tables {
            let kind = first_text(table, self.column)?;
            match by_kind.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, found)) => found.push(table.clone()),
                None => by_kind.push((kind, vec![table.clone()])),
            }
        }
        by_kind.into_iter().map(|(kind, found)| KindRow::of(kind, &found)).collect()
    }

    fn print(&self, rows: &[KindRow]) {
        say!("95 % intervals that hold, in per cent, the rms error in sigma, and how many were stated:");
        let names: String = self.quantities.iter().map(|name| format!("{name:>24}")).collect();
        say!("{:<26}{:>12}{:>8}{names}  warned of", self.column, "experiments", "named");
        for row in rows {
            let mut line = format!("{:<26}{:>12}{:>8}", row.kind, row.n_experiments, row.n_named);
            for name in self.quantities {
                let told = row.coverage.quantity(name).map_or_else(
                    || "-".into(),
                    |CoveredQuantity { within_95, rms, n, .. }| {
                        format!("{}; {rms:.1}; {n}", within_95.in_per_cent(0))
                    },
                );
                line.push_str(&format!("{told:>24}"));
            }
            say!("{line}  {}", row.warnings());
        }
    }
}

impl KindRow {
    fn of(kind: String, tables: &[Table]) -> Result<Self, Error> {
        let (mut n_named, mut warned_of) = (0, BTreeMap::new());
        for table in tables {
            n_named += usize::from(table.full_numbers("named")?.first().is_some_and(|named| *named > 0.0));
            for code in first_text(table, "warned_of")?.split_whitespace() {
                *warned_of.entry(code.to_owned()).or_insert(0) += 1;
            }
        }
        Ok(Self {
            kind,
            n_experiments: tables.len(),
            n_named,
            warned_of: warned_of.into_iter().collect(),
            coverage: Coverage::of(tables)?,
        })
    }

    /// How many intervals of a quantity were stated.
    fn n_stated(&self, quantity: &str) -> usize {
        self.coverage.quantity(quantity).map_or(0, |found| found.n)
    }

    /// The kinds of warnings, each with the number of experiments that have it.
    fn warnings(&self) -> String {
        let of = |(code, n): &(String, usize)| format!("{code} {n}");
        self.warned_of.iter().map(of).collect::<Vec<_>>().join(", ")
    }
}

/// What a column has throughout.
fn first_text(table: &Table, column: &str) -> Result<String, Error> {
    Ok(table.texts(column)?.into_iter().next().unwrap_or_default())
}
