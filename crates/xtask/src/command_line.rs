//! A command with its arguments: printed as a line for a shell, then run.

use std::env;
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::path::{self, Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use crate::failure::Failure;

/// A command with its arguments, as it is printed before it runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CommandLine {
    words: Vec<OsString>,
    environment: Vec<(&'static str, OsString)>,
    folder: Option<PathBuf>,
}

impl CommandLine {
    /// The command `words[0]` with the arguments that follow it.
    pub(crate) fn new<W: Into<OsString>>(words: impl IntoIterator<Item = W>) -> Self {
        Self { words: words.into_iter().map(Into::into).collect(), environment: Vec::new(), folder: None }
    }

    /// The same command with more arguments.
    pub(crate) fn with<W: Into<OsString>>(mut self, words: impl IntoIterator<Item = W>) -> Self {
        self.words.extend(words.into_iter().map(Into::into));
        self
    }

    /// The same command with an environment variable.
    pub(crate) fn with_variable(mut self, name: &'static str, value: impl Into<OsString>) -> Self {
        self.environment.push((name, value.into()));
        self
    }

    /// The same command run in a folder, in place of the top of the workspace.
    pub(crate) fn within(mut self, folder: &Path) -> Self {
        self.folder = Some(folder.to_owned());
        self
    }

    /// Prints the command, runs it at the top of the workspace, and waits for it.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        println!("\n$ {self}");
        let status = self
            .process()
            .status()
            .map_err(|source| Failure::NotStarted { command: self.to_string(), source })?;
        if status.success() {
            return Ok(());
        }
        Err(Failure::Ended { command: self.to_string(), code: status.code() })
    }

    /// Standard output of the command, run in silence; `None` when it cannot be started or fails.
    pub(crate) fn output(&self) -> Option<String> {
        let output = self.process().stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    fn process(&self) -> Command {
        let mut words = self.words.iter();
        let program = words.next().map(OsString::as_os_str).unwrap_or_default();
        let mut process = Command::new(actual_program(program));
        process
            .args(words)
            .envs(self.environment.iter().cloned())
            .current_dir(self.folder.as_deref().unwrap_or(workspace()));
        process
    }
}

/// The top of the workspace that cargo runs xtask for. Checkouts that share a target directory share this program too, so the
/// place where it was compiled may be another one.
pub(crate) fn workspace() -> &'static Path {
    static HERE: OnceLock<PathBuf> = OnceLock::new();
    let of_cargo =
        || env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    let here = HERE.get_or_init(of_cargo);
    here.ancestors().nth(2).unwrap_or(here)
}

/// The folder that the user names, or one of the workspace: every command runs at its top, but the user means the folder where they are.
pub(crate) fn output_folder(given: Option<&Path>, usual: &str) -> Result<PathBuf, Failure> {
    match given {
        Some(out) => path::absolute(out).map_err(|error| Failure::Usage(format!("--out: {error}"))),
        None => Ok(PathBuf::from(usual)),
    }
}

/// Whether a build takes OpenCV.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OpenCv {
    With,
    Without,
}

/// What cargo is told of OpenCV.
pub(crate) fn features(opencv: OpenCv) -> &'static [&'static str] {
    match opencv {
        OpenCv::With => &[],
        OpenCv::Without => &["--no-default-features"],
    }
}

/// The cargo that started xtask goes on, so that a toolchain chosen with `cargo +name` holds for every step.
fn actual_program(program: &OsStr) -> OsString {
    let cargo = (program == "cargo").then(|| env::var_os("CARGO")).flatten();
    cargo.unwrap_or_else(|| program.to_owned())
}

impl fmt::Display for CommandLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, value) in &self.environment {
            write!(f, "{name}={} ", quoted(value))?;
        }
        let words: Vec<String> = self.words.iter().map(|word| quoted(word)).collect();
        f.write_str(&words.join(" "))
    }
}

fn quoted(word: &OsStr) -> String {
    let word = word.to_string_lossy();
    if word.is_empty() || word.contains(|c: char| c.is_whitespace() || c == '\'') {
        return format!("'{}'", word.replace('\'', r"'\''"));
    }
    word.into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_line_can_be_pasted_into_a_shell() {
        let line = CommandLine::new(["echo", "a b", "it's", ""]).with_variable("NAME", "v w");
        assert_eq!(line.to_string(), r"NAME='v w' echo 'a b' 'it'\''s' ''");
        let echoed = CommandLine::new(["sh", "-c", &line.to_string()]).output();
        assert_eq!(echoed.as_deref(), Some("a b it's"));
    }

    #[test]
    fn the_exit_code_passes_on() {
        let failure = CommandLine::new(["sh", "-c", "exit 3"]).run().unwrap_err();
        assert!(matches!(failure, Failure::Ended { code: Some(3), .. }), "{failure:?}");
        assert_eq!(failure.exit_code(), std::process::ExitCode::from(3));
    }

    #[test]
    fn a_missing_program_is_named() {
        let failure = CommandLine::new(["no-such-program-here"]).run().unwrap_err();
        assert!(failure.to_string().contains("`no-such-program-here` could not be started"), "{failure}");
    }

    #[test]
    fn commands_run_at_the_top_of_the_workspace() {
        assert!(workspace().join("crates/xtask/Cargo.toml").is_file());
    }
}
