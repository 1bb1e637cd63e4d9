use serde::Serialize;

use super::Job;
use super::tracking::fingerprint;
use crate::error::Error;
use crate::experiment::Experiment;
use crate::output::write_text;

/// What the results came from: enough to tell whether a run can be repeated.
#[derive(Serialize)]
struct Provenance<'a> {
    program: &'static str,
    version: &'static str,
    opencv: bool,
    recordings: Vec<Source>,
    experiment: &'a Experiment,
}

#[derive(Serialize)]
struct Source {
    recording: String,
    fingerprint: String,
}

/// Writes `provenance.toml`. It holds no time and no path, so equal inputs give equal bytes.
pub(crate) fn write(job: &Job) -> Result<(), Error> {
    let source = |trial: &crate::experiment::Trial| {
        let fingerprint = fingerprint(&job.recordings.join(&trial.recording));
        Source {
            recording: trial.recording.clone(),
            fingerprint: fingerprint.unwrap_or_else(|_missing| "not read".into()),
        }
    };
    let provenance = Provenance {
        program: "chainwave",
        version: env!("CARGO_PKG_VERSION"),
        opencv: cfg!(feature = "opencv"),
        recordings: job.trials.iter().map(source).collect(),
        experiment: &job.experiment,
    };
    let text = toml::to_string(&provenance).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    write_text(&job.result("provenance.toml"), &text)
}
