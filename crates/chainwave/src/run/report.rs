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
use chainwave_experiment::{Decision, Evaluation, Plan, RecordingState, Results, Setup, State, TRACKS};
use chainwave_inference::TrackFit;
use chainwave_measurement::Estimate;

use self::markup::{Cell, escaped, inlined, table};
use super::accuracy::Reached;
use super::ended::{Done, End, Evaluated};
use super::figures::Figure;
use super::outputs::{PROVENANCE, REPORT, RESULTS};
use super::summary::{SummaryRow, rows};
use crate::digits::decimals;
use crate::error::Error;
use crate::output::{FIGURES_FOLDER, read_bytes, write_text};

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
    states: &[RecordingState],
    figures: &[Figure],
    rehearsed: &Rehearsed<'_>,
) -> Result<(), Error> {
    let shown = figures.iter().map(|one| figure(out, one)).collect::<Result<String, _>>()?;
    let body = [
        format!("<h1>{}</h1>{}", escaped(&setup.experiment.name), introduction(setup, results, states)),
        problems(results, states),
        format!("<h2>Results</h2>{}", numbers_table(&rows(&results.evaluation, results.truth.as_ref()))),
        believed_fit(&results.evaluation).map_or_else(String::new, intervals::section),
        rehearsed.reached.map_or_else(String::new, prediction::asked),
        rehearsed.budget.map_or_else(String::new, |plan| prediction::section(plan, &results.evaluation)),
        rehearsed.budget.map_or_else(String::new, budget::section),
        wave::section(&results.evaluation),
        format!("<h2>Figures</h2>{shown}"),
        decisions_table(&results.decisions),
        settings::section(setup, results),
        recordings::section(results, states),
        provenance(""),
    ];
    write_text(&out.join(REPORT), &page(&setup.experiment.name, &body.concat()))
}

/// One velocity of the striker among several: what became of it, and the folder of its results.
pub(super) struct OneOfSeveral<'a> {
    pub(super) setup: &'a Setup,
    pub(super) done: &'a Done,
    pub(super) folder: String,
}

impl OneOfSeveral<'_> {
    fn title(&self) -> String {
        format!("Striker at {} m/s", self.setup.experiment.nominal_drive().value)
    }

    /// Why nothing follows from it, where nothing does.
    fn failure(&self) -> Option<String> {
        match &self.done.end {
            End::Evaluated(_) => None,
            End::Unsolved(reason) => Some(reason.clone()),
            End::Nothing(error) => Some(error.to_string()),
        }
    }

    fn section(&self) -> Option<String> {
        let End::Evaluated(found) = &self.done.end else { return None };
        let Evaluated { evaluation, .. } = found.as_ref();
        Some(format!(
            "<h2>{}</h2><p><a href=\"{}/{REPORT}\">Its report</a>, with all of its figures, decisions and recordings.</p>{}{}",
            self.title(),
            escaped(&self.folder),
            list("problems", warnings_of(evaluation)),
            numbers_table(&rows(evaluation, None))
        ))
    }
}

/// Writes the `report.html` of an experiment of several striker velocities: those that failed, what differs among the others, and the way to each.
pub(super) fn write_comparison(
    out: &Path,
    name: &str,
    velocities: &[OneOfSeveral<'_>],
    figures: &[Figure],
) -> Result<(), Error> {
    let shown = figures.iter().map(|one| figure(out, one)).collect::<Result<String, _>>()?;
    let failed = velocities.iter().filter_map(|one| {
        let missing = missing(&one.done.states);
        let reasons = std::iter::once(escaped(&one.failure()?)).chain(missing).collect();
        Some(format!("<h2>{} could not be evaluated</h2>{}", one.title(), list("problems", reasons)))
    });
    let failed: String = failed.collect();
    let sections: Vec<String> = velocities.iter().filter_map(OneOfSeveral::section).collect();
    let waves = match figures.is_empty() {
        true => String::new(),
        false => format!("<h2>Group velocity</h2>{shown}"),
    };
    let body = format!(
        "<h1>{}</h1><p>{} of {} striker velocities were evaluated.</p>{failed}{waves}{}{}",
        escaped(name),
        sections.len(),
        velocities.len(),
        sections.concat(),
        provenance("its folder's ")
    );
    write_text(&out.join(REPORT), &page(name, &body))
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

fn introduction(setup: &Setup, results: &Results, states: &[RecordingState]) -> String {
    format!(
        "<p>{} bodies; {} of {} recordings are in the motion. Every number stands with its standard uncertainty.</p>",
        setup.experiment.chain.n_bodies,
        results.evaluation.stitched.alignments.len(),
        states.len()
    )
}

/// What may not be trusted: recordings that are missing, results that were refused, warnings.
fn problems(results: &Results, states: &[RecordingState]) -> String {
    let mut said = missing(states);
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

/// Recordings that the motion does not have; those of which the same is said stand together.
fn missing(states: &[RecordingState]) -> Vec<String> {
    const MOST: usize = 3;
    let mut fates: Vec<(State, &str, Vec<&str>)> = Vec::new();
    for one in states.iter().filter(|one| one.state != State::Used) {
        let reason = one.reason.as_deref().unwrap_or("no reason is known");
        match fates.iter_mut().find(|(state, why, _)| *state == one.state && *why == reason) {
            Some((.., names)) => names.push(&one.recording),
            None => fates.push((one.state, reason, vec![&one.recording])),
        }
    }
    let said = |(state, reason, names): (State, &str, Vec<&str>)| {
        let fate = match (state, names.len()) {
            (State::Failed, _) => "could not be used",
            (_, 1) => "was left out",
            _ => "were left out",
        };
        let names = match names.as_slice() {
            [first, others @ ..] if others.len() >= MOST => format!("{first} and {} others", others.len()),
            few => few.join(", "),
        };
        format!("<strong>{}</strong> {fate}: {}", escaped(&names), escaped(reason))
    };
    fates.into_iter().map(said).collect()
}

/// Values with their intervals, and the truth where it is known.
fn numbers_table(rows: &[SummaryRow]) -> String {
    let is_known = rows.iter().any(|row| row.truth.is_some());
    let row = |row: &SummaryRow| {
        let mut cells = vec![Cell::text(&row.name)];
        match &row.measured {
            Ok(Estimate { value, sigma }) => {
                let half = Estimate::COVERAGE_95 * sigma;
                let relative = 100.0 * sigma / value.abs();
                let digits = decimals(*sigma);
                cells.extend([
                    Cell::Number(format!("{value:.digits$}")),
                    Cell::Number(format!("{sigma:.digits$}")),
                    Cell::Number(format!("{:.digits$} to {:.digits$}", value - half, value + half)),
                    Cell::Number(if relative.is_finite() { format!("{relative:.3}") } else { String::new() }),
                ]);
            }
            Err(reason) => cells.push(Cell::text(reason)),
        }
        let known = row.truth.filter(|_| is_known).zip(row.measured.as_ref().ok());
        cells.extend(known.map(|(truth, found)| {
            let digits = decimals(found.sigma);
            Cell::Number(format!("{truth:.digits$}"))
        }));
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
    let svg = read_bytes(&out.join(FIGURES_FOLDER).join(format!("{name}.svg")))?;
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
        link(PROVENANCE),
        link(RESULTS),
    )
}
