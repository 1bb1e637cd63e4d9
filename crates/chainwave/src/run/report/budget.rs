//! What the uncertainty of each result comes from, as a plan of the experiment as it was filmed tells.

use chainwave_experiment::{Forecast, Plan, VarianceShare};

use super::markup::{Cell, table};

/// A table of each result with the shares of its variance.
pub(super) fn section(plan: &Plan) -> String {
    let rows = plan.forecasts.iter().map(|Forecast { result, estimate, shares }| {
        let (relative, from) = match estimate {
            Ok(found) => {
                let relative = 100.0 * (found.sigma / found.value).abs();
                (
                    Cell::Number(format!("{relative:.3}")),
                    shares.iter().map(in_words).collect::<Vec<_>>().join(", "),
                )
            }
            Err(reason) => (Cell::text(""), format!("none: {reason}")),
        };
        vec![Cell::text(result.in_words()), relative, Cell::text(&from)]
    });
    format!(
        "<h2>Error budget</h2><p>Shares of the variance of each result, from a rehearsal of the stated chain as it was filmed: each source of error \
         is halved in turn, with the same seeds. Shares below 20 % are not told from none. What no rehearsal foresees, such as a camera that moves or \
         a chain that is not what is stated, comes on top and stands above as a warning or a decision.</p>{}",
        table(&["result", "σ (%)", "from"], rows)
    )
}

fn in_words(one: &VarianceShare) -> String {
    format!("{} {:.0} %", one.source, 100.0 * one.share)
}
