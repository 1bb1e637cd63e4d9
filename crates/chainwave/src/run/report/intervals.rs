//! What chi squared itself says of the dampings, beside their standard uncertainties.

use chainwave_inference::TrackFit;
use chainwave_measurement::Estimate;

use super::markup::{Cell, table};

/// The intervals of c_d, and of c_s where there is a striker, by profile likelihood and by drawing trials anew, where the tracks were fitted.
pub(super) fn section(fit: &TrackFit) -> String {
    let dampings = [
        ("c_d (g/s)", 1e3, fit.damping.chain_damping_kg_per_s),
        ("c_s (kg/s)", 1.0, fit.damping.striker_damping_kg_per_s),
    ];
    // A chain that is let go has no striker's contact.
    let n_told = if fit.model.is_let_go() { 1 } else { 2 };
    let row = |(i, (name, unit, damping)): (usize, (&str, f64, Estimate))| {
        let profile = fit.intervals_95[i];
        let ends = |low: f64, high: f64| Cell::Number(format!("{:.5} to {:.5}", unit * low, unit * high));
        let half = Estimate::COVERAGE_95 * damping.sigma;
        let drawn = fit.bootstrap.map(|found| found[i].interval_95(damping.value));
        vec![
            Cell::text(name),
            Cell::Number(format!("{:.5}", unit * damping.value)),
            ends(damping.value - half, damping.value + half),
            ends(profile.low, profile.high),
            drawn.map_or_else(|| Cell::text("a view has a single trial"), |(low, high)| ends(low, high)),
            Cell::text(if profile.is_quadratic {
                "a parabola: σ says all"
            } else {
                "no parabola: the profile holds"
            }),
        ]
    };
    let heads = [
        "",
        "fitted",
        "95 % by σ",
        "95 % by profile likelihood",
        "95 % by drawing trials anew",
        "χ² near its least is",
    ];
    format!(
        "<h2>Likelihood of the dampings</h2><p>The profile holds one damping, fits everything else anew, and ends where χ² has risen by 3.84 (times \
         the residuals' excess over the stated noise, and with what the model's error may do). Drawing trials anew, view by view, has the \
         differences between trials in it that no model knows.</p>{}",
        table(&heads, dampings.into_iter().take(n_told).enumerate().map(row))
    )
}
