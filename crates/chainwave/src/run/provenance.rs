//! What the results came from.

use std::path::Path;

use chainwave_camera::vision_library;
use chainwave_experiment::{Experiment, RecordingState, Setup, Trial, corrections_csv, fingerprint};
use serde::Serialize;

use super::outputs::PROVENANCE;
use crate::error::Error;
use crate::output::write_text;

/// What the results came from: enough to tell whether a run can be repeated.
#[derive(Serialize)]
struct Provenance<'a> {
    program: &'static str,
    version: &'static str,
    opencv: bool,
    /// Its version, where the program has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    opencv_version: Option<String>,
    /// The file of corrections; left out where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    corrections: Option<CorrectionsFile<'a>>,
    recordings: Vec<Source>,
    experiment: &'a Experiment,
}

#[derive(Serialize)]
struct CorrectionsFile<'a> {
    file: &'a str,
    sha256: &'a str,
    /// Rows of it.
    n_corrections: usize,
    /// What they say, as a file of corrections has it.
    text: String,
}

#[derive(Serialize)]
struct Source {
    recording: String,
    fingerprint: String,
    /// What became of it, as in `results.json`.
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<&'static str>,
}

/// Writes `provenance.toml` of an experiment that was run with these settings: every recording that it states, with what became of it. It holds no
/// time and no path, so equal inputs give equal bytes.
pub(crate) fn write(
    stated: &Setup,
    as_run: &Experiment,
    states: &[RecordingState],
    out: &Path,
) -> Result<(), Error> {
    let state_of = |name: &str| states.iter().find(|one| one.recording == name).map(|one| one.state.as_str());
    let source = |trial: &Trial| {
        let fingerprint = fingerprint(&stated.path_of(trial));
        Source {
            recording: trial.recording.clone(),
            fingerprint: fingerprint.unwrap_or_else(|_missing| "not read".into()),
            state: state_of(&trial.recording),
        }
    };
    let provenance = Provenance {
        program: "chainwave",
        version: env!("CARGO_PKG_VERSION"),
        opencv: vision_library().is_some(),
        opencv_version: vision_library().map(|library| library.version()),
        corrections: stated.corrections.source.as_ref().map(|source| CorrectionsFile {
            file: &source.name,
            sha256: &source.sha256,
            n_corrections: stated.corrections.list.len(),
            text: corrections_csv(&stated.corrections.list),
        }),
        recordings: stated.trials.iter().map(source).collect(),
        experiment: as_run,
    };
    let text = toml::to_string(&provenance).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    write_text(&out.join(PROVENANCE), &text)
}
