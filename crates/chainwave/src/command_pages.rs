//! `chainwave man --markdown`: every command with its arguments and options, as a page of the book has them.

use std::fmt::Write;

use clap::{Arg, Command};

/// A section for each command: what it does, and a table of what it takes. Options that all of them take stand above.
pub(crate) fn markdown(program: &Command) -> String {
    let mut page = table(program.get_arguments().filter(|argument| argument.is_global_set()));
    for command in program.get_subcommands().filter(|command| command.get_name() != "help") {
        let own = command.get_arguments().filter(|argument| !argument.is_global_set());
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        let (name, rows) = (command.get_name(), table(own));
        // Writing to a text cannot fail.
        let _ = write!(page, "\n## `{} {name}`\n\n{}.\n\n{rows}", program.get_name(), line(&about));
    }
    page
}

/// A row for each argument and option but those that print help.
fn table<'a>(arguments: impl Iterator<Item = &'a Arg>) -> String {
    let shown = arguments.filter(|argument| !argument.is_hide_set());
    let shown = shown.filter(|argument| !["help", "version"].contains(&argument.get_id().as_str()));
    let rows: Vec<String> = shown.map(row).collect();
    format!("| | what it says | unless given |\n|---|---|---|\n{}", rows.concat())
}

fn row(argument: &Arg) -> String {
    let help = argument.get_long_help().or_else(|| argument.get_help()).map(ToString::to_string);
    let help = line(&help.unwrap_or_default());
    let end = if help.ends_with(['.', '!']) { "" } else { "." };
    format!("| `{}` | {help}{end} | {} |\n", written(argument), unless_given(argument))
}

/// An option with its value, or the name of an argument, as a user writes them.
fn written(argument: &Arg) -> String {
    let takes_a_value = argument.is_positional() || argument.get_action().takes_values();
    let choices: Vec<String> =
        argument.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
    let names: Vec<&str> = argument.get_value_names().unwrap_or_default().iter().map(AsRef::as_ref).collect();
    let value = match (takes_a_value, choices.is_empty()) {
        (false, _) => String::new(),
        (true, true) => names.join(" "),
        (true, false) => choices.join("\\|"),
    };
    let many = argument.get_num_args().is_some_and(|range| range.max_values() > 1);
    let value = if many { format!("{value}...") } else { value };
    match argument.get_long() {
        Some(long) if value.is_empty() => format!("--{long}"),
        Some(long) => format!("--{long} {}", value.replace("[le|be|p]", "[le\\|be\\|p]")),
        None => value,
    }
}

/// What holds where nothing is said.
fn unless_given(argument: &Arg) -> String {
    let values: Vec<_> = argument.get_default_values().iter().map(|value| value.to_string_lossy()).collect();
    match (argument.is_required_set(), values.is_empty()) {
        (true, _) => "needed".to_owned(),
        (false, false) if argument.get_action().takes_values() => format!("`{}`", values.join(",")),
        (false, _) => String::new(),
    }
}

/// A text in one line that breaks no table.
fn line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::cli::Cli;

    #[test]
    fn every_command_and_option_is_there() {
        let mut program = Cli::command();
        program.build();
        let page = markdown(&program);
        for command in program.get_subcommands().filter(|command| command.get_name() != "help") {
            let heading = format!("## `chainwave {}`", command.get_name());
            assert!(page.lines().any(|line| line == heading), "{heading}");
            for long in command.get_arguments().filter_map(Arg::get_long).filter(|long| *long != "help") {
                assert!(page.contains(&format!("`--{long}")), "{heading}: --{long}");
            }
        }
    }

    #[test]
    fn rows_say_what_is_needed_and_what_holds_otherwise() {
        let mut program = Cli::command();
        program.build();
        let page = markdown(&program);
        for row in [
            "| `RECORDINGS...` | The recordings. | needed |",
            "| `--reference REFERENCE` | Reference frame, from 0. | `0` |",
            "| `--board checkerboard\\|charuco` | What the board shows. | needed |",
            "| `--partial` | Take the whole frames of recordings that were cut short, and say how many they are. | |",
        ] {
            let row = row.replace("| |", "|  |");
            assert!(page.lines().any(|line| line == row), "{row}\n{page}");
        }
        let columns = |line: &str| line.replace("\\|", "").matches('|').count();
        let tables = page.lines().filter(|line| line.starts_with('|'));
        assert!(tables.clone().all(|line| columns(line) == 4), "{tables:?}");
    }
}
