//! `chainwave prove`: many synthetic experiments, filmed and processed, to see how often stated intervals hold the truth.
//!
//! Each experiment has its own seed, and takes its noise and striker from the lists given. What it found is kept in the folder
//! `.work`, so a proof that was interrupted goes on where it stopped; its recordings are removed once they are processed. On request
//! the experiments have faults, in turn none and one of each kind, and the table says what each does to the results.

mod by_fault;
mod coverage;
mod findings;

use std::path::Path;

use self::coverage::Coverage;
use self::findings::Finding;
use crate::cli;
use crate::error::Error;
use crate::experiment::Experiment;
use crate::outcome::Outcome;
use crate::output::{make_folder, read_text, remove_unfinished, write_text};
use crate::progress;
use crate::run::Job;
use crate::synthesize::{self, FAULT_KINDS, Fault};
use crate::table::Table;

/// What distinguishes one experiment of a proof from the others.
#[derive(Debug, Clone, Copy)]
struct Variant {
    seed: u64,
    noise: f64,
    striker_m_per_s: f64,
    /// Kind of what goes wrong.
    fault: Option<&'static str>,
}

/// Films and processes the experiments, and writes every estimate beside its truth, the coverage, and its figure.
pub(crate) fn prove(arguments: &cli::Prove) -> Result<Outcome, Error> {
    let experiment = Experiment::read(&arguments.experiment)?;
    let kept = arguments.out.join(".work");
    make_folder(&kept)?;
    remove_unfinished(&kept)?;
    remove_unfinished(&arguments.out)?;
    let variants = variants(arguments, &experiment)?;
    let mut outcome = Outcome::default();
    let mut tables = Vec::with_capacity(variants.len());
    let bar = progress::bar("proving", variants.len() as u64);
    for variant in &variants {
        let name = variant.name();
        let path = kept.join(format!("{name}.parquet"));
        if !path.exists() {
            let found = one(arguments, variant, &kept.join(&name));
            match found {
                Ok((found, named)) => Finding::write(&path, variant, named, &found)?,
                Err(error) => outcome.fail(format!("{name}: {error}")),
            }
        }
        if path.exists() {
            tables.push(Table::read(&path)?);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if tables.is_empty() {
        return Err(Error::NothingLeft { what: "experiments", n: variants.len() });
    }
    Table::write_joined(&arguments.out.join("proof.parquet"), &tables)?;
    let coverage = Coverage::of(&tables)?;
    coverage.write(&arguments.out)?;
    coverage.print();
    if arguments.faults {
        by_fault::write(&arguments.out, &tables)?;
    }
    Ok(outcome)
}

impl Variant {
    fn name(&self) -> String {
        let fault = self.fault.map_or_else(String::new, |fault| format!("-{fault}"));
        format!("seed-{}-noise-{}-striker-{}{fault}", self.seed, self.noise, self.striker_m_per_s)
    }
}

/// Seeds one after the other, with noise and striker taken in turn.
fn variants(arguments: &cli::Prove, experiment: &Experiment) -> Result<Vec<Variant>, Error> {
    let own = [experiment.striker.velocity_m_per_s.get()];
    let strikers: &[f64] = if arguments.striker.is_empty() { &own } else { &arguments.striker };
    for (name, values) in [("--noise", arguments.noise.as_slice()), ("--striker", strikers)] {
        if let Some(found) = values.iter().find(|value| !(value.is_finite() && **value > 0.0)) {
            return Err(Error::Argument(format!("{name}: expected numbers above 0, found {found}")));
        }
    }
    let variant = |k: u64| {
        let index = usize::try_from(k).unwrap_or(0);
        Variant {
            seed: arguments.first_seed + k,
            noise: arguments.noise[index % arguments.noise.len()],
            striker_m_per_s: strikers[index / arguments.noise.len() % strikers.len()],
            fault: FAULT_KINDS
                .get((index + FAULT_KINDS.len()) % (FAULT_KINDS.len() + 1))
                .copied()
                .filter(|_| arguments.faults),
        }
    };
    Ok((0..arguments.experiments).map(variant).collect())
}

/// Films one experiment, processes it, and removes its recordings; whether what went wrong was named, or, where nothing did, whether
/// there was a warning all the same.
fn one(arguments: &cli::Prove, variant: &Variant, folder: &Path) -> Result<(Vec<Finding>, bool), Error> {
    make_folder(folder)?;
    let mut experiment = Experiment::read(&arguments.experiment)?;
    let trials = experiment.read_trials(&arguments.experiment)?;
    experiment.vary(variant.noise, variant.striker_m_per_s);
    let mut subject = None;
    if let (Some(kind), Some(synthetic)) = (variant.fault, &mut experiment.synthetic) {
        let fault = Fault::usual(kind, &trials, synthetic.camera.rate_hz);
        subject = fault.as_ref().and_then(|fault| fault.subject(&trials));
        synthetic.faults.extend(fault);
    }
    let plan = folder.join("plan.toml");
    let text = toml::to_string(&experiment).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    write_text(&plan, &text)?;
    let beside = [Some(&experiment.trials), experiment.camera.calibration.as_ref()];
    for name in beside.into_iter().flatten() {
        let from = arguments.experiment.with_file_name(name);
        write_text(&folder.join(name), &read_text(&from)?)?;
    }
    let recordings = folder.join("recordings");
    let filming = cli::Synthesize {
        experiment: plan,
        out: recordings.clone(),
        seed: Some(variant.seed),
        jobs: arguments.jobs,
    };
    let _filmed = synthesize::synthesize(&filming)?;
    if let Some(name) = &experiment.camera.calibration {
        write_text(&recordings.join(name), &read_text(&folder.join(name))?)?;
    }
    let job = Job::read(&cli::Run {
        experiment: recordings.join("experiment.toml"),
        out: folder.join("results"),
        recordings: None,
        jobs: arguments.jobs,
        share: None,
    })?;
    let mut outcome = Outcome::default();
    let compared = job.compare_with_truth(&mut outcome)?;
    let warnings = compared.evaluation.warnings();
    let evidence = compared.decisions.iter().map(|decision| &decision.evidence);
    let mut said = outcome.failures().iter().chain(&warnings).chain(evidence);
    let named = subject.map_or(!warnings.is_empty(), |subject| said.any(|text| text.contains(&subject)));
    let found = findings::findings(&job, &compared)?;
    std::fs::remove_dir_all(folder).map_err(Error::file(folder, "remove"))?;
    Ok((found, named))
}
