//! Sets the system up: looks for what a build needs and installs it where that is possible.

use crate::command_line::{CommandLine, OpenCv};
use crate::failure::Failure;
use crate::needs::{self, Need, Plan};
use crate::system;

/// Sets up, then runs the commands up to the first that fails.
pub(crate) fn run_then(opencv: OpenCv, commands: &[CommandLine]) -> Result<(), Failure> {
    let missing = run(opencv);
    let outcome = commands.iter().try_for_each(CommandLine::run);
    if outcome.is_err() && !missing.is_empty() {
        println!("\nWhat is still missing may be the reason.\n{}\n", needs::advice(&missing));
    }
    outcome
}

/// Looks for what a build needs, and installs what is missing where that is possible.
///
/// Returns what is still missing. That is no failure: a compiler or an OpenCV in an unusual place may serve all the
/// same.
pub(crate) fn run(opencv: OpenCv) -> Vec<Need> {
    println!("The build needs:");
    let missing = look(Need::of_build(opencv));
    if missing.is_empty() {
        return missing;
    }
    match needs::plan(&missing, system::has_apt(), system::rights()) {
        Plan::Tell(advice) => {
            println!("\n{advice}\n");
            missing
        }
        Plan::Install { update, install } => install_with(&update, &install, &missing),
    }
}

/// Prints what was found, and returns what was not.
fn look(needed: &[Need]) -> Vec<Need> {
    let mut missing = Vec::new();
    for &need in needed {
        match system::find(need) {
            Some(found) => println!("  {:28}{found}", need.name()),
            None => {
                println!("  {:28}missing", need.name());
                missing.push(need);
            }
        }
    }
    missing
}

/// Installs what is wanted, and returns what is missing even then.
fn install_with(update: &CommandLine, install: &CommandLine, wanted: &[Need]) -> Vec<Need> {
    // One unreachable source makes the update fail, yet the packages may be there all the same.
    for failure in [update.run(), install.run()].into_iter().filter_map(Result::err) {
        println!("{failure}");
    }
    println!("\nAfter the installation:");
    let missing = look(wanted);
    if !missing.is_empty() {
        println!("\n{}\n", needs::advice(&missing));
    }
    missing
}
