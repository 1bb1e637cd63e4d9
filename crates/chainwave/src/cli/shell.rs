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
    /// Command whose page is printed; default: the program's own page.
    pub(crate) command: Option<String>,
    /// Print all commands with their options as one page of Markdown.
    #[arg(long, conflicts_with = "command")]
    pub(crate) markdown: bool,
}
