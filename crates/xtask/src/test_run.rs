//! `cargo xtask test`: builds and runs the tests, and says which of them skipped and why.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::command_line::{CommandLine, OpenCv, features};
use crate::failure::Failure;
use crate::setup;
use crate::skipped;

/// The package whose tests run the command `chainwave`.
const WHOLE_WAY: &str = "chainwave-tests";

/// `cargo xtask test`: every test of the workspace.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct TestRun {
    pub(crate) opencv: OpenCv,
    /// Whether the tests in modules named `slow` are left out.
    pub(crate) fast: bool,
    /// The packages whose tests run; the whole workspace when empty.
    pub(crate) packages: Vec<String>,
}

impl Default for TestRun {
    fn default() -> Self {
        Self { opencv: OpenCv::With, fast: false, packages: Vec::new() }
    }
}

/// Sets up, builds and runs the tests; the runner's summary, and which tests skipped, are the last things printed.
pub(crate) fn run(test_run: &TestRun) -> Result<(), Failure> {
    let not_started =
        |command: &'static str| move |source| Failure::NotStarted { command: command.to_owned(), source };
    let chainwave = chainwave_beside_xtask().map_err(not_started("chainwave"))?;
    let skipped = skipped::new_list(&chainwave).map_err(not_started("the list of skipped tests"))?;
    if env::var_os("CHAINWAVE_REFERENCE_DATA").is_none() {
        println!("CHAINWAVE_REFERENCE_DATA is not set: tests with third-party recordings will skip.");
    }
    let nextest = CommandLine::new(["cargo", "nextest", "--version"]).output().is_some();
    if !nextest {
        println!("cargo-nextest is not installed: the tests run with cargo test.");
    }
    let outcome = setup::run_then(test_run.opencv, &commands(test_run, nextest, &chainwave, &skipped));
    println!("{}", skipped::told(&fs::read_to_string(&skipped).unwrap_or_default()));
    outcome
}

fn commands(test_run: &TestRun, nextest: bool, chainwave: &Path, skipped: &Path) -> Vec<CommandLine> {
    let features = features(test_run.opencv);
    let cargo = |words: &[&str]| CommandLine::new(["cargo"]).with(words).with(["--release"]).with(features);
    let runner: &[&str] = if nextest { &["nextest", "run"] } else { &["test", "--tests"] };
    let skip = if test_run.fast { &["--", "--skip", "slow::"][..] } else { &[] };
    let tests = cargo(runner).with(selection(&test_run.packages)).with(skip);

    let mut commands = Vec::new();
    let all = test_run.packages.is_empty();
    if all || test_run.packages.iter().any(|name| name == WHOLE_WAY) {
        // No runner builds a binary for the tests of another package. Asking for the tests along with it resolves the
        // dependencies' features as the runner will, so that nothing heavy is built twice.
        commands.push(cargo(&["build"]).with(["--workspace", "--bins", "--tests"]));
    }
    if all {
        commands.push(cargo(&["test", "--quiet", "--doc"]).with(["--workspace"]));
    }
    commands
        .push(tests.with_variable("CHAINWAVE_COMMAND", chainwave).with_variable(skipped::VARIABLE, skipped));
    commands
}

fn selection(packages: &[String]) -> Vec<&str> {
    if packages.is_empty() {
        return vec!["--workspace"];
    }
    packages.iter().flat_map(|name| ["-p", name]).collect()
}

/// Cargo puts all binaries of the workspace into one folder.
fn chainwave_beside_xtask() -> io::Result<PathBuf> {
    Ok(env::current_exe()?.with_file_name(format!("chainwave{}", env::consts::EXE_SUFFIX)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(test_run: &TestRun, nextest: bool) -> Vec<String> {
        commands(test_run, nextest, Path::new("/b/chainwave"), Path::new("/b/list"))
            .iter()
            .map(CommandLine::to_string)
            .collect()
    }

    #[test]
    fn all_tests_run_on_a_fresh_binary_and_the_runner_has_the_last_word() {
        assert_eq!(
            lines(&TestRun::default(), true),
            [
                "cargo build --release --workspace --bins --tests",
                "cargo test --quiet --doc --release --workspace",
                "CHAINWAVE_COMMAND=/b/chainwave CHAINWAVE_SKIPPED=/b/list cargo nextest run --release --workspace",
            ]
        );
    }

    #[test]
    fn cargo_test_stands_in_for_nextest() {
        let lines = lines(&TestRun { fast: true, ..TestRun::default() }, false);
        let last = "CHAINWAVE_COMMAND=/b/chainwave CHAINWAVE_SKIPPED=/b/list cargo test --tests --release --workspace -- --skip slow::";
        assert_eq!(lines.last().map(String::as_str), Some(last));
    }

    #[test]
    fn chosen_packages_run_alone() {
        let test_run =
            TestRun { opencv: OpenCv::Without, fast: false, packages: vec!["a".into(), "b".into()] };
        let only = "CHAINWAVE_COMMAND=/b/chainwave CHAINWAVE_SKIPPED=/b/list cargo nextest run --release --no-default-features -p a -p b";
        assert_eq!(lines(&test_run, true), [only]);
    }

    #[test]
    fn the_whole_way_gets_its_binary_even_alone() {
        let test_run = TestRun { packages: vec![WHOLE_WAY.into()], ..TestRun::default() };
        assert!(lines(&test_run, true)[0].starts_with("cargo build "));
    }
}
