//! `chainwave tradeoff`: what each method of a step costs on the user's own scene, and how far it is off.
//!
//! Errors come from comparisons that know the truth: patches of the recording's own picture, shifted by known amounts under the
//! recording's own noise, and the film's own motion as the method that follows most sees it; a far more accurate simulation of the same chain, or a
//! far finer mesh of the same rings. Final results have no truth: their stated uncertainties are compared, of whole runs. Times are measured here, on the work itself: the shortest of a few repetitions, on one thread.

mod integrators;
mod results;
mod rings;
mod scene;
mod simulations;
mod tracking;

use std::path::Path;

use chainwave_experiment::Setup;
use chainwave_figures::{TradeOff, TradeOffPoint, trade_off};
use serde_json::json;

use crate::cli;
use crate::error::Error;
use crate::on_demand;
use crate::outcome::Outcome;
use crate::output::{make_folder, remove_unfinished};
use crate::simulate::is_ring_scene;
use crate::table::{self, column};
use crate::terminal::{say, tell};

/// One method of one step.
#[derive(Debug, Clone, PartialEq)]
struct Rung {
    /// What it does, such as `tracking`.
    step: &'static str,
    method: String,
    settings: String,
    /// None where nothing was found.
    error: Option<f64>,
    error_unit: &'static str,
    seconds_per_item: f64,
    items: u64,
}

/// Measures the ladder of every step that the inputs allow.
pub(crate) fn tradeoff(arguments: &cli::Tradeoff) -> Result<Outcome, Error> {
    let left_out = match tracks_any(arguments) {
        true => on_demand::expect_all_methods()?,
        false => None,
    };
    make_folder(&arguments.out)?;
    remove_unfinished(&arguments.out)?;
    let mut outcome = Outcome::default();
    let (mut rungs, mut budgets) = (Vec::new(), Vec::new());
    for input in &arguments.inputs {
        if scene::is_experiment(input) && is_ring_scene(input)? {
            match rings::of_scene(input) {
                Ok(found) => rungs.extend(found),
                Err(error) => outcome.fail(error),
            }
            continue;
        }
        match scene::open(input, arguments).and_then(|scene| tracking::ladder(&scene)) {
            Ok(found) => rungs.extend(found),
            Err(error) => outcome.fail(error),
        }
        if scene::is_experiment(input) {
            match integrators::of_experiment(input) {
                Ok(found) => rungs.extend(found),
                Err(error) => outcome.fail(error),
            }
        }
        if scene::is_experiment(input) && arguments.results {
            match of_results(input) {
                Ok((found, told)) => {
                    rungs.extend(found);
                    budgets.extend(told);
                }
                Err(error) => outcome.fail(error),
            }
        }
    }
    if rungs.is_empty() {
        return Err(Error::nothing_left("inputs", arguments.inputs.len()));
    }
    let rungs = averaged(rungs);
    let on_front: Vec<bool> = rungs.iter().map(|rung| is_on_front(rung, &rungs)).collect();
    write(&arguments.out, &rungs, &on_front)?;
    print(&rungs, &on_front, left_out.as_deref());
    budgets.iter().for_each(|line| say!("{line}"));
    Ok(outcome)
}

/// Whole runs of an experiment, of its fastest striker where there are several, and what limits their results.
fn of_results(input: &Path) -> Result<(Vec<Rung>, Vec<String>), Error> {
    let whole = Setup::read(input, None)?;
    let setup = whole.by_striker().into_iter().next().unwrap_or(whole);
    Ok((results::ladder(&setup)?, results::budgets(&setup)?))
}

/// Whether the methods of tracking are tried: on all inputs but scenes of rings.
fn tracks_any(arguments: &cli::Tradeoff) -> bool {
    // What cannot be read is told where it is read for good.
    let of_rings = |input: &Path| scene::is_experiment(input) && is_ring_scene(input).unwrap_or(true);
    !arguments.inputs.iter().all(|input| of_rings(input))
}

/// One rung for each step, method and settings: over several scenes the errors' root mean square, and the times' mean.
fn averaged(rungs: Vec<Rung>) -> Vec<Rung> {
    let mut merged: Vec<(Rung, f64)> = Vec::new();
    for rung in rungs {
        let same = |(other, _): &&mut (Rung, f64)| {
            (other.step, &other.method, &other.settings) == (rung.step, &rung.method, &rung.settings)
        };
        match merged.iter_mut().find(same) {
            Some((known, n)) => {
                known.error = known
                    .error
                    .zip(rung.error)
                    .map(|(mean, error)| ((mean.powi(2) * *n + error.powi(2)) / (*n + 1.0)).sqrt());
                known.seconds_per_item = (known.seconds_per_item * *n + rung.seconds_per_item) / (*n + 1.0);
                known.items += rung.items;
                *n += 1.0;
            }
            None => merged.push((rung, 1.0)),
        }
    }
    merged.into_iter().map(|(rung, _)| rung).collect()
}

/// Whether no other method of the step is at least as good in both respects and better in one.
fn is_on_front(rung: &Rung, all: &[Rung]) -> bool {
    let Some(error) = rung.error else { return false };
    let beats = |other: &Rung| {
        other.step == rung.step
            && other.seconds_per_item <= rung.seconds_per_item
            && other.error.is_some_and(|of_other| {
                of_other < error || of_other <= error && other.seconds_per_item < rung.seconds_per_item
            })
    };
    !all.iter().any(beats)
}

fn write(folder: &Path, rungs: &[Rung], on_front: &[bool]) -> Result<(), Error> {
    let columns = vec![
        column("step", rungs.iter().map(|rung| rung.step).collect::<Vec<_>>()),
        column("method", rungs.iter().map(|rung| rung.method.as_str()).collect::<Vec<_>>()),
        column("settings", rungs.iter().map(|rung| rung.settings.as_str()).collect::<Vec<_>>()),
        column("error", rungs.iter().map(|rung| rung.error).collect::<Vec<_>>()),
        column("error_unit", rungs.iter().map(|rung| rung.error_unit).collect::<Vec<_>>()),
        column("seconds_per_item", rungs.iter().map(|rung| rung.seconds_per_item).collect::<Vec<_>>()),
        column("items", rungs.iter().map(|rung| rung.items).collect::<Vec<_>>()),
        column("on_front", on_front.to_vec()),
    ];
    table::write(&folder.join("tradeoff.parquet"), columns)?;
    let mut steps: Vec<&'static str> = rungs.iter().map(|rung| rung.step).collect();
    steps.dedup();
    for step in steps {
        let of_step: Vec<(&Rung, &bool)> =
            rungs.iter().zip(on_front).filter(|(rung, _)| rung.step == step).collect();
        let point = |(rung, on_front): &(&Rung, &bool)| {
            Some(TradeOffPoint {
                name: format!("{} {}", rung.method, rung.settings).trim_end().to_owned(),
                seconds_per_item: rung.seconds_per_item,
                error: rung.error?,
                on_front: **on_front,
            })
        };
        let unit = of_step.first().map_or("", |(rung, _)| rung.error_unit);
        let figure = TradeOff {
            time_label: if unit == "%" { "time of a run (s)".into() } else { "time per item (s)".into() },
            error_label: match unit {
                "%" if step.contains('_') => format!("standard uncertainty of ${step}$ (%)"),
                "%" => format!("standard uncertainty of {step} (%)"),
                _ => format!("error ({unit})"),
            },
            points: of_step.iter().filter_map(point).collect(),
        };
        trade_off(&folder.join(format!("tradeoff-{step}")), &figure)?;
    }
    Ok(())
}

fn print(rungs: &[Rung], on_front: &[bool], left_out: Option<&str>) {
    let of = |(rung, on_front): (&Rung, &bool)| {
        json!({
            "step": rung.step, "method": rung.method, "settings": rung.settings, "error": rung.error,
            "error_unit": rung.error_unit, "seconds_per_item": rung.seconds_per_item, "on_front": on_front,
        })
    };
    tell("rungs", rungs.iter().zip(on_front).map(of).collect());
    say!("{:<12}{:<36}{:>12} {:<10}{:>12}  front", "step", "method", "error", "unit", "s per item");
    for (rung, on_front) in rungs.iter().zip(on_front) {
        let name = format!("{} {}", rung.method, rung.settings);
        let mark = if *on_front { "  *" } else { "" };
        let error = rung.error.map_or("-".into(), |error| format!("{error:.3e}"));
        say!(
            "{:<12}{name:<36}{error:>12} {:<10}{:>12.3e}{mark}",
            rung.step,
            rung.error_unit,
            rung.seconds_per_item
        );
    }
    if let Some(left_out) = left_out {
        say!("{left_out}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rung(method: &str, error: impl Into<Option<f64>>, seconds_per_item: f64) -> Rung {
        let (step, error_unit) = ("tracking", "px");
        Rung {
            step,
            method: method.into(),
            settings: String::new(),
            error: error.into(),
            error_unit,
            seconds_per_item,
            items: 10,
        }
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let rungs = [rung("a", 1.0, 1.0), rung("b", 0.5, 2.0), rung("c", 1.0, 3.0), rung("d", None, 0.1)];
        let front: Vec<bool> = rungs.iter().map(|one| is_on_front(one, &rungs)).collect();
        assert_eq!(front, [true, true, false, false]);
    }

    #[test]
    fn scenes_are_averaged_in_the_square() {
        let merged = averaged(vec![rung("a", 3.0, 1.0), rung("a", 4.0, 3.0), rung("b", 1.0, 1.0)]);
        assert_eq!(merged.len(), 2);
        // Rounding.
        assert!(
            merged[0].error.is_some_and(|error| (error - 12.5_f64.sqrt()).abs() < 1e-14)
                && (merged[0].seconds_per_item - 2.0).abs() < 1e-14
        );
        assert_eq!(merged[0].items, 20);
    }
}
