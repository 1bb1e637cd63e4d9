//! Why a task ended early, and the exit code that tells it.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Why a task ended early.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The arguments make no sense.
    Usage(String),
    /// A command could not be started.
    NotStarted { command: String, source: io::Error },
    /// A file or folder that cannot be used.
    File { path: PathBuf, source: io::Error },
    /// Pages of the book are not what their commands make.
    Differs(Vec<String>),
    /// The rendered book asks these of the net.
    NotAlone(Vec<String>),
    /// A command ended with another exit code than 0; `None` when a signal ended it.
    Ended { command: String, code: Option<i32> },
}

impl Failure {
    /// That of a file or folder, for `map_err`.
    pub(crate) fn at(path: &Path) -> impl Fn(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::File { path: path.clone(), source }
    }

    /// The command's own exit code where it has one, 2 for bad arguments, else 1.
    pub(crate) fn exit_code(&self) -> ExitCode {
        match self {
            Self::Usage(_) => ExitCode::from(2),
            Self::Ended { code: Some(code), .. } => ExitCode::from(u8::try_from(*code).unwrap_or(1)),
            Self::Ended { code: None, .. }
            | Self::NotStarted { .. }
            | Self::File { .. }
            | Self::NotAlone(_)
            | Self::Differs(_) => ExitCode::FAILURE,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(reason) => write!(f, "{reason}; `cargo xtask help` lists the commands"),
            Self::NotStarted { command, source } => write!(f, "`{command}` could not be started: {source}"),
            Self::File { path, source } => write!(f, "{}: {source}", path.display()),
            Self::Differs(pages) => {
                let pages = pages.join(", ");
                write!(
                    f,
                    "not as its commands make it: {pages}; `cargo xtask book --write` renews what it can"
                )
            }
            Self::NotAlone(asks) => {
                write!(f, "the rendered book asks something of the net:\n{}", asks.join("\n"))
            }
            Self::Ended { command, code: Some(code) } => write!(f, "`{command}` ended with exit code {code}"),
            Self::Ended { command, code: None } => write!(f, "`{command}` was ended by a signal"),
        }
    }
}
