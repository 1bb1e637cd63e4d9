//! `chainwave check`: whether a run of an experiment makes sense, before time is spent on it.

use std::num::NonZero;

use chainwave_experiment::{
    Error as ExperimentError, FailedRecording, Finding, LeftOutRecording, RecordingState, Setup, State,
    recording_states, unreadable,
};
use serde_json::json;

use crate::cli;
use crate::error::Error;
use crate::on_demand;
use crate::outcome::Outcome;
use crate::parallel::threads;
use crate::run::{states_as_json, warnings_as_json};
use crate::terminal::{answer, is_json, say};

/// What a check found.
struct Checked {
    warnings: Vec<Finding>,
    recordings: Vec<RecordingState>,
}

/// Looks at the experiment's numbers, at every recording's header and at the pictures of each view at rest: exit code 0 where a run makes
/// sense, 1 with warnings, 2 where it cannot run.
pub(crate) fn check(arguments: &cli::Check) -> Result<Outcome, Error> {
    let checked = checked(arguments).inspect_err(|error| {
        // What takes OpenCV is told by the program that has it.
        let is_told_elsewhere = error.needs_opencv() && on_demand::is_there();
        if is_json() && !is_told_elsewhere {
            answer(
                &json!({ "can_run": false, "error": error.to_string(), "warnings": [], "recordings": [] }),
            );
        }
    })?;
    let Checked { warnings, recordings } = &checked;
    match is_json() {
        true => answer(&json!({
            "can_run": true,
            "warnings": warnings_as_json(warnings),
            "recordings": states_as_json(recordings),
        })),
        false => in_words(arguments, &checked),
    }
    Ok(if warnings.is_empty() { Outcome::default() } else { Outcome::warned() })
}

fn checked(arguments: &cli::Check) -> Result<Checked, Error> {
    let whole = Setup::read(&arguments.experiment, arguments.recordings.as_deref())?;
    on_demand::expect_recordings_of(&whole)?;
    checked_setup(&whole, threads(arguments.jobs))
}

/// What a check would say of an experiment, a line each: why it cannot run, or its warnings.
pub(crate) fn said_of(setup: &Setup, n_threads: NonZero<usize>) -> Vec<String> {
    match checked_setup(setup, n_threads) {
        Ok(checked) => checked.warnings.iter().map(|warning| format!("warning: {warning}")).collect(),
        Err(error) => vec![format!("it cannot run: {error}")],
    }
}

fn checked_setup(whole: &Setup, n_threads: NonZero<usize>) -> Result<Checked, Error> {
    let failed = unreadable(whole, n_threads);
    if failed.len() == whole.trials.len() {
        return Err(unread(failed));
    }
    let unreadable = |one: &FailedRecording| Finding {
        code: "unreadable",
        subject: one.trial.recording.clone(),
        text: one.error.to_string(),
    };
    let mut warnings: Vec<Finding> = failed.iter().map(unreadable).collect();
    let mut left_out = Vec::new();
    let setups = whole.by_striker();
    for setup in &setups {
        match chainwave_experiment::check(setup, n_threads).map_err(Error::from) {
            Ok(sanity) => {
                warnings.extend(sanity.findings);
                left_out.extend(sanity.left_out);
            }
            // A run goes on without a velocity that makes no sense.
            Err(error) if setups.len() > 1 && !error.ends_all() => {
                let reason = error.to_string();
                left_out.extend(LeftOutRecording::each_of(&setup.trials, &reason));
            }
            Err(error) => return Err(error),
        }
    }
    let recordings = recording_states(&whole.trials, &failed, &left_out);
    if recordings.iter().all(|one| one.state != State::Used) {
        let reasons: Vec<&str> = recordings.iter().filter_map(|one| one.reason.as_deref()).collect();
        let reason = reasons.first().copied().unwrap_or("there are none");
        return Err(ExperimentError::Value(format!("no recording is left to run: {reason}")).into());
    }
    warnings.extend(of_left_out(&recordings));
    Ok(Checked { warnings, recordings })
}

/// Why none of the recordings can be read, each with its reason.
fn unread(failed: Vec<FailedRecording>) -> Error {
    let n = failed.len();
    let is_of_experiment = |error: &ExperimentError| matches!(error, ExperimentError::Configuration { .. });
    let reasons: Vec<ExperimentError> = failed.into_iter().map(|one| one.error).collect();
    let mut reasons = reasons.into_iter();
    match (n, reasons.next()) {
        (0, _) | (_, None) => Error::nothing_left("recordings", n),
        (1, Some(reason)) => reason.into(),
        // The experiment contradicts every one of them, and the first says how.
        (_, Some(first)) if is_of_experiment(&first) && reasons.as_slice().iter().all(is_of_experiment) => {
            ExperimentError::Value(format!("{first}; so it is of all {n} recordings")).into()
        }
        (_, Some(first)) => {
            let reasons: Vec<String> =
                std::iter::once(first).chain(reasons).map(|reason| reason.to_string()).collect();
            ExperimentError::Value(format!("none of {n} recordings can be read:\n{}", reasons.join("\n")))
                .into()
        }
    }
}

/// What is said of recordings that a run would leave out: those of one reason together.
fn of_left_out(recordings: &[RecordingState]) -> Vec<Finding> {
    let left_out = recordings.iter().filter(|one| one.state == State::LeftOut);
    let mut findings: Vec<Finding> = Vec::new();
    for one in left_out {
        let text = format!("left out: {}", one.reason.as_deref().unwrap_or("no reason is known"));
        match findings.iter_mut().find(|finding| finding.text == text) {
            Some(same) => same.subject.push_str(&format!(", {}", one.recording)),
            None => findings.push(Finding { code: "left_out", subject: one.recording.clone(), text }),
        }
    }
    findings
}

fn in_words(arguments: &cli::Check, Checked { warnings, recordings }: &Checked) {
    for warning in warnings {
        say!("warning: {warning}");
    }
    let n_used = recordings.iter().filter(|one| one.state == State::Used).count();
    say!(
        "{}: {n_used} of {} recordings can be used; {}",
        arguments.experiment.display(),
        recordings.len(),
        match warnings.len() {
            0 => "a run makes sense".to_owned(),
            1 => "one warning".to_owned(),
            n => format!("{n} warnings"),
        }
    );
}
