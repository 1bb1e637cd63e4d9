//! The book says what its commands print: the pages that take no film, here; the others by `cargo xtask book`.

use std::process::Command;

use crate::support::command::chainwave;
use crate::support::repository::root;

#[test]
fn pages_say_what_their_commands_print() {
    let mut xtask = Command::new(env!("CARGO"));
    xtask.args(["run", "--quiet", "--release", "--package", "xtask", "--", "book", "--fast"]);
    xtask.current_dir(root()).env("CHAINWAVE_COMMAND", chainwave().get_program());
    let output = xtask.output().expect("cargo starts");
    let (told, why) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{told}\n{why}");
    assert!(told.contains("docs/src/reference/options.md: as its commands make it"), "{told}");
}
