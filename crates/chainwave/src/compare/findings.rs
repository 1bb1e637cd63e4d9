//! The table of a study: each number, whence it is, and what was published.

use std::fmt::Write as _;
use std::path::Path;

use chainwave_analysis::damping_share;
use chainwave_measurement::Estimate;

use super::parts::{Compared, LawResults, Struck};
use super::study::{Published, Quantity, Study};
use crate::error::Error;
use crate::output::write_text;
use crate::table::{self, column};
use crate::wave::Wave;

/// A number of the table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ComparedValue {
    quantity: Quantity,
    /// Where it comes from.
    source: String,
    /// The number; its sigma is 0 where a model gives it.
    value: Estimate,
}

/// Every number that a study yields, quantity by quantity.
pub(super) fn all(study: &Study, compared: &Compared) -> Vec<ComparedValue> {
    let mut findings = weak_group_velocities(compared);
    findings.extend(compared.strikes.iter().flat_map(speeds));
    findings.extend(compared.laws.iter().filter_map(|law| variation_of_law(study, law)));
    findings.extend(growths(study, compared));
    findings.extend(compared.laws.iter().flat_map(|law| losses(study, law)));
    findings.sort_by_key(|finding| finding.quantity);
    findings
}

fn exact(quantity: Quantity, source: String, value: f64) -> ComparedValue {
    ComparedValue { quantity, source, value: Estimate::new(value, 0.0) }
}

fn weak_group_velocities(compared: &Compared) -> Vec<ComparedValue> {
    let weakest = |law: &LawResults| {
        let row = law.scan.iter().min_by(|a, b| a.striker_m_per_s.total_cmp(&b.striker_m_per_s))?;
        let source = format!("chain model, {}, struck at {} m/s", law.name, row.striker_m_per_s);
        Some(exact(Quantity::WeakGroupVelocity, source, row.group_m_per_s))
    };
    compared.laws.iter().filter_map(weakest).collect()
}

/// Group velocity after a strike and its variation, of the experiment and of both models.
fn speeds(struck: &Struck) -> Vec<ComparedValue> {
    let of = |wave: &Wave| {
        let source = format!("{}, struck at {} m/s", wave.name, struck.velocity_m_per_s);
        let speed = wave.speed?;
        let group = ComparedValue {
            quantity: Quantity::GroupVelocity,
            source: format!("{source}, gaps {} to {}", speed.gaps.0, speed.gaps.1),
            value: speed.group_m_per_s,
        };
        let variation = speed.variation.map(|value| ComparedValue {
            quantity: Quantity::GroupVelocityVariation,
            source,
            value,
        });
        Some(std::iter::once(group).chain(variation).collect::<Vec<_>>())
    };
    struck.waves().into_iter().filter_map(of).flatten().collect()
}

/// The variation by a law at the scan's strike nearest to the first strike.
fn variation_of_law(study: &Study, law: &LawResults) -> Option<ComparedValue> {
    let wanted = study.strikes.first()?.velocity_m_per_s.get();
    let apart = |striker_m_per_s: f64| (striker_m_per_s - wanted).abs();
    let row = law.scan.iter().min_by(|a, b| apart(a.striker_m_per_s).total_cmp(&apart(b.striker_m_per_s)))?;
    let source = format!("chain model, {}, struck at {} m/s", law.name, row.striker_m_per_s);
    Some(exact(Quantity::GroupVelocityVariation, source, row.variation?))
}

/// How much the front widens in the experiment, from its first to its last half width, and in the long chain from the first to the last
/// time at which pulses are shown.
fn growths(study: &Study, compared: &Compared) -> Vec<ComparedValue> {
    let measured = |struck: &Struck| {
        let widths = &struck.experiment.half_widths;
        let (first, last) = (widths.first()?, widths.last()?);
        let ratio = last.hwhm_m.value / first.hwhm_m.value;
        let relative = (last.hwhm_m.sigma / last.hwhm_m.value).hypot(first.hwhm_m.sigma / first.hwhm_m.value);
        Some(ComparedValue {
            quantity: Quantity::HalfWidthGrowth,
            source: format!(
                "experiment, struck at {} m/s, {:.1} to {:.1} ms, rising in {:.0} % of the steps",
                struck.velocity_m_per_s,
                1e3 * first.t_s,
                1e3 * last.t_s,
                100.0 * struck.experiment.rising_share()
            ),
            value: Estimate::new(ratio, ratio * relative),
        })
    };
    let long = || {
        let times_s = study.long_chain.profile_times_s.iter().chain(&study.long_chain.pulse_times_s);
        let mut known: Vec<(f64, f64)> =
            times_s.filter_map(|time_s| Some((*time_s, compared.long.half_width_m(*time_s)?))).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (first, last) = (known.first()?, known.last()?);
        let rises = known.windows(2).filter(|pair| pair[1].1 > pair[0].1).count();
        let source = format!(
            "rings, long chain, {:.1} to {:.1} ms, rising in {rises} of {} steps between the times shown",
            1e3 * first.0,
            1e3 * last.0,
            known.len() - 1
        );
        Some(exact(Quantity::HalfWidthGrowth, source, last.1 / first.1))
    };
    compared.strikes.iter().filter_map(measured).chain(long()).collect()
}

/// What dispersion and rarefaction took at the last gap, and what damping took besides.
fn losses(study: &Study, law: &LawResults) -> Vec<ComparedValue> {
    let shares = damping_share(&law.damped_j, &law.undamped_j);
    let Some(share) = shares.get(study.energy_gap.saturating_sub(1)) else { return Vec::new() };
    let source = || format!("chain model, {}, gap {}", law.name, share.gap);
    vec![
        exact(Quantity::UndampedDrop, source(), share.spread),
        exact(Quantity::DampingShare, source(), share.damped),
    ]
}

/// Writes `comparison.csv` and `comparison.md`.
pub(super) fn write(out: &Path, study: &Study, findings: &[ComparedValue]) -> Result<(), Error> {
    let published =
        |finding: &ComparedValue| study.published.iter().find(|one| one.quantity == finding.quantity);
    let off = |finding: &ComparedValue| Some(finding.value.value / published(finding)?.value? - 1.0);
    let of = |text: &dyn Fn(&ComparedValue) -> String| findings.iter().map(text).collect::<Vec<_>>();
    let known = |sigma: f64| (sigma > 0.0).then_some(sigma);
    let columns = vec![
        column("quantity", of(&|one| one.quantity.as_str().into())),
        column("unit", of(&|one| one.quantity.unit().into())),
        column("published", of(&|one| published(one).map_or_else(String::new, |known| known.said.clone()))),
        column("source", of(&|one| one.source.clone())),
        column("value", findings.iter().map(|one| one.value.value).collect::<Vec<_>>()),
        column("sigma", findings.iter().map(|one| known(one.value.sigma)).collect::<Vec<_>>()),
        column("relative_difference", findings.iter().map(off).collect::<Vec<_>>()),
    ];
    table::write(&out.join("comparison.csv"), columns)?;
    write_text(&out.join("comparison.md"), &page(&study.published, findings))
}

/// The page: what was published, what is found here, and why they differ, quantity by quantity.
fn page(published: &[Published], findings: &[ComparedValue]) -> String {
    let mut text = String::from("# What was published, and what is found here\n");
    for of_one in findings.chunk_by(|a, b| a.quantity == b.quantity) {
        let quantity = of_one[0].quantity;
        let unit = match quantity.unit() {
            "" => String::new(),
            unit => format!(" ({unit})"),
        };
        // Writing to a string cannot fail.
        let _ = write!(text, "\n## {}{unit}\n\n", capital(quantity.as_str()));
        let known = published.iter().find(|one| one.quantity == quantity);
        if let Some(known) = known {
            let _ = write!(text, "Published: {}. {}\n\n", known.said, known.why);
        }
        if quantity == Quantity::GroupVelocity {
            let _ = write!(text, "{}\n\n", fall(of_one));
        }
        text.push_str("| source | found | sigma | against the published |\n|---|---|---|---|\n");
        for finding in of_one {
            let Estimate { value, sigma } = finding.value;
            let sigma = if sigma > 0.0 { short(sigma, 2) } else { String::new() };
            let off = known.and_then(|known| known.value).map(|known| 100.0 * (value / known - 1.0));
            let off = off.map_or_else(String::new, |off| format!("{off:+.1} %"));
            let _ = writeln!(text, "| {} | {} | {sigma} | {off} |", finding.source, short(value, 4));
        }
    }
    text
}

/// In which sources the group velocity falls from each strike to the next faster one, as it is found here.
fn fall(speeds: &[ComparedValue]) -> String {
    let name = |one: &ComparedValue| one.source.split(',').next().unwrap_or_default().to_owned();
    let mut names: Vec<String> = speeds.iter().map(name).collect();
    names.sort();
    names.dedup();
    // Strikes come from the fastest to the slowest, as the study lists them.
    let falls = |whose: &String| {
        let of_one: Vec<f64> =
            speeds.iter().filter(|one| name(one) == *whose).map(|one| one.value.value).collect();
        of_one.windows(2).all(|pair| pair[0] < pair[1])
    };
    let (falling, others): (Vec<String>, Vec<String>) = names.into_iter().partition(falls);
    let listed = |names: &[String]| if names.is_empty() { "none".into() } else { names.join(", ") };
    format!("It falls with every faster strike here in: {}; not in: {}.", listed(&falling), listed(&others))
}

/// A number with so many significant digits, without powers of ten.
fn short(value: f64, digits: i32) -> String {
    let magnitude = if value.abs() > 0.0 { value.abs().log10().floor() as i32 } else { 0 };
    let decimals = (digits - 1 - magnitude).clamp(0, 12) as usize;
    format!("{value:.decimals$}")
}

/// The text with a capital first letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_significant_digits() {
        assert_eq!(short(0.78512, 4), "0.7851");
        assert_eq!(short(53.9876, 4), "53.99");
        assert_eq!(short(-0.000_123_4, 2), "-0.00012");
        assert_eq!(short(123_456.0, 4), "123456");
        assert_eq!(short(0.0, 2), "0.0");
    }

    #[test]
    fn a_fall_is_said_of_those_that_have_it() {
        let speed = |whose: &str, value| exact(Quantity::GroupVelocity, format!("{whose}, struck"), value);
        let found = [speed("rings", 41.7), speed("chain", 41.6), speed("rings", 37.3), speed("chain", 43.9)];
        assert_eq!(fall(&found), "It falls with every faster strike here in: chain; not in: rings.");
    }

    #[test]
    fn a_quantity_has_its_published_number_above_all_that_is_found_of_it() {
        let published = Published {
            quantity: Quantity::UndampedDrop,
            said: "76.8 %".into(),
            value: Some(0.768),
            why: "Its law is not known.".into(),
        };
        let found = |source: &str, value| exact(Quantity::UndampedDrop, source.into(), value);
        let findings = [
            ComparedValue {
                quantity: Quantity::GroupVelocity,
                source: "x".into(),
                value: Estimate::new(47.0, 0.031),
            },
            found("law 1", 0.768),
            found("law 2", 0.384),
        ];
        let page = page(&[published], &findings);
        assert_eq!(page.matches("76.8 %. Its law is not known.").count(), 1);
        assert!(
            page.contains("## Group velocity (m/s)") && page.contains("| x | 47.00 | 0.031 |  |"),
            "{page}"
        );
        assert!(page.contains("It falls with every faster strike here in: x; not in: none."), "{page}");
        assert!(page.contains("| law 1 | 0.7680 |  | +0.0 % |"), "{page}");
        assert!(page.contains("| law 2 | 0.3840 |  | -50.0 % |"), "{page}");
    }
}
