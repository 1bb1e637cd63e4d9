//! Sets a fresh system up and runs the commands of the README, `cargo xtask demo`, `cargo xtask paper` and `cargo xtask test`; and
//! `cargo xtask book`, `bench`, `counted`, `tested`, `equations`, `keys`, `python` and `dist`.
//!
//! It is the first thing that is built in a fresh clone, before anything that the heavy crates need is installed, so
//! it depends on the standard library alone. What is decided ([`arguments`], [`needs`], the command lists of [`demo`],
//! [`paper`] and [`test_run`]) is kept apart from what looks at the system or changes it ([`system`], [`setup`], [`command_line`]).

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line tool reports by printing")]

mod arguments;
mod bench;
mod book;
mod command_line;
mod counted;
mod demo;
mod dist;
mod equations;
mod failure;
mod given_command;
mod keys;
mod needs;
mod paper;
mod setup;
mod skipped;
mod system;
mod test_run;
mod tested;
mod wheel;

use std::env;
use std::process::ExitCode;

use arguments::Task;
use failure::Failure;

fn main() -> ExitCode {
    match arguments::parse(env::args_os().skip(1)).and_then(run) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("xtask: {failure}");
            failure.exit_code()
        }
    }
}

fn run(task: Task) -> Result<(), Failure> {
    match task {
        Task::Demo(demo) => demo::run(&demo),
        Task::Paper(paper) => paper::run(&paper),
        Task::Test(test_run) => test_run::run(&test_run),
        Task::Bench(bench) => bench::run(&bench),
        Task::Book(book) => book::run(&book),
        Task::Counted(counted) => counted::run(&counted),
        Task::Tested(tested) => tested::run(&tested),
        Task::Equations => equations::run(),
        Task::Supports => Ok(()),
        Task::Keys => keys::run(),
        Task::Python => wheel::run(),
        Task::Dist { out } => dist::run(out.as_deref()),
        Task::Setup { opencv } => {
            setup::run(opencv);
            Ok(())
        }
        Task::Help => {
            print!("{}", arguments::HELP);
            Ok(())
        }
    }
}
