//! `chainwave plan`: what an experiment will tell before it is filmed or run, what limits it, what it costs, and which change would help.

use std::time::Instant;

use chainwave_experiment::{Cost, Forecast, Plan, PlannedResult, Setup};
use serde_json::{Map, Value, json};

use crate::cli;
use crate::error::Error;
use crate::on_demand;
use crate::outcome::Outcome;
use crate::parallel::threads;
use crate::plan_json::limits_as_json;
use crate::progress;
use crate::run::warnings_as_json;
use crate::terminal::{answer, is_json, say};

/// Gains below this are not told from none: the uncertainties of two plans, of some hundred replicas each, scatter by some per cent.
const TOLD_GAIN: f64 = 1.1;

/// Plans the trials of each striker velocity, and prints what follows.
pub(crate) fn plan(arguments: &cli::Plan) -> Result<Outcome, Error> {
    let whole = Setup::read(&arguments.experiment, arguments.recordings.as_deref())?;
    on_demand::expect_recordings_of(&whole)?;
    let mut plans = Vec::new();
    for setup in whole.by_striker() {
        let bar = progress::bar("planning", 0);
        let show = progress::shown_on(&bar);
        let begin = Instant::now();
        let now_s = || begin.elapsed().as_secs_f64();
        let monitor = progress::monitor(&show);
        let plan = chainwave_experiment::plan(&setup, threads(arguments.jobs), &monitor, &now_s)?;
        plans.push((setup, plan));
    }
    if !is_json() {
        plans.iter().for_each(|(setup, plan)| say!("{}", in_words(setup, plan)));
        return Ok(Outcome::default());
    }
    let mut all: Vec<Value> = plans.iter().map(|(setup, plan)| as_json(setup, plan)).collect();
    let found = match all.len() {
        1 => all.remove(0),
        _ => json!({ "strikers": all }),
    };
    answer(&found);
    Ok(Outcome::default())
}

fn as_json(setup: &Setup, plan: &Plan) -> Value {
    let mut found = cost_as_json(&plan.cost);
    if let Some(striker) = &setup.experiment.striker {
        found.insert("striker_velocity_m_per_s".into(), json!(striker.velocity_m_per_s.get()));
    }
    found.insert("n_filmed".into(), json!(plan.n_filmed));
    found.insert("reading_sigma_px".into(), json!(plan.reading_sigma_px));
    found.insert("assumed".into(), json!(plan.assumed));
    found.insert("warnings".into(), warnings_as_json(&plan.findings));
    for Forecast { result, estimate, .. } in &plan.forecasts {
        let [value, sigma] = result.keys();
        match estimate {
            Ok(estimate) => {
                found.insert(value.into(), json!(estimate.value));
                found.insert(sigma.into(), json!(estimate.sigma));
            }
            Err(reason) => {
                found.insert(format!("{value}_refused"), json!(reason));
            }
        }
    }
    found.insert("limits".into(), limits_as_json(plan));
    let changes = plan.changes.iter().map(|one| {
        let mut change = cost_as_json(&one.cost);
        let factors = one.factors.iter().map(|(result, factor)| (result.keys()[1].into(), json!(factor)));
        change.insert("change".into(), json!(one.change));
        change.insert("factors".into(), Value::Object(factors.collect()));
        Value::Object(change)
    });
    found.insert("changes".into(), changes.collect());
    Value::Object(found)
}

fn cost_as_json(cost: &Cost) -> Map<String, Value> {
    let Cost { n_recordings, bytes, n_readings, seconds, seconds_with_causes, tracking_s } = *cost;
    let all = [
        ("n_recordings", json!(n_recordings)),
        ("bytes", json!(bytes)),
        ("n_readings", json!(n_readings)),
        ("seconds", json!(seconds)),
        ("seconds_with_causes", json!(seconds_with_causes)),
        ("tracking_s", json!(tracking_s)),
    ];
    all.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn in_words(setup: &Setup, plan: &Plan) -> String {
    let name = &setup.experiment.name;
    let driven = match &setup.experiment.striker {
        Some(striker) => format!("struck at {} m/s", striker.velocity_m_per_s.get()),
        None => format!("driven by {}", setup.experiment.driven_otherwise().unwrap_or("nothing")),
    };
    let filmed = match plan.n_filmed {
        0 => "none filmed yet".to_owned(),
        n => format!("{n} filmed"),
    };
    let mut lines = vec![
        format!("{name}, {driven}: {} ({filmed})", cost_in_words(&plan.cost)),
        format!("a body is read to {:.2e} px in a frame", plan.reading_sigma_px),
    ];
    lines.extend(plan.findings.iter().map(|finding| format!("warning: {finding}")));
    lines.extend(plan.assumed.iter().map(|assumed| format!("assumed: {assumed}")));
    lines.push(format!("\n{:<20}{:>14}{:>12}{:>12}   from", "", "expected", "sigma", "relative"));
    lines.extend(plan.forecasts.iter().map(|Forecast { result, estimate, shares }| {
        let name = format!("{} ({})", result.in_words(), result.unit());
        let from: Vec<String> =
            shares.iter().map(|one| format!("{} {:.0} %", one.source, 100.0 * one.share)).collect();
        match estimate {
            Ok(found) => {
                let relative = format!("{:.2e}", (found.sigma / found.value).abs());
                let from = from.join(", ");
                format!("{name:<20}{:>14.5e}{:>12.2e}{relative:>12}   {from}", found.value, found.sigma)
            }
            Err(reason) => format!("{name:<20}there will be none: {reason}"),
        }
    }));
    lines.push("\nhow many times smaller each sigma would be with".to_owned());
    for change in &plan.changes {
        lines.push(format!("  {}: {}", change.change, gains(&change.factors)));
        lines.push(format!("    {}", cost_in_words(&change.cost)));
    }
    lines.extend(most_helpful(plan));
    lines.join("\n")
}

/// For each change that helps some results most, these results with their gains.
fn most_helpful(plan: &Plan) -> Vec<String> {
    let gain = |change: usize, result: usize| plan.changes[change].factors[result].1.unwrap_or(0.0);
    let n_changes = plan.changes.len();
    let best = |result: &usize| {
        let best = (0..n_changes).max_by(|one, other| gain(*one, *result).total_cmp(&gain(*other, *result)));
        best.filter(|best| gain(*best, *result) >= TOLD_GAIN)
    };
    let helped_by = |change: usize| {
        let helped: Vec<String> = (0..plan.forecasts.len())
            .filter(|result| best(result) == Some(change))
            .map(|result| format!("{} {:.1}", plan.forecasts[result].result.in_words(), gain(change, result)))
            .collect();
        (!helped.is_empty())
            .then(|| format!("helps most: {} ({})", plan.changes[change].change, helped.join(", ")))
    };
    (0..n_changes).filter_map(helped_by).collect()
}

/// The gains that are told from none, and the losses.
fn gains(factors: &[(PlannedResult, Option<f64>)]) -> String {
    let told: Vec<String> = factors
        .iter()
        .filter_map(|(result, factor)| Some((result, (*factor)?)))
        .filter(|(_, factor)| *factor >= TOLD_GAIN || *factor <= TOLD_GAIN.recip())
        .map(|(result, factor)| format!("{} {factor:.2}", result.in_words()))
        .collect();
    if told.is_empty() { "nothing".to_owned() } else { told.join(", ") }
}

fn cost_in_words(cost: &Cost) -> String {
    let bytes = cost.bytes as f64;
    let (size, unit) =
        [(1e12, "TB"), (1e9, "GB")].into_iter().find(|(size, _)| bytes >= *size).unwrap_or((1e6, "MB"));
    format!(
        "{} recordings, {:.2} {unit} in all; a run takes about {} here, {} if the tracks ask for more than the stated model",
        cost.n_recordings,
        bytes / size,
        time_in_words(cost.seconds),
        time_in_words(cost.seconds_with_causes)
    )
}

fn time_in_words(seconds: f64) -> String {
    match seconds {
        long if long >= 5400.0 => format!("{:.1} h", long / 3600.0),
        long if long >= 90.0 => format!("{:.0} min", long / 60.0),
        short => format!("{short:.0} s"),
    }
}
