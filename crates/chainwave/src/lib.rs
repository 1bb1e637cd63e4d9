//! `chainwave`: from high-speed recordings of an impacted chain to displacement histories, strain maps, wave quantities and
//! fitted damping, every number with its uncertainty.
//!
//! This crate is the edge of the workspace: the only one that parses arguments, prints, reads the clock, and writes result
//! tables. A command reads its inputs, calls the inner crates (functions of values), and writes tables. Long work goes by
//! recordings, in parallel; what each recording gave is kept, so an interrupted run goes on where it stopped.
//!
//! It is a library with one function, [`main`], for two programs: `chainwave`, which knows no OpenCV, and `chainwave-opencv` (of the crate
//! of that name), which brings it first. The one becomes the other where something takes OpenCV (`on_demand`).

mod archive;
mod calibrate;
mod check;
mod choices;
mod cli;
mod closing_line;
mod command_pages;
mod compare;
mod contact;
mod correlate;
mod digits;
mod error;
mod export;
mod extremes;
mod figures;
mod import;
mod init;
mod inspect;
mod interrupt;
mod kept;
mod listing;
mod mat;
mod matching;
mod on_demand;
mod outcome;
mod output;
mod parallel;
mod plan;
mod plan_json;
mod progress;
mod prove;
mod review;
mod run;
mod run_files;
mod samples;
mod saturation;
mod shell;
mod simulate;
mod synthesize;
mod table;
mod terminal;
mod track;
mod tracks_table;
mod tradeoff;
mod view;
mod watch;
mod wave;

use std::process::ExitCode;

use clap::Parser;

use crate::cli::{Cli, Command};
use crate::error::Error;
use crate::outcome::Outcome;

/// The command: reads the program's arguments, does what they say, and tells how it went. A process calls it once, with the libraries
/// registered that it has ([`chainwave_camera::register_vision`], [`chainwave_correlation::register_foreign`]).
pub fn main() -> ExitCode {
    let Cli { command, quiet, json } = Cli::parse();
    terminal::set(quiet, json);
    if command.finishes_what_is_in_hand() {
        interrupt::listen();
    }
    let result = on_demand::expect_same_version().and_then(|()| carry_out(&command));
    let is_handed_over = result.as_ref().is_err_and(Error::needs_opencv) && on_demand::is_there();
    if !command.speaks_for_itself() && !is_handed_over {
        let error = result.as_ref().err().map(ToString::to_string);
        terminal::close(error.as_deref());
    }
    match result {
        Ok(mut outcome) => {
            if let Some(why) = terminal::unwritten() {
                outcome.fail(format!("standard output: cannot be written: {why}"));
            }
            outcome.exit_code()
        }
        Err(error) if error.is_interruption() => {
            terminal::complain(format!("{error} (hint: the same command goes on from there)"));
            interrupt::exit_code()
        }
        Err(error) if error.needs_opencv() => {
            let reason = on_demand::hand_over();
            terminal::complain(format!("{error}; {reason}"));
            ExitCode::from(2)
        }
        Err(error) => {
            terminal::complain(error);
            ExitCode::from(2)
        }
    }
}

fn carry_out(command: &Command) -> Result<Outcome, Error> {
    match command {
        Command::Inspect(arguments) => inspect::inspect(arguments),
        Command::Calibrate(arguments) => calibrate::calibrate(arguments),
        Command::Track(arguments) => track::track(arguments),
        Command::Correlate(arguments) => correlate::correlate(arguments),
        Command::Contact(arguments) => contact::contact(arguments),
        Command::Simulate(arguments) => simulate::simulate(arguments),
        Command::Synthesize(arguments) => synthesize::synthesize(arguments),
        Command::Check(arguments) => check::check(arguments),
        Command::Plan(arguments) => plan::plan(arguments),
        Command::Run(arguments) => run::run(arguments),
        Command::Figures(arguments) => figures::figures(arguments),
        Command::Compare(arguments) => compare::compare(arguments),
        Command::Archive(arguments) => archive::archive(arguments),
        Command::Export(arguments) => export::export(arguments),
        Command::Import(arguments) => import::import(arguments),
        Command::Tradeoff(arguments) => tradeoff::tradeoff(arguments),
        Command::Extremes(arguments) => extremes::extremes(arguments),
        Command::Prove(arguments) => prove::prove(arguments),
        Command::Init(arguments) => init::init(arguments),
        Command::View(arguments) => view::view(arguments),
        Command::Review(arguments) => review::review(arguments),
        Command::Watch(arguments) => watch::watch(arguments),
        Command::Samples(arguments) => samples::samples(arguments),
        Command::Completions(arguments) => shell::completions(arguments),
        Command::Man(arguments) => shell::man(arguments),
    }
}
