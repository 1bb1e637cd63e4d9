//! What the uncertainty of each planned result comes from, for programs.

use chainwave_experiment::{Plan, VarianceShare};
use serde_json::{Value, json};

/// For each key of a sigma the sources of its variance with their shares, largest first.
pub(crate) fn limits_as_json(plan: &Plan) -> Value {
    let of = |one: &VarianceShare| json!({ "source": one.source, "share": one.share });
    let limits = plan
        .results
        .iter()
        .map(|(result, _, shares)| (result.keys()[1].to_owned(), shares.iter().map(of).collect()));
    Value::Object(limits.collect())
}
