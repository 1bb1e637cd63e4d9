//! What each kind of fault does to the results.

use std::path::Path;

use chainwave_experiment::Table;

use super::coverage::Coverage;
use crate::error::Error;
use crate::table::{self, column};

/// The quantities that stand for the rest.
const QUANTITIES: [&str; 4] = ["displacement", "group velocity", "c_d, tracks", "trigger offset"];

/// What one kind of fault does.
struct Row {
    fault: String,
    n_experiments: usize,
    /// Experiments whose failures, warnings or decisions name the recording at fault; without a fault, those with a warning.
    n_named: usize,
    coverage: Coverage,
}

/// Writes `faults.parquet` (one row a fault and quantity), and prints it.
pub(super) fn write(folder: &Path, tables: &[Table]) -> Result<(), Error> {
    let rows = rows(tables)?;
    let cells = || {
        let of_row = |row| QUANTITIES.iter().filter_map(move |name| Some((row, *name, of(row, name)?)));
        rows.iter().flat_map(of_row)
    };
    let columns = vec![
        column("fault", cells().map(|(row, ..)| row.fault.as_str()).collect::<Vec<_>>()),
        column("n_experiments", cells().map(|(row, ..)| row.n_experiments as u64).collect::<Vec<_>>()),
        column("n_named", cells().map(|(row, ..)| row.n_named as u64).collect::<Vec<_>>()),
        column("quantity", cells().map(|(_, name, _)| name).collect::<Vec<_>>()),
        column("within_95", cells().map(|(.., (within, _))| within.value).collect::<Vec<_>>()),
        column("within_95_uncertainty", cells().map(|(.., (within, _))| within.sigma).collect::<Vec<_>>()),
        column("bias_sigma", cells().map(|(.., (_, bias))| bias.value).collect::<Vec<_>>()),
        column("bias_uncertainty", cells().map(|(.., (_, bias))| bias.sigma).collect::<Vec<_>>()),
    ];
    table::write(&folder.join("faults.parquet"), columns)?;
    print(&rows);
    Ok(())
}

fn of(row: &Row, name: &str) -> Option<(chainwave_measurement::Estimate, chainwave_measurement::Estimate)> {
    row.coverage.of_quantity(name)
}

fn rows(tables: &[Table]) -> Result<Vec<Row>, Error> {
    let mut by_fault: Vec<(String, usize, Vec<Table>)> = Vec::new();
    for table in tables {
        let fault = table.texts("fault")?.into_iter().next().unwrap_or_default();
        let named = usize::from(table.full_numbers("named")?.first().is_some_and(|named| *named > 0.0));
        match by_fault.iter_mut().find(|(known, ..)| *known == fault) {
            Some((_, n_named, found)) => {
                *n_named += named;
                found.push(table.clone());
            }
            None => by_fault.push((fault, named, vec![table.clone()])),
        }
    }
    let row = |(fault, n_named, found): (String, usize, Vec<Table>)| {
        Ok(Row { fault, n_experiments: found.len(), n_named, coverage: Coverage::of(&found)? })
    };
    by_fault.into_iter().map(row).collect()
}

#[expect(clippy::print_stdout, reason = "the table is the command's result")]
fn print(rows: &[Row]) {
    println!(
        "{:<18}{:>12}{:>8}  95 % intervals that hold: {}",
        "fault",
        "experiments",
        "named",
        QUANTITIES.join("; ")
    );
    for row in rows {
        let share = |name: &&str| {
            of(row, name).map_or_else(
                || "-".into(),
                |(within, _)| format!("{:.0} +- {:.0}", 100.0 * within.value, 100.0 * within.sigma),
            )
        };
        let shares: Vec<String> = QUANTITIES.iter().map(share).collect();
        println!("{:<18}{:>12}{:>8}  {}", row.fault, row.n_experiments, row.n_named, shares.join("; "));
    }
}
