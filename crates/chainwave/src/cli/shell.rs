//! Arguments of `completions` and `man`.

use clap::Args;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell.
    pub(crate) shell: clap_complete::Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(crate) struct ManPage {
    /// The command whose page it is; the program's without it.
    pub(crate) command: Option<String>,
    /// Print every command with its options in one page of Markdown.
    #[arg(long, conflicts_with = "command")]
    pub(crate) markdown: bool,
}
