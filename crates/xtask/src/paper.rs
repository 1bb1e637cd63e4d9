//! `cargo xtask paper`: builds the command, and has `pipelines/paper/run.sh` make every figure and number of the paper, without OpenCV.

use std::path::{Path, PathBuf};

use crate::command_line::{CommandLine, OpenCv, output_folder};
use crate::failure::Failure;
use crate::given_command;
use crate::setup;

/// `cargo xtask paper`: the paper from 390 recordings.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Paper {
    /// Where recordings, models and figures go, from the user's folder; `target/paper` of the workspace unless given, or
    /// `target/paper-quick`.
    pub(crate) out: Option<PathBuf>,
    /// Whether a short chain and few trials do.
    pub(crate) quick: bool,
}

/// Sets up, builds, and starts the pipeline; what an earlier start has filmed and tracked is kept.
pub(crate) fn run(paper: &Paper) -> Result<(), Failure> {
    let usual = if paper.quick { "target/paper-quick" } else { "target/paper" };
    let out = output_folder(paper.out.as_deref(), usual)?;
    setup::run_then(OpenCv::Without, &commands(paper, &out))
}

/// The script is told which command was built, so that it takes no other one.
fn commands(paper: &Paper, out: &Path) -> [CommandLine; 2] {
    let script = CommandLine::new(["pipelines/paper/run.sh"])
        .with([out])
        .with(paper.quick.then_some("--quick"))
        .with_variable("CHAINWAVE_COMMAND", given_command::built());
    [given_command::build(), script]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(paper: &Paper) -> [String; 2] {
        commands(paper, Path::new("there")).map(|command| command.to_string())
    }

    #[test]
    fn the_script_runs_with_the_command_that_was_built() {
        let [build, script] = lines(&Paper::default());
        assert_eq!(build, given_command::build().to_string());
        assert!(script.starts_with("CHAINWAVE_COMMAND=") && script.contains("release"), "{script}");
        assert!(script.ends_with("pipelines/paper/run.sh there"), "{script}");
    }

    #[test]
    fn quick_goes_to_the_script() {
        let [_, script] = lines(&Paper { quick: true, out: None });
        assert!(script.ends_with("run.sh there --quick"), "{script}");
    }
}
