//! `report.html`: one file, which needs no other and no network. What went wrong comes first.

mod budget;
mod intervals;
mod markup;
mod prediction;
mod recordings;
mod settings;
mod wave;

use std::path::Path;

use chainwave_camera::vision_library;
use chainwave_experiment::{Decision, Evaluation, Plan, Results, Setup, State, TRACKS};
use chainwave_inference::TrackFit;
use chainwave_measurement::Estimate;

use self::markup::{Cell, escaped, inlined, table};
use super::accuracy::Reached;
use super::figures::Figure;
use super::summary::{Row, rows};
use crate::error::Error;
use crate::output::{read_bytes, write_text};

/// Style of the page: plain, light and dark, readable on paper and on a narrow screen.
const STYLE: &str = include_str!("report/style.css");

/// What rehearsals told, where they were asked for.
pub(super) struct Rehearsed<'a> {
    /// What the uncertainty of each result comes from.
    pub(super) budget: Option<&'a Plan>,
    /// What became of the accuracy that was asked for.
    pub(super) reached: Option<&'a [Reached<'a>]>,
}

/// Writes `report.html`: what went wrong, the numbers, the figures, what was decided and why, how it was measured, and every recording.
pub(crate) fn write(
    setup: &Setup,
    out: &Path,
    results: &Results,
    figures: &[Figure],
    rehearsed: &Rehearsed<'_>,
) -> Result<(), Error> {
    let shown = figures.iter().map(|one| figure(out, one)).collect::<Result<String, _>>()?;
    let body = [
        format!("<h1>{}</h1>{}", escaped(&setup.experiment.name), introduction(setup, results)),
        problems(setup, results),
        format!("<h2>Results</h2>{}", numbers_table(&rows(&results.evaluation, results.truth.as_ref()))),
        believed_fit(&results.evaluation).map_or_else(String::new, intervals::section),
        rehearsed.reached.map_or_else(String::new, prediction::asked),
        rehearsed.budget.map_or_else(String::new, |plan| prediction::section(plan, &results.evaluation)),
        rehearsed.budget.map_or_else(String::new, budget::section),
        wave::section(&results.evaluation),
        format!("<h2>Figures</h2>{shown}"),
        decisions_table(&results.decisions),
        settings::section(setup, results),
        recordings::section(setup, results),
        provenance(""),
    ];
    write_text(&out.join("report.html"), &page(&setup.experiment.name, &body.concat()))
}

/// One velocity of the striker among several: what it was processed with, what came out, and the folder of its results.
pub(super) struct Velocity<'a> {
    pub(super) setup: &'a Setup,
    pub(super) evaluation: &'a Evaluation,
    pub(super) folder: String,
}

/// Writes the `report.html` of an experiment of several striker velocities: what differs among them, and the way to each.
pub(super) fn write_comparison(
    out: &Path,
    velocities: &[Velocity<'_>],
    figures: &[Figure],
) -> Result<(), Error> {
    let Some(first) = velocities.first() else { return Ok(()) };
    let name = &first.setup.experiment.name;
    let shown = figures.iter().map(|one| figure(out, one)).collect::<Result<String, _>>()?;
    let section = |one: &Velocity<'_>| {
        let velocity_m_per_s = one.setup.experiment.nominal_drive().value;
        let folder = escaped(&one.folder);
        format!(
            "<h2>Striker at {velocity_m_per_s} m/s</h2><p><a href=\"{folder}/report.html\">Its report</a>, with all of its figures, decisions and \
             recordings.</p>{}{}",
            list("problems", warnings_of(one.evaluation)),
            numbers_table(&rows(one.evaluation, None))
        )
    };
    let sections: String = velocities.iter().map(section).collect();
    let body = format!(
        "<h1>{}</h1><p>{} striker velocities.</p><h2>Group velocity</h2>{shown}{sections}{}",
        escaped(name),
        velocities.len(),
        provenance("its folder's ")
    );
    write_text(&out.join("report.html"), &page(name, &body))
}

/// Warnings and refusals of one evaluation, as items of a list.
fn warnings_of(evaluation: &Evaluation) -> Vec<String> {
    let refusals = evaluation.damping.refusals().into_iter();
    let refused =
        refusals.map(|(name, reason)| format!("<strong>{name}</strong> is refused: {}", escaped(reason)));
    refused.chain(evaluation.warnings().iter().map(|warning| escaped(&warning.to_string()))).collect()
}

/// Items that are markup already, as a list; nothing where there are none.
fn list(class: &str, items: Vec<String>) -> String {
    let items: String = items.into_iter().map(|item| format!("<li>{item}</li>")).collect();
    match items.is_empty() {
        true => String::new(),
        false => format!("<section class=\"{class}\"><ul>{items}</ul></section>"),
    }
}

/// A page with a title.
fn page(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>{}</title><style>{STYLE}</style></head><body><main>{body}</main></body></html>\n",
        escaped(title)
    )
}

fn introduction(setup: &Setup, results: &Results) -> String {
    format!(
        "<p>{} bodies; {} of {} recordings are in the motion. Every number stands with its standard uncertainty.</p>",
        setup.experiment.chain.n_bodies,
        results.evaluation.stitched.alignments.len(),
        setup.trials.len()
    )
}

/// What may not be trusted: recordings that are missing, results that were refused, warnings.
fn problems(setup: &Setup, results: &Results) -> String {
    let states = results.recording_states(setup);
    let missing = states.iter().filter(|one| one.state != State::Used).map(|one| {
        let state = if one.state == State::Failed { "could not be used" } else { "was left out" };
        let reason = one.reason.as_deref().unwrap_or("no reason is known");
        format!("<strong>{}</strong> {state}: {}", escaped(&one.recording), escaped(reason))
    });
    let mut said: Vec<String> = missing.collect();
    let of_findings = results.tracked.findings.iter().map(|finding| escaped(&finding.to_string()));
    for one in of_findings.chain(warnings_of(&results.evaluation)) {
        if !said.contains(&one) {
            said.push(one);
        }
    }
    match said.is_empty() {
        true => "<p><strong>Nothing contradicts:</strong> all recordings are used, no result is refused, and there is no warning.</p>".to_owned(),
        false => format!("<h2>Look at this first</h2>{}", list("problems", said)),
    }
}

/// Values with their intervals, and the truth where it is known.
fn numbers_table(rows: &[Row]) -> String {
    let is_known = rows.iter().any(|row| row.truth.is_some());
    let row = |row: &Row| {
        let mut cells = vec![Cell::text(&row.name)];
        match &row.measured {
            Ok(Estimate { value, sigma }) => {
                let half = Estimate::COVERAGE_95 * sigma;
                let relative = 100.0 * sigma / value.abs();
                cells.extend([
                    Cell::Number(format!("{value:.5}")),
                    Cell::Number(format!("{sigma:.5}")),
                    Cell::Number(format!("{:.5} to {:.5}", value - half, value + half)),
                    Cell::Number(if relative.is_finite() { format!("{relative:.3}") } else { String::new() }),
                ]);
            }
            Err(reason) => cells.push(Cell::text(reason)),
        }
        let known = row.truth.filter(|_| is_known && row.measured.is_ok());
        cells.extend(known.map(|truth| Cell::Number(format!("{truth:.5}"))));
        cells
    };
    let mut heads = vec!["", "measured", "σ", "95 % interval", "σ (%)"];
    heads.extend(is_known.then_some("truth"));
    table(&heads, rows.iter().map(row))
}

/// The fit to the tracks, where the dampings are taken from it.
fn believed_fit(evaluation: &Evaluation) -> Option<&TrackFit> {
    let is_source = evaluation.damping.source == Some(TRACKS);
    evaluation.track_fit.as_ref().ok().filter(|_| is_source)
}

/// A figure, in the page itself.
fn figure(out: &Path, figure: &Figure) -> Result<String, Error> {
    let name = &figure.name;
    let svg = read_bytes(&out.join("figures").join(format!("{name}.svg")))?;
    Ok(format!(
        "<figure><img src=\"{0}\" alt=\"{1}\"><figcaption>{1} (<a href=\"figures/{name}.svg\">SVG</a>, \
         <a href=\"figures/{name}.png\">PNG</a>)</figcaption></figure>",
        inlined("image/svg+xml", &svg),
        escaped(&figure.caption)
    ))
}

fn decisions_table(decisions: &[Decision]) -> String {
    let row = |decision: &Decision| {
        [decision.question, &*decision.choice, &*decision.rule, &*decision.evidence].map(Cell::text).into()
    };
    let heads = ["question", "choice", "rule", "evidence"];
    format!("<h2>What was modelled, and why</h2>{}", table(&heads, decisions.iter().map(row)))
}

/// `where_from` is what stands before the files' names.
fn provenance(where_from: &str) -> String {
    let with =
        vision_library().map(|library| format!(" with OpenCV {}", library.version())).unwrap_or_default();
    let link = |name: &str| match where_from.is_empty() {
        true => format!("<a href=\"{name}\">{name}</a>"),
        false => format!("{where_from}{name}"),
    };
    format!(
        "<h2>Provenance</h2><p>chainwave {}{with}. Settings and recordings with their fingerprints stand in {}, all numbers in {} and the \
         Parquet tables beside it.</p>",
        env!("CARGO_PKG_VERSION"),
        link("provenance.toml"),
        link("results.json"),
    )
}
