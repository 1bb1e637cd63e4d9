//! `cargo xtask python`: builds the Python package into a fresh virtual environment, and runs its tests there.

use std::env;
use std::path::{Path, PathBuf};

use crate::command_line::CommandLine;
use crate::failure::Failure;

/// What the tests and the build of the package need beside it.
const PACKAGES: [&str; 7] = ["maturin", "mypy", "numpy", "pandas", "polars", "pyarrow", "pytest"];

/// Builds and tests the package; where there is no Python to do it with, says so and does nothing.
pub(crate) fn run() -> Result<(), Failure> {
    let Some(python) = python() else {
        println!(
            "Skipped: no python3 of at least 3.9 with venv and pip was found; the package is neither built nor tested."
        );
        return Ok(());
    };
    let beside = env::current_exe()
        .map_err(|source| Failure::NotStarted { command: "python".to_owned(), source })?
        .with_file_name("python");
    std::fs::create_dir_all(&beside)
        .map_err(|source| Failure::NotStarted { command: beside.display().to_string(), source })?;
    let chainwave = beside.with_file_name(format!("chainwave{}", env::consts::EXE_SUFFIX));
    let command = chainwave.is_file().then_some(chainwave);
    if command.is_none() {
        println!("The command chainwave is not built: the tests that compare with it skip.");
    }
    commands(&python, &beside, command.as_deref()).iter().try_for_each(CommandLine::run)
}

/// A Python that can make virtual environments with pip.
fn python() -> Option<String> {
    let suits = |name: &&&str| {
        let asked = "import sys, venv, ensurepip; assert sys.version_info >= (3, 9)";
        CommandLine::new([**name, "-c", asked]).output().is_some()
    };
    ["python3", "python"].iter().find(suits).map(|name| (*name).to_owned())
}

/// Everything happens in a folder beside the binaries: `venv` and `wheels`.
fn commands(python: &str, folder: &Path, chainwave: Option<&Path>) -> Vec<CommandLine> {
    let (venv, wheels) = (folder.join("venv"), folder.join("wheels"));
    let scripts = venv.join(if cfg!(windows) { "Scripts" } else { "bin" });
    let program = |name: &str| scripts.join(format!("{name}{}", env::consts::EXE_SUFFIX));
    let install = || {
        CommandLine::new([program("python")])
            .with(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
            .within(folder)
    };
    let mut tests = CommandLine::new([program("python")]).with(["-m", "pytest", "crates/python/tests"]);
    if let Some(chainwave) = chainwave {
        tests = tests.with_variable("CHAINWAVE_COMMAND", chainwave);
    }
    vec![
        CommandLine::new([python, "-m", "venv", "--clear"]).with([venv]),
        install().with(PACKAGES),
        CommandLine::new([program("maturin")])
            .with(["build", "--release", "--manifest-path", "crates/python/Cargo.toml", "--interpreter"])
            .with([program("python")])
            .with(["--out"])
            .with([&wheels]),
        install()
            .with(["--no-index", "--no-deps", "--force-reinstall", "--find-links"])
            .with([PathBuf::from("wheels")])
            .with(["chainwave"]),
        CommandLine::new([program("python")])
            .with(["-m", "mypy", "--strict", "-p", "chainwave"])
            .within(folder),
        tests,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(chainwave: Option<&Path>) -> Vec<String> {
        commands("python3", Path::new("/b/python"), chainwave).iter().map(CommandLine::to_string).collect()
    }

    #[test]
    fn a_fresh_environment_gets_the_wheel_and_runs_the_tests() {
        let lines = lines(Some(Path::new("/b/chainwave")));
        assert_eq!(lines[0], "python3 -m venv --clear /b/python/venv");
        assert!(lines[1].contains("pip install") && lines[1].ends_with(&PACKAGES.join(" ")), "{}", lines[1]);
        assert!(
            lines[2].contains("build --release --manifest-path crates/python/Cargo.toml"),
            "{}",
            lines[2]
        );
        assert!(lines[3].contains("--no-index") && lines[3].ends_with("wheels chainwave"), "{}", lines[3]);
        assert!(lines[5].starts_with("CHAINWAVE_COMMAND=/b/chainwave "), "{}", lines[5]);
    }

    #[test]
    fn without_the_command_the_tests_run_all_the_same() {
        assert!(lines(None)[5].ends_with("-m pytest crates/python/tests"));
    }
}
