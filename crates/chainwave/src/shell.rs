//! `chainwave completions` and `chainwave man`: what a shell and a reader of manuals want to have.

use std::io::Write;

use clap::CommandFactory;
use clap_mangen::Man;

use crate::cli::{Cli, Completions, ManPage};
use crate::command_pages;
use crate::error::Error;
use crate::outcome::Outcome;

const NAME: &str = "chainwave";

/// Prints the script that makes a shell complete commands and options.
pub(crate) fn completions(arguments: &Completions) -> Result<Outcome, Error> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), NAME, &mut script);
    print(&script)
}

/// Prints a page of the manual: of the program, of one command, or of all of them with their options.
pub(crate) fn man(arguments: &ManPage) -> Result<Outcome, Error> {
    let mut program = Cli::command();
    program.build();
    if arguments.markdown {
        return print(command_pages::markdown(&program).as_bytes());
    }
    let page = match &arguments.command {
        None => Man::new(program),
        Some(name) => {
            let names =
                || program.get_subcommands().map(clap::Command::get_name).collect::<Vec<_>>().join(", ");
            let command = program.find_subcommand(name).ok_or_else(|| {
                Error::Argument(format!("man: expected one of {}; found {name:?}", names()))
            })?;
            Man::new(command.clone()).title(format!("{NAME}-{name}"))
        }
    };
    let mut text = Vec::new();
    page.render(&mut text).map_err(|why| Error::Argument(format!("man: {why}")))?;
    print(&text)
}

/// A reader that has read enough is no failure.
fn print(text: &[u8]) -> Result<Outcome, Error> {
    match std::io::stdout().write_all(text) {
        Err(why) if why.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::Argument(format!("standard output: cannot be written: {why}")))
        }
        _ => Ok(Outcome::default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_page_that_is_not_there_is_named_with_those_that_are() {
        let said = man(&ManPage { command: Some("walk".into()), markdown: false }).unwrap_err().to_string();
        assert!(said.contains("run") && said.contains("track") && said.contains("\"walk\""), "{said}");
    }
}
