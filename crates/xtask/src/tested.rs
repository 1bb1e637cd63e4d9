//! `cargo xtask tested`: the lines of a file of counts that a test prints.
//!
//! Some tables of the book are made by tests, which hold them to bounds besides. Such a test prints each line of its table behind
//! `count: `, the head first; whatever else it says is left out here. It stands where the other tests do, or in a module `tables` beside them.

use crate::command_line::CommandLine;
use crate::failure::Failure;

/// What a test writes before each line of its table.
const BEFORE: &str = "count: ";

/// `cargo xtask tested`.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Tested {
    /// The file of tests, in whichever crate it lies.
    pub(crate) file: String,
    /// The test's name, within the module `tables` if the file has one.
    pub(crate) test: String,
}

/// Runs the test, also one that is left out elsewhere, and prints its table.
pub(crate) fn run(tested: &Tested) -> Result<(), Failure> {
    let command = command(tested);
    let failed = || Failure::Ended { command: command.to_string(), code: None };
    let said = command.output().ok_or_else(failed)?;
    let mut lines = counts(&said).peekable();
    if lines.peek().is_none() {
        return Err(failed());
    }
    lines.for_each(|line| println!("{line}"));
    Ok(())
}

/// With the features of the whole workspace, so that nothing is built twice.
fn command(Tested { file, test }: &Tested) -> CommandLine {
    let in_tables = format!("tables::{test}");
    CommandLine::new(["cargo", "test", "--release", "--workspace", "--test", file, "--"]).with([
        "--exact",
        test,
        &in_tables,
        "--include-ignored",
        "--nocapture",
    ])
}

/// The lines of the table.
fn counts(said: &str) -> impl Iterator<Item = &str> {
    said.lines().filter_map(|line| line.split_once(BEFORE)).map(|(_, line)| line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_what_stands_behind_its_word() {
        // The runner's own words may stand before a line of the test's.
        let said = "running 1 test\ntest table ... count: kind,n\nbeside\ncount: a,1\nok\n";
        assert_eq!(counts(said).collect::<Vec<_>>(), ["kind,n", "a,1"]);
    }

    #[test]
    fn one_test_is_run_whether_it_is_left_out_elsewhere_or_not() {
        let [file, test] = ["bending", "table"].map(str::to_owned);
        let command = command(&Tested { file, test }).to_string();
        assert!(
            command.ends_with("--test bending -- --exact table tables::table --include-ignored --nocapture"),
            "{command}"
        );
    }
}
