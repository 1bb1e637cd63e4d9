//! Each experiment of a proof by itself: what it came to in one line, so that a count over many can be kept small and any one of them be
//! counted again.

use std::fmt::Write;
use std::path::Path;

use chainwave_experiment::Table;

use super::coverage::{Coverage, CoveredQuantity};
use crate::error::Error;
use crate::output::write_text;

/// The columns of `experiments.csv`, each with the quantity that it stands for.
const QUANTITIES: [(&str, &str); 12] = [
    ("displacement", "displacement"),
    ("displacement_by_model", "displacement by model"),
    ("strain", "strain"),
    ("peak_strain", "peak strain"),
    ("peak_time", "peak time"),
    ("peak_energy", "peak energy"),
    ("hwhm", "HWHM"),
    ("group_velocity", "group velocity"),
    ("c_d", "c_d, stated"),
    ("c_s", "c_s, stated"),
    ("trigger_offset", "trigger offset"),
    ("drive", "drive"),
];
/// Columns of the findings of which at most one says something else than `none`.
const KINDS: [&str; 5] = ["fault", "effect", "chain", "protocol", "other_chain"];

/// Writes `experiments.csv`: of each experiment its kind, and of each quantity how many intervals at 95 % it states, how many of them hold the
/// truth, and the rms error in standard uncertainties.
pub(super) fn write(folder: &Path, tables: &[Table]) -> Result<(), Error> {
    let mut text = "kind,seed,noise,striker_velocity_m_per_s,named".to_owned();
    for (name, _) in QUANTITIES {
        text += &format!(",{name}_n,{name}_within_95,{name}_rms_sigma");
    }
    text.push('\n');
    for table in tables {
        text += &line(table)?;
        text.push('\n');
    }
    write_text(&folder.join("experiments.csv"), &text)
}

fn line(table: &Table) -> Result<String, Error> {
    let mut line = kind(table)?;
    for column in ["seed", "noise", "striker_velocity_m_per_s", "named"] {
        let value = table.full_numbers(column)?.into_iter().next().unwrap_or_default();
        // Writing to a text cannot fail.
        let _ = write!(line, ",{value}");
    }
    let coverage = Coverage::of(std::slice::from_ref(table))?;
    for (_, quantity) in QUANTITIES {
        let _ = match coverage.quantity(quantity) {
            Some(CoveredQuantity { n, within_95, rms, .. }) => {
                write!(line, ",{n},{},{rms:.2}", (within_95.value * *n as f64).round())
            }
            None => write!(line, ",0,0,"),
        };
    }
    Ok(line)
}

/// What is not as the experiment states it; `none` where all is.
fn kind(table: &Table) -> Result<String, Error> {
    for column in KINDS {
        let kind = table.texts(column)?.into_iter().next();
        if let Some(kind) = kind.filter(|kind| kind != super::findings::NONE) {
            return Ok(kind);
        }
    }
    Ok(super::findings::NONE.to_owned())
}
