//! Films know their own truth, whatever an experiment that evaluates them states.

use std::fs;

use crate::support::command::{chainwave, succeed};
use crate::support::laboratory::Laboratory;

/// What a share of intervals held is at least: if all samples of a body share one error, the mean over 12 bodies of 95 % scatters by
/// 0.95 and 0.05 over 12, to the root, and three times that is allowed.
const LEAST_PER_CENT: f64 = 76.0;

#[test]
fn some_recordings_in_another_order_are_compared_with_what_was_filmed_of_them() {
    let laboratory = Laboratory::new();
    let films = laboratory.path("films");
    succeed(laboratory.filming(&films).args(["--seed", "7"]));
    let table = fs::read_to_string(laboratory.path("trials.csv")).expect("it was written");
    let (header, rows) = table.split_once('\n').expect("a header and rows");
    let mut some: Vec<&str> = rows.lines().filter(|row| !row.contains("trial1")).collect();
    some.reverse();
    laboratory.write("trials.csv", &format!("{header}\n{}\n", some.join("\n")));

    let mut run = chainwave();
    run.arg("run").arg(laboratory.path("experiment.toml")).arg("--recordings").arg(&films);
    let summary = succeed(run.arg("--out").arg(laboratory.path("results")));

    let said = summary.lines().find(|line| line.contains("intervals hold")).expect("the films have a truth");
    let held = said.split("intervals hold ").nth(1).and_then(|rest| rest.split(' ').next());
    let held_per_cent: f64 = held.and_then(|held| held.parse().ok()).expect("a share");
    assert!(held_per_cent >= LEAST_PER_CENT, "{said}");
}
