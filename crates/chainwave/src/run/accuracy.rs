//! What a run does without where results need not be known better: chosen before work, and compared with what came out.

use std::path::Path;

use chainwave_experiment::{Economy, Evaluation, LeftOutRecording, Outlook, Setup, economy, outcome};
use chainwave_measurement::Estimate;
use serde_json::json;

use super::outputs;
use super::summary::print_lines;
use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::write_json;
use crate::parallel::threads;
use crate::progress;

/// A result that was asked for, with what was foreseen and what came out.
pub(super) struct Reached<'a> {
    pub(super) outlook: &'a Outlook,
    pub(super) found: Result<Estimate, String>,
}

impl Reached<'_> {
    /// Whether the result is known as well as asked.
    pub(super) fn is_met(&self) -> bool {
        self.found.as_ref().is_ok_and(|found| self.outlook.aim.is_met_by(found))
    }
}

/// Chooses what the results that are asked for need, and says so; nothing where none is.
pub(super) fn choose(setup: &Setup, arguments: &cli::Run, place: &str) -> Result<Option<Economy>, Error> {
    if arguments.accuracy.is_empty() {
        return Ok(None);
    }
    let bar = progress::bar(&format!("choosing{place}"), 0);
    let show = progress::shown_on(&bar);
    let monitor = progress::monitor(&show);
    let found = economy(setup, &arguments.accuracy, threads(arguments.jobs), &monitor)?;
    let chosen =
        found.decisions.iter().map(|one| format!("{}: {} ({})", one.question, one.choice, one.evidence));
    print_lines(chosen);
    let foreseen = found.outlooks.iter().map(|one| match &one.expected {
        Ok(expected) => {
            let beyond = one.missed_margin().map_or_else(String::new, |margin| {
                let margin = Estimate::new(expected.value, margin);
                format!(", not within the margin that a rehearsal needs ({:.3} %)", in_per_cent(&margin))
            });
            format!("{}: {:.3} % foreseen{beyond}", one.aim, in_per_cent(expected))
        }
        Err(reason) => format!("{}: none foreseen: {reason}", one.aim),
    });
    print_lines(foreseen);
    print_lines([format!(
        "pixels to look at: {:.0} % of the experiment's ({} rehearsals)",
        100.0 * found.work,
        found.n_rehearsals
    )]);
    Ok(Some(found))
}

fn in_per_cent(found: &Estimate) -> f64 {
    100.0 * (found.sigma / found.value).abs()
}

/// What became of each result that was asked for.
pub(super) fn reached<'a>(economy: &'a Economy, evaluation: &Evaluation) -> Vec<Reached<'a>> {
    let found = outcome(evaluation);
    let of = |outlook: &'a Outlook| Reached { outlook, found: found.of(outlook.aim.result).clone() };
    economy.outlooks.iter().map(of).collect()
}

/// Writes `accuracy.json`, and names what was missed on standard error.
pub(super) fn write(out: &Path, economy: &Economy, reached: &[Reached<'_>]) -> Result<(), Error> {
    let of = |one: &Reached<'_>| {
        let Outlook { aim, expected, at_best } = one.outlook;
        let sigma = |found: &Result<Estimate, String>| found.as_ref().ok().map(|found| found.sigma);
        json!({
            "result": aim.result.symbol(),
            "unit": aim.result.unit(),
            "asked_sigma": one.found.as_ref().ok().map(|found| aim.sigma(found.value)),
            "expected_sigma": sigma(expected),
            "expected_sigma_with_all": sigma(at_best),
            "value": one.found.as_ref().ok().map(|found| found.value),
            "sigma": sigma(&one.found),
            "is_met": one.is_met(),
        })
    };
    let results: Vec<_> = reached.iter().map(of).collect();
    for one in reached.iter().filter(|one| !one.is_met()) {
        let aim = one.outlook.aim;
        Outcome::note(match &one.found {
            Ok(found) => format!(
                "{aim} was asked for, and it is known to {:.3} % (hint: `chainwave plan` says what would help)",
                in_per_cent(found)
            ),
            Err(reason) => format!("{aim} was asked for, and there is none: {reason}"),
        });
    }
    let (work, n_rehearsals) = (economy.work, economy.n_rehearsals);
    let found = json!({
        "results": results, "decisions": economy.decisions, "share_of_pixels": work, "n_rehearsals": n_rehearsals,
    });
    write_json(&out.join(outputs::ACCURACY), &found)
}

/// The recordings that were not needed.
pub(super) fn not_needed(stated: &Setup, economy: &Economy) -> Vec<LeftOutRecording> {
    let is_used = |name: &str| economy.setup.trials.iter().any(|trial| trial.recording == name);
    let aims: Vec<String> = economy.outlooks.iter().map(|one| one.aim.to_string()).collect();
    let reason = format!("not needed for {}", aims.join(" and "));
    LeftOutRecording::each_of(stated.trials.iter().filter(|trial| !is_used(&trial.recording)), &reason)
}
