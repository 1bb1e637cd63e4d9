//! What final results cost and how certain they are: whole runs of the user's own experiment, each with less of something.

use std::num::NonZero;
use std::time::Instant;

use chainwave_correlation::{Interpolation, Shape, ShapeChoice};
use chainwave_experiment::{Forecast, MemoryStore, Monitor, PlannedResult, Setup, outcome, plan};
use chainwave_measurement::Estimate;

use super::Rung;
use crate::error::Error;
use crate::progress;

/// Results whose certainty is told, with their steps.
const RESULTS: [(PlannedResult, &str); 3] = [
    (PlannedResult::GroupVelocity, "c_g"),
    (PlannedResult::HalfWidth, "HWHM"),
    (PlannedResult::ChainDamping, "c_d"),
];
const ONE_THREAD: NonZero<usize> = NonZero::<usize>::MIN;

/// Runs the experiment in several ways: each result's relative standard uncertainty, and the seconds of a run on one thread. Of another
/// method what it makes of the same pictures counts too, as a method's own error is not in its sigma.
///
/// # Errors
/// An experiment that cannot be run as it is stated.
pub(super) fn ladder(setup: &Setup) -> Result<Vec<Rung>, Error> {
    let variants = variants(setup);
    let bar = progress::bar("whole runs", variants.len() as u64);
    let mut rungs = Vec::new();
    let mut as_stated = None;
    for (index, SetupVariant { settings, setup: variant, is_other_method }) in
        variants.into_iter().enumerate()
    {
        let begin = Instant::now();
        let results = match variant.run(&MemoryStore::default(), ONE_THREAD, &Monitor::SILENT) {
            Ok(results) => results,
            Err(error) if index == 0 => return Err(error.into()),
            // Too little is left for a result.
            Err(_) => {
                bar.inc(1);
                continue;
            }
        };
        let seconds = begin.elapsed().as_secs_f64();
        let found = outcome(&results.evaluation);
        let stated = as_stated.get_or_insert_with(|| found.clone());
        for (result, step) in RESULTS {
            let (estimate, stated) = (found.of(result), stated.of(result));
            let departure = |found: &Estimate| {
                let stated = stated.as_ref().ok().filter(|_| is_other_method);
                stated.map_or(0.0, |stated| found.value - stated.value)
            };
            let error = |found: &Estimate| 100.0 * (found.sigma.hypot(departure(found)) / found.value).abs();
            rungs.push(Rung {
                step,
                method: variant.method().to_string(),
                settings: settings.clone(),
                error: estimate.as_ref().ok().map(error),
                error_unit: "%",
                seconds_per_item: seconds,
                items: 1,
            });
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    rungs.sort_by_key(|rung| RESULTS.iter().position(|(_, step)| *step == rung.step));
    Ok(rungs)
}

/// What the uncertainty of each of these results comes from, as a plan of the experiment as it is stated tells: a line each.
///
/// # Errors
/// As of a plan.
pub(super) fn budgets(setup: &Setup) -> Result<Vec<String>, Error> {
    let plan = plan(setup, ONE_THREAD, &Monitor::SILENT, &|| 0.0)?;
    let told = plan.forecasts.iter().filter_map(|Forecast { result, shares, .. }| {
        let (_, step) = RESULTS.iter().find(|(one, _)| one == result)?;
        let shares: Vec<String> =
            shares.iter().map(|one| format!("{} {:.0} %", one.source, 100.0 * one.share)).collect();
        Some(match shares.is_empty() {
            true => format!("sigma of {step} comes from many sources, none above 20 % of its variance"),
            false => format!("sigma of {step} comes from: {} of its variance", shares.join(", ")),
        })
    });
    Ok(told.collect())
}

/// One way to run an experiment.
struct SetupVariant {
    settings: String,
    setup: Setup,
    /// Whether the same pixels are matched by another method.
    is_other_method: bool,
}

/// The experiment as it is stated, and with less of one thing at a time.
fn variants(setup: &Setup) -> Vec<SetupVariant> {
    let (settings, is_other_method) = ("as stated".to_owned(), false);
    let mut all = vec![SetupVariant { settings, setup: setup.clone(), is_other_method }];
    let mut add = |settings: String, change: &dyn Fn(&mut Setup)| {
        let mut changed = setup.clone();
        change(&mut changed);
        let is_other_method = changed.method() != setup.method();
        all.push(SetupVariant { settings, setup: changed, is_other_method });
    };
    let most = setup.trials_a_view();
    let mut fewer = vec![most.div_ceil(2), 1];
    fewer.dedup();
    for n in fewer.into_iter().filter(|n| *n < most) {
        add(format!("{n} of {most} trials"), &|changed| changed.keep_first_trials(n));
    }
    let tracking = &setup.experiment.tracking;
    if tracking.outline_px.is_empty() {
        for part in [0.7, 0.5] {
            let half = |whole: usize| ((part * whole as f64).round() as usize).max(1);
            let halves = [half(tracking.half_width_px), half(tracking.half_height_px)];
            add(format!("subsets of {} x {} px", 2 * halves[0] + 1, 2 * halves[1] + 1), &|changed| {
                let tracking = &mut changed.experiment.tracking;
                [tracking.half_width_px, tracking.half_height_px] = halves;
            });
        }
    }
    for interpolation in [Interpolation::CubicMoms, Interpolation::Linear] {
        if tracking.interpolation != interpolation {
            add(String::new(), &|changed| changed.experiment.tracking.interpolation = interpolation);
        }
    }
    let shift = ShapeChoice::Named(Shape::Translation);
    if tracking.shape != shift {
        add(String::new(), &|changed| changed.experiment.tracking.shape = shift);
    }
    all
}
