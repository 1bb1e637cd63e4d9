//! The command line.

mod archive;
mod calibrate;
mod check;
mod compare;
mod contact;
mod correlate;
mod export;
mod figures;
mod import;
mod init;
mod inspect;
mod plan;
mod prove;
mod reading;
mod review;
mod run;
mod samples;
mod sensor;
mod shell;
mod simulate;
mod synthesize;
mod track;
mod tradeoff;
mod velocities;
mod view;
mod watch;

use clap::{Parser, Subcommand};

pub(crate) use self::archive::Archive;
pub(crate) use self::calibrate::{Board, Calibrate};
pub(crate) use self::check::Check;
pub(crate) use self::compare::Compare;
pub(crate) use self::contact::Contact;
pub(crate) use self::correlate::Correlate;
pub(crate) use self::export::Export;
pub(crate) use self::figures::{FigureFormat, Figures};
pub(crate) use self::import::Import;
pub(crate) use self::init::Init;
pub(crate) use self::inspect::Inspect;
pub(crate) use self::plan::Plan;
pub(crate) use self::prove::{Extremes, Prove};
pub(crate) use self::review::Review;
pub(crate) use self::run::Run;
pub(crate) use self::samples::Samples;
pub(crate) use self::sensor::Sensor;
pub(crate) use self::shell::{Completions, ManPage};
pub(crate) use self::simulate::Simulate;
pub(crate) use self::synthesize::Synthesize;
pub(crate) use self::track::{Matching, Track};
pub(crate) use self::tradeoff::Tradeoff;
pub(crate) use self::velocities::Velocities;
pub(crate) use self::view::View;
pub(crate) use self::watch::Watch;

/// What stands below the commands.
const AFTER_HELP: &str = "\
Exit codes:
  0  all done
  1  some inputs failed, each named on standard error, and the rest is done; for check: there are warnings
  2  nothing could be done: bad arguments, a bad configuration

First steps:
  chainwave inspect SHOT.cine            what a recording holds
  chainwave view FOLDER                  look at recordings, pick subsets
  chainwave init FOLDER                  a first experiment.toml for a folder of recordings
  chainwave check experiment.toml        whether a run makes sense
  chainwave run experiment.toml --out RESULTS";

/// From high-speed recordings of an impacted chain to its wave, every number with its uncertainty.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Say nothing on standard error but errors: no progress, no notes. Results are the same.
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
    /// Print JSON: one object with what the command says, in place of text.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Say what a recording holds.
    Inspect(Inspect),
    /// Find lens distortion and scale from pictures of a board.
    Calibrate(Calibrate),
    /// Follow points through recordings by digital image correlation.
    Track(Track),
    /// Find the displacement field between two images, with strain and a picture.
    Correlate(Correlate),
    /// Fit the contact law to a compression curve.
    Contact(Contact),
    /// Compute the motion of a chain from a scene.
    Simulate(Simulate),
    /// Film a synthetic experiment: recordings with known truth.
    Synthesize(Synthesize),
    /// Say whether a run of an experiment makes sense, before time is spent on it.
    Check(Check),
    /// Say what an experiment will tell before it is filmed or run, what limits it, and which change would help.
    Plan(Plan),
    /// Process an experiment: from recordings to figures, fitted damping and a report.
    Run(Run),
    /// Draw the figures of results again in another style, without computing anything.
    Figures(Figures),
    /// Set an experiment, its models and published numbers beside each other: figures with all of them, and one table.
    Compare(Compare),
    /// Pack results for an archive: an RO-Crate, with the hash of every file.
    Archive(Archive),
    /// Write tables of results in another format: CSV, Parquet, or MATLAB's .mat.
    Export(Export),
    /// Read tracks that another program wrote, merge their trials, and measure the wave.
    Import(Import),
    /// Measure what each method costs on your own scene, and how far it is off.
    Tradeoff(Tradeoff),
    /// Try cases at the ends of what the program takes, each against a truth of its own.
    Extremes(Extremes),
    /// Film and process many synthetic experiments, and count how often stated intervals hold the truth.
    Prove(Prove),
    /// Write a first experiment.toml and trials.csv for a folder of recordings.
    Init(Init),
    /// Show recordings, subsets and tracks in a browser on this machine, and pick subsets.
    View(View),
    /// List the readings of a run that deserve a look, the most doubtful first.
    Review(Review),
    /// Look at each shot as soon as it is saved: clipped, late trigger, body lost, off the other trials.
    Watch(Watch),
    /// Make the small samples of the folder data-samples.
    Samples(Samples),
    /// Print the script that makes a shell complete commands and options.
    Completions(Completions),
    /// Print a page of the manual, for `man -l -`.
    Man(ManPage),
}

impl Command {
    /// Whether it prints what it has to say as it goes, line by line or as a file: there is no object at its end.
    pub(crate) fn speaks_for_itself(&self) -> bool {
        matches!(self, Self::View(_) | Self::Watch(_) | Self::Completions(_) | Self::Man(_))
    }

    /// Whether what is in hand is worth finishing when the user interrupts: a run goes on from there, and a shot is looked at to its end.
    pub(crate) fn finishes_what_is_in_hand(&self) -> bool {
        matches!(self, Self::Run(_) | Self::Prove(_) | Self::Synthesize(_) | Self::Watch(_))
    }
}
