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
mod positive;
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
  1  some inputs failed, each named on standard error, the rest is done; for check: there are warnings
  2  nothing could be done: bad arguments, a bad configuration

First steps:
  chainwave inspect SHOT.cine            format, size, frame rate and noise of a recording
  chainwave view FOLDER                  look at recordings, pick subsets
  chainwave init FOLDER                  a first experiment.toml for a folder of recordings
  chainwave check experiment.toml        check an experiment before a run
  chainwave run experiment.toml --out RESULTS";

/// From high-speed recordings of an impacted chain to its wave, every number with its uncertainty.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Write nothing but errors to standard error: no progress, no notes. Standard output and results stay the same.
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
    /// Print one JSON object instead of text.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show format, size, frame rate, exposure and noise of a recording.
    Inspect(Inspect),
    /// Find lens distortion and scale from images of a board.
    Calibrate(Calibrate),
    /// Follow points through recordings by digital image correlation.
    Track(Track),
    /// Compute the displacement and strain fields between two images, and draw them.
    Correlate(Correlate),
    /// Fit the contact law to a compression curve.
    Contact(Contact),
    /// Compute the motion of a chain from a scene.
    Simulate(Simulate),
    /// Make synthetic recordings of an experiment, with known true motion.
    Synthesize(Synthesize),
    /// Check an experiment and its recordings before a run.
    Check(Check),
    /// Predict the uncertainty of each result, the cost of a run, and the change that helps most.
    Plan(Plan),
    /// Process an experiment: from recordings to figures, fitted damping and a report.
    Run(Run),
    /// Redraw the figures of results in another style; nothing is computed again.
    Figures(Figures),
    /// Compare an experiment with models and published values.
    Compare(Compare),
    /// Pack results for archiving: an RO-Crate with the hash of every file.
    Archive(Archive),
    /// Write tables of results in another format: CSV, Parquet, or MATLAB's .mat.
    Export(Export),
    /// Read tracks written by another program, merge their trials, and measure the wave.
    Import(Import),
    /// Measure the cost and the error of each method on your own scene.
    Tradeoff(Tradeoff),
    /// Run limiting cases of the models against known solutions.
    Extremes(Extremes),
    /// Make and process many synthetic experiments, and count how often the stated intervals contain the truth.
    Prove(Prove),
    /// Write a first experiment.toml and trials.csv for a folder of recordings.
    Init(Init),
    /// Show recordings, subsets and tracks in a browser on this machine, and pick subsets.
    View(View),
    /// List the readings of a run that are worth checking, the most doubtful first.
    Review(Review),
    /// Check each recording as it is saved: clipping, late trigger, lost bodies, disagreement with other trials.
    Watch(Watch),
    /// Write the small sample files of the folder data-samples.
    Samples(Samples),
    /// Print a shell completion script.
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
