//! `cargo xtask python`: builds the Python package, with the command in it, into a fresh virtual environment, and runs its tests there.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::command_line::{CommandLine, workspace};
use crate::failure::Failure;
use crate::given_command;

/// What the tests and the build of the package need beside it.
const PACKAGES: [&str; 7] = ["maturin", "mypy", "numpy", "pandas", "polars", "pyarrow", "pytest"];
/// What some tests ask beyond that, and skip without.
const WANTED: [&str; 4] = ["duckdb", "matplotlib", "pyright[nodejs]", "scipy"];
/// What maturin puts among the programs of an environment.
const SCRIPTS: &str = "crates/python/chainwave.data/scripts";
/// More than this, a wheel is slow to install and dear to keep: a little above what command and module need (20.0 MB), so that only a new dependency exceeds it.
const MOST_BYTES: u64 = 21_000_000;

/// Builds and tests the package; where there is no Python to do it with, says so and does nothing.
pub(crate) fn run() -> Result<(), Failure> {
    let Some(python) = python() else {
        println!(
            "Skipped: no python3 of at least 3.9 with venv and pip was found; the package is neither built nor tested."
        );
        return Ok(());
    };
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| Failure::File { path, source }
    };
    let release = env::current_exe().map_err(failed(Path::new("xtask")))?;
    let folder = release.with_file_name("python");
    fs::create_dir_all(&folder).map_err(failed(&folder))?;
    let environment = Environment { folder };
    environment.made(&python).iter().try_for_each(CommandLine::run)?;
    for package in WANTED {
        if environment.install().with([package]).output().is_none() {
            println!("{package} cannot be had: tests that ask it skip.");
        }
    }
    given_command::build().run()?;
    let scripts = workspace().join(SCRIPTS);
    given_command::copy_into(&scripts).map_err(failed(&scripts))?;
    // Wheels of earlier versions would be tried as well.
    match fs::remove_dir_all(environment.wheels()) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(failed(&environment.wheels())(error));
        }
        _ => {}
    }
    environment.wheel().run()?;
    expect_small(&environment.wheels()).map_err(failed(&environment.wheels()))?;
    environment.tests().iter().try_for_each(CommandLine::run)
}

/// Says how large the wheels are; one that is too large is an error.
fn expect_small(wheels: &Path) -> io::Result<()> {
    for entry in fs::read_dir(wheels)? {
        let entry = entry?;
        let (name, n_bytes) = (entry.file_name(), entry.metadata()?.len());
        let told = format!("{}: {:.1} MB", name.to_string_lossy(), n_bytes as f64 / 1e6);
        if n_bytes > MOST_BYTES {
            return Err(io::Error::other(format!(
                "{told}, expected at most {:.0} MB",
                MOST_BYTES as f64 / 1e6
            )));
        }
        println!("{told}");
    }
    Ok(())
}

/// A Python that can make virtual environments with pip.
fn python() -> Option<String> {
    let suits = |name: &&&str| {
        let asked = "import sys, venv, ensurepip; assert sys.version_info >= (3, 9)";
        CommandLine::new([**name, "-c", asked]).output().is_some()
    };
    ["python3", "python"].iter().find(suits).map(|name| (*name).to_owned())
}

/// A virtual environment and the wheels, in a folder beside the binaries: `venv` and `wheels`.
struct Environment {
    folder: PathBuf,
}

impl Environment {
    fn wheels(&self) -> PathBuf {
        self.folder.join("wheels")
    }

    fn program(&self, name: &str) -> PathBuf {
        let scripts = if cfg!(windows) { "Scripts" } else { "bin" };
        self.folder.join("venv").join(scripts).join(format!("{name}{}", env::consts::EXE_SUFFIX))
    }

    fn install(&self) -> CommandLine {
        CommandLine::new([self.program("python")])
            .with(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
            .within(&self.folder)
    }

    /// Makes it anew.
    fn made(&self, python: &str) -> [CommandLine; 2] {
        [
            CommandLine::new([python, "-m", "venv", "--clear"]).with([self.folder.join("venv")]),
            self.install().with(PACKAGES),
        ]
    }

    /// Builds the wheel, packed as small as can be: most of it is two programs.
    fn wheel(&self) -> CommandLine {
        CommandLine::new([self.program("maturin")])
            .with(["build", "--release", "--compression-level", "9"])
            .with(["--manifest-path", "crates/python/Cargo.toml", "--interpreter"])
            .with([self.program("python")])
            .with(["--out"])
            .with([self.wheels()])
    }

    /// Installs the wheel and tests it.
    fn tests(&self) -> [CommandLine; 3] {
        [
            self.install()
                .with(["--no-index", "--no-deps", "--force-reinstall", "--find-links"])
                .with([PathBuf::from("wheels")])
                .with(["chainwave"]),
            CommandLine::new([self.program("python")])
                .with(["-m", "mypy", "--strict", "-p", "chainwave"])
                .within(&self.folder),
            CommandLine::new([self.program("python")]).with(["-m", "pytest", "crates/python/tests"]),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fresh_environment_gets_the_wheel_and_runs_the_tests() {
        let environment = Environment { folder: "/b/python".into() };
        let made = environment.made("python3").map(|line| line.to_string());
        assert_eq!(made[0], "python3 -m venv --clear /b/python/venv");
        assert!(made[1].contains("pip install") && made[1].ends_with(&PACKAGES.join(" ")), "{}", made[1]);
        let wheel = environment.wheel().to_string();
        assert!(wheel.contains("--manifest-path crates/python/Cargo.toml"), "{wheel}");
        let tests = environment.tests().map(|line| line.to_string());
        assert!(tests[0].contains("--no-index") && tests[0].ends_with("wheels chainwave"), "{}", tests[0]);
        assert!(tests[2].ends_with("-m pytest crates/python/tests"), "{}", tests[2]);
    }
}
