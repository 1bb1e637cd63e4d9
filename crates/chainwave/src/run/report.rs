//! `report.html`.

use std::fmt::Write;
use std::path::Path;

use chainwave_experiment::{Decision, Evaluation, Results, Setup, Standing};

use super::figures::Figure;
use super::summary::{Row, rows};
use crate::error::Error;
use crate::output::write_text;

/// Style of the page: plain, and readable on paper.
const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}\
table{border-collapse:collapse;margin:1rem 0}th,td{padding:.25rem .8rem;text-align:left;border-bottom:1px solid #ddd}\
td.n{text-align:right;font-variant-numeric:tabular-nums}figure{margin:2rem 0}img{max-width:100%}figcaption{color:#555}";

/// Writes `report.html`: the numbers, the figures, what was decided and why, and how the recordings were aligned.
pub(crate) fn write(setup: &Setup, out: &Path, results: &Results, figures: &[Figure]) -> Result<(), Error> {
    let Results { evaluation, truth, decisions, .. } = results;
    let name = escaped(&setup.experiment.name);
    let body = [
        format!("<h1>{name}</h1>{}", introduction(setup, evaluation)),
        numbers(&rows(evaluation, truth.as_ref())),
        figures.iter().map(figure).collect(),
        decisions_table(decisions),
        alignment_table(evaluation),
        "<h2>Provenance</h2><p>Version, settings and recordings stand in <a href=\"provenance.toml\">provenance.toml</a>, all \
         numbers in <a href=\"results.json\">results.json</a> and the Parquet tables beside it.</p>"
            .to_owned(),
    ]
    .concat();
    let page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}</title><style>{STYLE}</style></head>\
         <body>{body}</body></html>\n"
    );
    write_text(&out.join("report.html"), &page)
}

fn introduction(setup: &Setup, evaluation: &Evaluation) -> String {
    let mut text = format!(
        "<p>{} bodies, {} of {} recordings. Every number stands with its standard uncertainty.</p>",
        setup.experiment.chain.n_bodies,
        evaluation.stitched.alignments.len(),
        setup.trials.len()
    );
    for warning in &evaluation.warnings() {
        text.push_str(&format!("<p><strong>Warning:</strong> {}</p>", escaped(&warning.to_string())));
    }
    text
}

fn numbers(rows: &[Row]) -> String {
    let known = rows.iter().any(|row| row.truth.is_some());
    let truth_head = if known { "<th>truth</th>" } else { "" };
    let mut text =
        format!("<h2>Results</h2><table><tr><th></th><th>measured</th><th>uncertainty</th>{truth_head}</tr>");
    for row in rows {
        let truth = row.truth.map_or_else(String::new, |truth| format!("<td class=\"n\">{truth:.5}</td>"));
        let _infallible = match &row.measured {
            Ok(estimate) => write!(
                text,
                "<tr><td>{}</td><td class=\"n\">{:.5}</td><td class=\"n\">{:.5}</td>{truth}</tr>",
                escaped(&row.name),
                estimate.value,
                estimate.sigma
            ),
            Err(reason) => {
                write!(
                    text,
                    "<tr><td>{}</td><td colspan=\"3\">{}</td></tr>",
                    escaped(&row.name),
                    escaped(reason)
                )
            }
        };
    }
    text.push_str("</table>");
    text
}

fn figure(figure: &Figure) -> String {
    format!(
        "<figure><img src=\"figures/{0}.svg\" alt=\"{1}\"><figcaption>{1} (<a href=\"figures/{0}.png\">PNG</a>)</figcaption></figure>",
        figure.name,
        escaped(&figure.caption)
    )
}

fn decisions_table(decisions: &[Decision]) -> String {
    let row = |decision: &Decision| {
        format!(
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escaped(decision.question),
            escaped(&decision.choice),
            escaped(&decision.rule),
            escaped(&decision.evidence)
        )
    };
    let rows: String = decisions.iter().map(row).collect();
    format!(
        "<h2>What was modelled, and why</h2><table><tr><th>question</th><th>choice</th><th>rule</th><th>evidence</th></tr>{rows}</table>"
    )
}

fn alignment_table(evaluation: &Evaluation) -> String {
    let standings = &evaluation.standings;
    let row = |(one, standing): (&chainwave_stitching::Alignment, &Standing)| {
        format!(
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{:+.2} ± {:.2}</td>\
             <td class=\"n\">{:+.3} ± {:.3}</td><td class=\"n\">{:.2}</td></tr>",
            escaped(&one.recording),
            one.view,
            one.trial,
            1e6 * standing.trigger_offset_s.value,
            1e6 * standing.trigger_offset_s.sigma,
            100.0 * standing.drive_deviation.value,
            100.0 * standing.drive_deviation.sigma,
            one.scatter_ratio
        )
    };
    let rows: String = evaluation.stitched.alignments.iter().zip(&standings.of_recordings).map(row).collect();
    format!(
        "<h2>Recordings</h2><p>Trigger offsets and drives are taken from {}.</p><table><tr><th>recording</th><th>view</th><th>trial</th><th>trigger offset (µs)</th>\
         <th>drive (%)</th><th>residuals over stated noise</th></tr>{rows}</table>",
        standings.source
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
