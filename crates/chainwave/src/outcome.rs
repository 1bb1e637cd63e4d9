//! What a command achieved, as an exit code.

use std::process::ExitCode;

use crate::terminal::{complain, is_quiet, tell_failure};

/// Inputs that failed while the rest was done.
#[derive(Debug, Default)]
#[must_use]
pub(crate) struct Outcome {
    failures: Vec<String>,
    warned: bool,
}

impl Outcome {
    /// Names a failed input on standard error and remembers it.
    pub(crate) fn fail(&mut self, failure: impl std::fmt::Display) {
        complain(&failure);
        tell_failure(failure.to_string());
        self.failures.push(failure.to_string());
    }

    /// Says on standard error what was refused though every input was read: the exit code stays as it is.
    pub(crate) fn note(what: impl std::fmt::Display) {
        if !is_quiet() {
            complain(what);
        }
    }

    /// Everything could be done, and something was found that the caller should look at.
    pub(crate) fn warned() -> Self {
        Self { warned: true, ..Self::default() }
    }

    /// The failed inputs, each with what was wrong.
    pub(crate) fn failures(&self) -> &[String] {
        &self.failures
    }

    /// 0 when all was done, 1 when some inputs failed or there was a warning that the command was asked for.
    pub(crate) fn exit_code(&self) -> ExitCode {
        ExitCode::from(u8::from(self.warned || !self.failures.is_empty()))
    }
}
