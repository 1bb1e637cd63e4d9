//! `extremes`: cases at the ends of what the program takes.

use crate::support::command::{chainwave, succeed};
use crate::support::table::Table;

#[test]
fn every_extreme_case_ends_as_expected() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("extremes");
    succeed(chainwave().arg("extremes").arg("--out").arg(&out));
    let table = Table::read(&out.join("extremes.parquet"));
    let columns = ["area", "case", "parameter", "value", "expected", "observed", "passed"];
    assert_eq!(table.names()[..columns.len()], columns);
    // The project's ranges: striker velocities, exponents, offsets, damping and bodies.
    let (parameters, values) = (table.texts("parameter"), table.full("value"));
    for (parameter, least, most) in [
        ("velocity_m_per_s", 1e-9, 1e3),
        ("p", 0.01, 3.0),
        ("delta_0_m", 1e-12, 1.0),
        ("share_of_critical", 1e-3, 1e6),
        ("n_bodies", 10.0, 1e6),
    ] {
        let of_parameter = || parameters.iter().zip(&values).filter(|(name, _)| *name == parameter);
        let reached = |fold: fn(f64, f64) -> f64, from: f64| of_parameter().map(|(_, v)| *v).fold(from, fold);
        let range = (reached(f64::min, f64::INFINITY), reached(f64::max, 0.0));
        assert_eq!(range, (least, most), "{parameter}");
    }
    // None of the chain model's cases needs its right to refuse.
    let areas = table.texts("area");
    let errors = table.numbers("error");
    let mechanics = areas.iter().zip(errors).filter(|(area, _)| *area == "mechanics");
    assert!(mechanics.into_iter().all(|(_, error)| error.is_some()));
    assert!(out.join("extremes.png").exists() && out.join("extremes.svg").exists());
}
