//! A Python with packages from the registry that pip reaches, for tests of what other people's programs make of the results.

use std::path::PathBuf;
use std::process::{Command, Output};

use tempfile::TempDir;

/// A virtual environment, removed at the end of the test.
pub(crate) struct Python {
    folder: TempDir,
}

impl Python {
    /// One with these packages; without a Python, or a registry that has them, the test skips with a word.
    pub(crate) fn with(packages: &[&str]) -> Option<Self> {
        let python = Self { folder: TempDir::new().expect("a temporary folder can be made") };
        let done = |command: &mut Command| command.output().is_ok_and(|output| output.status.success());
        let is_made = done(Command::new("python3").args(["-m", "venv"]).arg(python.folder.path()));
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1"];
        if is_made && done(python.program("python").args(install).args(packages)) {
            return Some(python);
        }
        chainwave_testkit::skip(&format!(
            "there is no Python 3 with venv, or pip finds no {}",
            packages.join(", ")
        ));
        None
    }

    /// Where its programs lie.
    pub(crate) fn programs(&self) -> PathBuf {
        self.folder.path().join("bin")
    }

    /// One of its programs.
    pub(crate) fn program(&self, name: &str) -> Command {
        Command::new(self.programs().join(name))
    }

    /// What a script prints, whose arguments follow it.
    pub(crate) fn run(&self, script: &str, arguments: &[&std::path::Path]) -> String {
        text(&self.program("python").arg("-c").arg(script).args(arguments).output().expect("it starts"))
    }
}

/// Standard output of a program that ended well.
pub(crate) fn text(output: &Output) -> String {
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}{err}");
    out.into_owned()
}
