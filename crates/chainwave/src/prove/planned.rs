//! What a plan foresees of the experiments of a proof, beside what they state, how far they are off, and the least that pixels allow.

use std::num::NonZero;
use std::path::Path;

use chainwave_experiment::{
    DampingBound, Experiment, PlannedResult, Precision, Setup, Table, Trial, damping_bound, foreseen,
};
use chainwave_measurement::median;
use serde_json::json;

use super::findings::MEDIAN_HALF_WIDTH;
use super::variant::Variant;
use crate::error::Error;
use crate::table::{self, column};
use crate::terminal::{say, tell};

/// The results of a plan, as a proof names them. What a plan foresees of a damping is what noise does to it; what is stated also holds what other
/// causes would make of it, which only the tracks tell.
const QUANTITIES: [(PlannedResult, &str); 9] = [
    (PlannedResult::Displacement, "displacement"),
    (PlannedResult::GroupVelocity, "group velocity"),
    (PlannedResult::HalfWidth, MEDIAN_HALF_WIDTH),
    (PlannedResult::ChainDamping, "c_d, noise alone"),
    (PlannedResult::StrikerDamping, "c_s, noise alone"),
    (PlannedResult::ChainDamping, "c_d, stated"),
    (PlannedResult::StrikerDamping, "c_s, stated"),
    (PlannedResult::PeakStrain, "peak strain"),
    (PlannedResult::PeakEnergy, "peak energy"),
];

/// One result of all experiments of one noise and striker.
struct PlannedRow {
    noise: f64,
    striker_m_per_s: f64,
    quantity: &'static str,
    /// The uncertainty that a plan foresees; none where it foresees no result.
    planned: Option<f64>,
    /// Median of the uncertainties that are stated.
    stated: f64,
    /// Root mean square of the errors.
    rms: f64,
    /// The least standard deviation that the pixels allow, where that is computed.
    bound: Option<f64>,
    n_experiments: usize,
}

/// Plans the experiments that have neither fault nor effect nor another chain or protocol, once for each noise and striker, and writes
/// `planned.parquet`; nothing where there are none.
///
/// # Errors
/// An experiment that cannot be planned, and tables that cannot be read or written.
pub(super) fn compare(
    out: &Path,
    (path, experiment, trials): (&Path, &Experiment, &[Trial]),
    proved: &[(&Variant, &Table)],
    n_threads: NonZero<usize>,
) -> Result<(), Error> {
    let plain: Vec<&(&Variant, &Table)> = proved.iter().filter(|(variant, _)| variant.is_plain()).collect();
    let mut settings: Vec<(f64, f64)> =
        plain.iter().map(|(variant, _)| (variant.noise, variant.striker_m_per_s)).collect();
    settings.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1)));
    settings.dedup_by(|one, other| is_same(*one, *other));
    let mut rows = Vec::new();
    for (noise, striker_m_per_s) in settings {
        let mut varied = experiment.clone();
        varied.vary(noise, striker_m_per_s);
        let setup = Setup::of(varied, trials.to_vec(), path, None)?;
        let planned = foreseen(&setup, n_threads)?;
        let bound = damping_bound(&setup).ok();
        let of_setting = plain.iter().filter(|(variant, _)| {
            is_same((variant.noise, variant.striker_m_per_s), (noise, striker_m_per_s))
        });
        let tables: Vec<&Table> = of_setting.map(|(_, table)| *table).collect();
        rows.extend(rows_of((noise, striker_m_per_s), &planned, bound, &tables)?);
    }
    if rows.is_empty() {
        return Ok(());
    }
    write(out, &rows)?;
    print(&rows);
    Ok(())
}

fn is_same(one: (f64, f64), other: (f64, f64)) -> bool {
    one.0.total_cmp(&other.0).is_eq() && one.1.total_cmp(&other.1).is_eq()
}

fn rows_of(
    (noise, striker_m_per_s): (f64, f64),
    planned: &Precision,
    bound: Option<DampingBound>,
    tables: &[&Table],
) -> Result<Vec<PlannedRow>, Error> {
    let mut rows = Vec::new();
    for (result, quantity) in QUANTITIES {
        let planned = planned.of(result);
        let bound = bound.and_then(|bound| match result {
            PlannedResult::ChainDamping => Some(bound.chain_damping_kg_per_s),
            PlannedResult::StrikerDamping => Some(bound.striker_damping_kg_per_s),
            _ => None,
        });
        let (mut sigmas, mut square) = (Vec::new(), 0.0);
        for table in tables {
            let (names, values) = (table.texts("quantity")?, table.full_numbers("value")?);
            let (of_each, truths) = (table.full_numbers("sigma")?, table.full_numbers("truth")?);
            for row in (0..names.len()).filter(|row| names[*row] == quantity) {
                sigmas.push(of_each[row]);
                square += (values[row] - truths[row]).powi(2);
            }
        }
        let n = sigmas.len() as f64;
        let Some(stated) = median(sigmas) else { continue };
        rows.push(PlannedRow {
            noise,
            striker_m_per_s,
            quantity,
            planned: planned.as_ref().ok().map(|planned| planned.sigma),
            stated,
            rms: (square / n).sqrt(),
            bound,
            n_experiments: tables.len(),
        });
    }
    Ok(rows)
}

fn write(out: &Path, rows: &[PlannedRow]) -> Result<(), Error> {
    let of = |value: &dyn Fn(&PlannedRow) -> f64| rows.iter().map(value).collect::<Vec<f64>>();
    let columns = vec![
        column("noise", of(&|row| row.noise)),
        column("striker_velocity_m_per_s", of(&|row| row.striker_m_per_s)),
        column("quantity", rows.iter().map(|row| row.quantity).collect::<Vec<_>>()),
        column("planned_sigma", rows.iter().map(|row| row.planned).collect::<Vec<_>>()),
        column("stated_sigma", of(&|row| row.stated)),
        column("rms_error", of(&|row| row.rms)),
        column("bound", rows.iter().map(|row| row.bound).collect::<Vec<_>>()),
        column("experiments", rows.iter().map(|row| row.n_experiments as u64).collect::<Vec<_>>()),
    ];
    table::write(&out.join("planned.parquet"), columns)
}

fn print(rows: &[PlannedRow]) {
    let of = |row: &PlannedRow| {
        json!({
            "noise": row.noise, "striker_velocity_m_per_s": row.striker_m_per_s, "quantity": row.quantity,
            "planned_sigma": row.planned, "stated_sigma": row.stated, "rms_error": row.rms, "bound": row.bound, "experiments": row.n_experiments,
        })
    };
    tell("planned", rows.iter().map(of).collect());
    let is_like = |one: &PlannedRow, other: &PlannedRow| {
        is_same((one.noise, one.striker_m_per_s), (other.noise, other.striker_m_per_s))
    };
    for rows in rows.chunk_by(is_like) {
        let setting = format!("noise x {}, {} m/s", rows[0].noise, rows[0].striker_m_per_s);
        say!(
            "{setting:<28}{:>14}{:>14}{:>10}{:>14}{:>14}",
            "planned sigma",
            "stated",
            "ratio",
            "rms error",
            "bound"
        );
        rows.iter().for_each(print_row);
    }
}

fn print_row(row: &PlannedRow) {
    let or_none = |value: Option<String>| value.unwrap_or_else(|| "-".into());
    let planned = or_none(row.planned.map(|planned| format!("{planned:.3e}")));
    let ratio = or_none(row.planned.map(|planned| format!("{:.2}", row.stated / planned)));
    let bound = or_none(row.bound.map(|bound| format!("{bound:.3e}")));
    let (stated, rms) = (row.stated, row.rms);
    say!("{:<28}{planned:>14}{stated:>14.3e}{ratio:>10}{rms:>14.3e}{bound:>14}", row.quantity);
}
