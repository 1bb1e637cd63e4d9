//! A temporary folder with the small experiment in it, which the command films and evaluates.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

use crate::support::command::{chainwave, succeed};

/// The small experiment that the tests film and evaluate.
const EXPERIMENT: &str = include_str!("../small-experiment/experiment.toml");
/// Its recordings.
const TRIALS: &str = include_str!("../small-experiment/trials.csv");

/// Number of recordings in the small experiment.
pub(crate) const N_RECORDINGS: usize = 15;

/// A temporary folder with the plan of the small experiment, removed at the end of the test.
pub(crate) struct Laboratory {
    folder: TempDir,
}

impl Laboratory {
    /// The small experiment as it stands.
    pub(crate) fn new() -> Self {
        Self::with(EXPERIMENT, TRIALS)
    }

    /// The small experiment with another text in one place of `experiment.toml`; that place must be there once.
    pub(crate) fn with_experiment(from: &str, to: &str) -> Self {
        Self::with(&replaced(EXPERIMENT, from, to), TRIALS)
    }

    /// The small experiment with other texts in several places of `experiment.toml`; each must be there once.
    pub(crate) fn with_replaced(places: &[(&str, &str)]) -> Self {
        let changed = places.iter().fold(EXPERIMENT.to_owned(), |text, (from, to)| replaced(&text, from, to));
        Self::with(&changed, TRIALS)
    }

    /// The small experiment with another text in one place of `trials.csv`; that place must be there once.
    pub(crate) fn with_trials(from: &str, to: &str) -> Self {
        Self::with(EXPERIMENT, &replaced(TRIALS, from, to))
    }

    /// The small experiment with more at the end of `experiment.toml`.
    pub(crate) fn with_appended(text: &str) -> Self {
        Self::with(&format!("{EXPERIMENT}{text}"), TRIALS)
    }

    /// The small experiment once for each striker velocity.
    pub(crate) fn with_strikers(velocities: &[&str]) -> Self {
        let mut rows = TRIALS.lines();
        let mut trials = format!("{},striker_velocity_m_per_s\n", rows.next().expect("a header"));
        for velocity in velocities {
            for row in rows.clone() {
                trials.push_str(&format!("{velocity}_{row},{velocity}\n"));
            }
        }
        Self::with(EXPERIMENT, &trials)
    }

    fn with(experiment: &str, trials: &str) -> Self {
        let laboratory = Self { folder: TempDir::new().expect("a temporary folder can be made") };
        laboratory.write("experiment.toml", experiment);
        laboratory.write("trials.csv", trials);
        laboratory
    }

    /// A path in the folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file into the folder.
    pub(crate) fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("the temporary folder takes a file");
        path
    }

    /// Films the experiment into the folder `recordings` beside its plan.
    pub(crate) fn film(&self) -> PathBuf {
        let recordings = self.path("recordings");
        succeed(&mut self.filming(&recordings));
        recordings
    }

    /// The command that films the experiment into a folder.
    pub(crate) fn filming(&self, recordings: &Path) -> Command {
        let mut command = chainwave();
        command.arg("synthesize").arg(self.path("experiment.toml")).arg("--out").arg(recordings);
        command
    }

    /// Evaluates filmed recordings into the folder `results`; returns it with what the command printed.
    pub(crate) fn evaluate(&self) -> (PathBuf, String) {
        let results = self.path("results");
        let summary = succeed(&mut evaluation(&self.film(), &results));
        (results, summary)
    }
}

/// The command that evaluates recordings, with the plan beside them, into a folder.
pub(crate) fn evaluation(recordings: &Path, results: &Path) -> Command {
    let mut command = chainwave();
    command.arg("run").arg(recordings.join("experiment.toml")).arg("--out").arg(results);
    command
}

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "expected once: {from}");
    text.replace(from, to)
}
