//! What the uncertainty of each planned result comes from, for programs.

use chainwave_experiment::{Plan, VarianceShare};
use serde_json::{Value, json};

/// What was foreseen of each result, by the keys of its value and its sigma; both null of one that would not be there.
pub(crate) fn foreseen_as_json(plan: &Plan) -> Value {
    let foreseen = plan.forecasts.iter().flat_map(|forecast| {
        let [value, sigma] = forecast.result.keys();
        let found = forecast.estimate.as_ref().ok();
        [
            (value.into(), json!(found.map(|found| found.value))),
            (sigma.into(), json!(found.map(|found| found.sigma))),
        ]
    });
    Value::Object(foreseen.collect())
}

/// For each key of a sigma the sources of its variance with their shares, largest first.
pub(crate) fn limits_as_json(plan: &Plan) -> Value {
    let of = |one: &VarianceShare| json!({ "source": one.source, "share": one.share });
    let limits = plan
        .forecasts
        .iter()
        .map(|one| (one.result.keys()[1].to_owned(), one.shares.iter().map(of).collect()));
    Value::Object(limits.collect())
}
