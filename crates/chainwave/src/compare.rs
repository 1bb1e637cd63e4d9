//! `chainwave compare`: an experiment, its models and what was published beside each other, as figures and as one table.
//!
//! Nothing is computed anew but what a motion's wave is: recordings are run, and scenes simulated, before. Every wave is measured the same
//! way, models over the gaps that the experiment's group velocity is of.

mod figures;
mod findings;
mod parts;
mod study;
mod tail;

use std::path::Path;

use self::parts::Compared;
use self::study::Study;
use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::make_folder;
use crate::terminal::say;

/// Sets a study's parts beside each other.
pub(crate) fn compare(arguments: &cli::Compare) -> Result<Outcome, Error> {
    let study = Study::read(&arguments.study)?;
    let from = arguments.from.as_path();
    let compared = Compared::read(&study, from)?;
    make_folder(&arguments.out)?;
    figures::draw(&study, from, &compared, &arguments.out)?;
    let findings = findings::all(&study, &compared);
    findings::write(&arguments.out, &study, &findings)?;
    say(&arguments.out, findings.len());
    Ok(Outcome::default())
}

fn say(out: &Path, n_numbers: usize) {
    say!("wrote figures and comparison.md ({n_numbers} numbers) into {}", out.display());
}
