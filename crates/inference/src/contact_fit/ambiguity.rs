//! What a curve cannot tell apart, in sentences for people.

use chainwave_mechanics::PowerLaw;

use super::outcome::{ContactFit, PARAMETERS, Zero};

/// Correlations from here on leave two parameters to trade against each other.
const TRADING: f64 = 0.95;

/// What the data cannot tell apart, a sentence each.
pub(super) fn ambiguities(fit: &ContactFit) -> Vec<String> {
    let mut found = vec![of_the_exponent(fit)];
    found.extend(of_pairs(fit));
    found.push(of_zero(fit));
    found.extend(of_the_overlaps(fit));
    found.extend(of_the_residuals(fit));
    found.extend(of_outliers(fit));
    found
}

/// Readings that lie far out.
fn of_outliers(fit: &ContactFit) -> Option<String> {
    let outlier = fit.residual.outlier?;
    let like_it = match outlier.n_like_it {
        1 => "no other does".to_owned(),
        n => format!("so do {} others", n - 1),
    };
    Some(format!(
        "outliers: the reading at an overlap of {:.3e} m lies {:+.2e} N, {:.0} deviations of the residuals, from the law, and {like_it}; they bend the law \
         and widen every sigma (hint: fit the curve without them)",
        outlier.overlap_m, outlier.off_n, outlier.deviations
    ))
}

/// The range of p, and what delta_0, a and k_0 do along it.
fn of_the_exponent(fit: &ContactFit) -> String {
    let profile = &fit.profile;
    let spread = |of: fn(&PowerLaw) -> f64| {
        let ends = [profile.laws.first(), profile.laws.last()].map(|end| end.map_or(0.0, |end| of(&end.law)));
        (ends[0], ends[1])
    };
    let (a, delta_0_m, k_0) =
        (spread(|law| law.a), spread(|law| law.delta_0_m), spread(PowerLaw::k_0_n_per_m));
    let change = 100.0 * (k_0.1 / k_0.0 - 1.0).abs();
    let mut text = format!(
        "p: {:.4} to {:.4} fit as well as the best (95 %), with delta_0_m going from {:.3e} to {:.3e} and a from {:.4} to {:.4}, \
         while k_0_n_per_m changes by {change:.2} %",
        profile.low, profile.high, delta_0_m.0, delta_0_m.1, a.0, a.1
    );
    if profile.open_below {
        text.push_str("; p has no lower limit: a law as flat as a logarithm fits as well, and a and f_0_n have no upper one");
    }
    if profile.open_above {
        text.push_str("; p has no upper limit: a law as steep as an exponential fits as well");
    }
    text
}

/// Pairs among a, delta_0 and p that trade against each other.
fn of_pairs(fit: &ContactFit) -> Option<String> {
    let pairs = [(0, 1), (0, 2), (1, 2)];
    let trading: Vec<String> = pairs
        .into_iter()
        .filter(|(i, j)| fit.correlation[*i][*j].abs() >= TRADING)
        .map(|(i, j)| format!("{} and {} ({:+.4})", PARAMETERS[i], PARAMETERS[j], fit.correlation[i][j]))
        .collect();
    (!trading.is_empty()).then(|| {
        format!(
            "errors that trade against each other (correlation): {}; use them together, or not at all",
            trading.join(", ")
        )
    })
}

/// Where force and overlap are zero.
fn of_zero(fit: &ContactFit) -> String {
    let offset = fit.load_cell_offset_n.map_or_else(
        || {
            "is undetermined (nothing was read before contact, and what the law misses would look like one)"
                .to_owned()
        },
        |offset| format!("is {:.3e} +- {:.1e} N when fitted along", offset.value, offset.sigma),
    );
    match fit.zero {
        Zero::Contact => "zero: the force before contact is the load cell's offset, and contact starts where the law leaves it".into(),
        Zero::LoadCell => format!(
            "zero: the load cell's offset {offset} and was taken out; an overlap counted from another place than first contact would \
             look the same"
        ),
        _ => format!(
            "zero: force and overlap were taken as zero together; the load cell's offset {offset}, and cannot be told from an overlap \
             counted from another place"
        ),
    }
}

/// Overlaps that err.
fn of_the_overlaps(fit: &ContactFit) -> Option<String> {
    let overlap_noise_m = fit.residual.overlap_noise_m?;
    Some(format!(
        "noise: forces scatter the more, the steeper the curve is, as overlaps that err by {overlap_noise_m:.1e} m make them; each force was weighted by its \
         own noise"
    ))
}

/// Residuals that are not noise.
fn of_the_residuals(fit: &ContactFit) -> Option<String> {
    let residual = &fit.residual;
    (residual.widening > 1.0).then(|| {
        format!(
            "residuals: they follow each other (neighbours are correlated by {:.2}), so they are no independent noise (the law is an approximation, or the load \
             cell drifts): every sigma was widened by {:.2}, and beyond the measured overlaps the law is not to be trusted",
            residual.autocorrelation, residual.widening
        )
    })
}
