//! What was foreseen of each result beside what came out.

use chainwave_experiment::{Evaluation, Forecast, Plan, outcome};
use chainwave_measurement::Estimate;

use super::super::accuracy::Reached;
use super::markup::{Cell, table};

/// A plan's predictions and the outcome are told from each other beyond this ratio: uncertainties by 200 replicas scatter by 5 % each, and a
/// plan is promised to 30 %.
const TOLD_RATIO: f64 = 1.3;

/// A table of each result's uncertainty as a rehearsal of the stated experiment foresees it, and as the run states it.
pub(super) fn section(plan: &Plan, evaluation: &Evaluation) -> String {
    let found = outcome(evaluation);
    let rows = plan.forecasts.iter().map(|Forecast { result, estimate: foreseen, .. }| {
        let found = found.of(*result);
        let told = foreseen.as_ref().ok().zip(found.as_ref().ok());
        let ratio = told.map(|(foreseen, found)| found.sigma / foreseen.sigma);
        let said = match (foreseen, found, ratio) {
            (Err(_), Err(reason), _) | (Ok(_), Err(reason), _) => format!("none: {reason}"),
            (Err(_), Ok(_), _) => "more than was foreseen".into(),
            (_, _, Some(ratio)) if ratio > TOLD_RATIO => {
                "less certain than noise and schedule alone would have it: see the warnings and decisions"
                    .into()
            }
            (_, _, Some(ratio)) if ratio < TOLD_RATIO.recip() => "more certain than was foreseen".into(),
            _ => "as foreseen".into(),
        };
        vec![
            Cell::text(result.in_words()),
            Cell::Number(relative(foreseen)),
            Cell::Number(relative(found)),
            Cell::Number(ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}"))),
            Cell::text(&said),
        ]
    });
    format!(
        "<h2>Prediction and outcome</h2><p>The uncertainty of each result as a rehearsal of the stated chain, filmed as it was, foresees it, and as \
         the recordings have it. A ratio beyond {TOLD_RATIO} says that something is there which the experiment does not state.</p>{}",
        table(&["result", "σ foreseen (%)", "σ found (%)", "ratio", ""], rows)
    )
}

/// A table of what was asked for.
pub(super) fn asked(reached: &[Reached<'_>]) -> String {
    let rows = reached.iter().map(|one| {
        vec![
            Cell::text(&one.outlook.aim.to_string()),
            Cell::Number(relative(&one.outlook.expected)),
            Cell::Number(relative(&one.found)),
            Cell::text(if one.is_met() { "reached" } else { "missed" }),
        ]
    });
    format!(
        "<h2>Accuracy asked for</h2><p>What was looked at for it stands among the decisions.</p>{}",
        table(&["asked", "σ foreseen (%)", "σ found (%)", ""], rows)
    )
}

fn relative(found: &Result<Estimate, String>) -> String {
    found
        .as_ref()
        .map_or_else(|_| String::new(), |found| format!("{:.3}", 100.0 * (found.sigma / found.value).abs()))
}
