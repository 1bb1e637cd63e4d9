//! `cargo xtask demo`: builds the command, films the synthetic experiment and processes it. None of that takes OpenCV.

use std::path::{Path, PathBuf};

use crate::command_line::{CommandLine, OpenCv, output_folder};
use crate::failure::Failure;
use crate::given_command;
use crate::setup;

/// `cargo xtask demo`: the synthetic experiment, filmed and processed.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Demo {
    /// Where recordings and results go, from the user's folder; `target/demo` of the workspace unless given.
    pub(crate) out: Option<PathBuf>,
    /// Another seed than the experiment's own.
    pub(crate) seed: Option<u64>,
}

/// Sets up, builds, films and processes.
pub(crate) fn run(demo: &Demo) -> Result<(), Failure> {
    let out = output_folder(demo.out.as_deref(), "target/demo")?;
    println!("The demo takes no OpenCV.");
    setup::run_then(OpenCv::Without, &commands(demo, &out))
}

fn commands(demo: &Demo, out: &Path) -> [CommandLine; 3] {
    let recordings = out.join("recordings");
    let chainwave = || CommandLine::new([given_command::built()]);
    let seed = demo.seed.map(|seed| ["--seed".to_owned(), seed.to_string()]);
    [
        given_command::build(),
        chainwave()
            .with(["synthesize", "pipelines/hec26-demo/experiment.toml", "--out"])
            .with([&recordings])
            .with(seed.into_iter().flatten()),
        chainwave()
            .with(["run"])
            .with([recordings.join("experiment.toml")])
            .with(["--out"])
            .with([out.join("results")]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(demo: &Demo) -> [String; 3] {
        commands(demo, Path::new("target/demo")).map(|command| command.to_string())
    }

    #[test]
    fn the_demo_builds_films_and_processes() {
        let synthesize = "synthesize pipelines/hec26-demo/experiment.toml --out target/demo/recordings";
        let run = "run target/demo/recordings/experiment.toml --out target/demo/results";
        let chainwave = CommandLine::new([given_command::built()]);
        assert_eq!(
            lines(&Demo::default()),
            [
                given_command::build().to_string(),
                format!("{chainwave} {synthesize}"),
                format!("{chainwave} {run}"),
            ]
        );
    }

    #[test]
    fn the_seed_goes_to_the_camera_alone() {
        let [build, synthesize, run] = lines(&Demo { seed: Some(12), ..Demo::default() });
        assert!(synthesize.ends_with(" --seed 12"), "{synthesize}");
        assert!(!build.contains("--seed") && !run.contains("--seed"), "{build}\n{run}");
    }
}
