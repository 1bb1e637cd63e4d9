//! `chainwave prove`: many synthetic experiments, filmed and processed, to see how often stated intervals hold the truth.
//!
//! Each experiment has its own seed, and takes its noise and striker from the lists given. What it found is kept in the folder
//! `.work`, so a proof that was interrupted goes on where it stopped; its recordings are removed once they are processed. On request
//! the experiments have faults, a real camera's effects, chains that are not what is stated, other protocols or other chains, in turn none
//! and one of each kind, and a table says what each does to the results.

mod by_kind;
mod coverage;
mod experiments;
mod findings;
mod planned;
mod variant;

use std::path::{Path, PathBuf};

use chainwave_experiment::{
    CameraEffect, EVALUATION_VERSION, Experiment, FAULT_KINDS, Fault, OtherChain, Protocol, Setup, Table,
    Trial, WrongChain, read_text,
};

use self::by_kind::Kinds;
use self::coverage::Coverage;
use self::findings::{ProofFinding, Said};
use self::variant::Variant;
use crate::cli;
use crate::error::Error;
use crate::kept::{Dependency, KeptFolder, digest};
use crate::outcome::Outcome;
use crate::output::{remove_unfinished, write_text};
use crate::parallel::threads;
use crate::progress;
use crate::run::name_failed;
use crate::synthesize::film_into;
use crate::table;

/// Films and processes the experiments, and writes every estimate beside its truth, the coverage, and its figure.
pub(crate) fn prove(arguments: &cli::Prove) -> Result<Outcome, Error> {
    let experiment = Experiment::read(&arguments.experiment)?;
    let trials = experiment.read_trials(&arguments.experiment)?;
    let kept = KeptFolder::in_results(&arguments.out)?;
    kept.remove_unfinished()?;
    remove_unfinished(&arguments.out)?;
    let mut outcome = Outcome::default();
    let mut found: Vec<(PathBuf, Table)> = Vec::new();
    let mut proved: Vec<&Variant> = Vec::new();
    let variants = variants(arguments, &experiment)?;
    let bar = progress::bar("proving", variants.len() as u64);
    for variant in &variants {
        let plan = Plan::of(arguments, variant, &experiment, &trials)?;
        match plan.findings(&kept) {
            Ok(table) => {
                found.push((kept.path(&plan.name), table));
                proved.push(variant);
            }
            Err(error) if error.is_interruption() => return Err(error),
            Err(error) => outcome.fail(format!("{}: {error}", variant.name())),
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if found.is_empty() {
        return Err(Error::nothing_left("experiments", variants.len()));
    }
    let (paths, tables): (Vec<PathBuf>, Vec<Table>) = found.into_iter().unzip();
    table::write_joined(&arguments.out.join("proof.parquet"), &paths)?;
    let coverage = Coverage::of(&tables)?;
    coverage.write(&arguments.out)?;
    coverage.print();
    experiments::write(&arguments.out, &tables)?;
    let proved: Vec<(&Variant, &Table)> = proved.into_iter().zip(&tables).collect();
    let own = (arguments.experiment.as_path(), &experiment, trials.as_slice());
    planned::compare(&arguments.out, own, &proved, threads(arguments.jobs))?;
    if arguments.faults {
        Kinds::FAULTS.write(&arguments.out, &tables)?;
    }
    if arguments.camera.is_some() {
        Kinds::EFFECTS.write(&arguments.out, &tables)?;
    }
    if arguments.models.is_some() {
        Kinds::CHAINS.write(&arguments.out, &tables)?;
    }
    if arguments.protocols.is_some() {
        Kinds::PROTOCOLS.write(&arguments.out, &tables)?;
    }
    if arguments.chains.is_some() {
        Kinds::OTHER_CHAINS.write(&arguments.out, &tables)?;
    }
    Ok(outcome)
}

/// The kinds that a proof counts by, none first; that alone where it does not ask for them, and all where it names none.
fn kinds<Kind: Copy>(
    option: &str,
    chosen: Option<&[String]>,
    all: &[Kind],
    name: fn(&Kind) -> &'static str,
) -> Result<Vec<Option<Kind>>, Error> {
    let named = |asked: &String| {
        all.iter().find(|kind| name(kind) == asked).copied().map(Some).ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(name).collect();
            Error::Argument(format!("{option}: expected some of {}, found {asked}", names.join(", ")))
        })
    };
    let chosen = match chosen {
        None => Vec::new(),
        Some([]) => all.iter().copied().map(Some).collect(),
        Some(names) => names.iter().map(named).collect::<Result<_, _>>()?,
    };
    Ok(std::iter::once(None).chain(chosen).collect())
}

/// Seeds one after the other, with noise and striker taken in turn; each effect of the camera, each chain, wrong or other, and each protocol
/// has the same seeds.
fn variants(arguments: &cli::Prove, experiment: &Experiment) -> Result<Vec<Variant>, Error> {
    let own = [experiment.nominal_drive().value];
    let strikers: &[f64] = if arguments.striker.is_empty() { &own } else { &arguments.striker };
    for (name, values) in [("--noise", arguments.noise.as_slice()), ("--striker", strikers)] {
        if let Some(found) = values.iter().find(|value| !(value.is_finite() && **value > 0.0)) {
            return Err(Error::Argument(format!("{name}: expected numbers above 0, found {found}")));
        }
    }
    let effects = kinds("--camera", arguments.camera.as_deref(), CameraEffect::ALL, |effect| effect.name)?;
    let chains = kinds("--models", arguments.models.as_deref(), WrongChain::ALL, |chain| chain.name)?;
    let protocols =
        kinds("--protocols", arguments.protocols.as_deref(), Protocol::ALL, |protocol| protocol.name)?;
    let others = kinds("--chains", arguments.chains.as_deref(), OtherChain::ALL, |chain| chain.name)?;
    let n_kinds = effects.len() * chains.len() * protocols.len() * others.len();
    let variant = |k: u64| {
        let place = usize::try_from(k).unwrap_or(0);
        let index = place / n_kinds;
        Variant {
            seed: arguments.first_seed + index as u64,
            effect: effects[place % effects.len()],
            chain: chains[place / effects.len() % chains.len()],
            protocol: protocols[place / effects.len() / chains.len() % protocols.len()],
            other_chain: others[place / effects.len() / chains.len() / protocols.len() % others.len()],
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

/// One experiment of a proof, before it is filmed.
struct Plan<'a> {
    variant: &'a Variant,
    experiment: Experiment,
    trials: Vec<Trial>,
    /// The experiment whose variant it is.
    path: &'a Path,
    jobs: Option<u16>,
    /// What a report has to say one of for what is wrong to count as named; nothing where nothing is wrong.
    subjects: Vec<String>,
    /// What its findings depend on.
    key: Vec<Dependency>,
    /// Under which they are kept.
    name: String,
}

impl<'a> Plan<'a> {
    fn of(
        arguments: &'a cli::Prove,
        variant: &'a Variant,
        experiment: &Experiment,
        trials: &[Trial],
    ) -> Result<Self, Error> {
        let path = arguments.experiment.as_path();
        let (mut experiment, mut trials) = (experiment.clone(), trials.to_vec());
        experiment.vary(variant.noise, variant.striker_m_per_s);
        let mut subjects = Vec::new();
        if let Some(chain) = variant.other_chain {
            chain.replace(&mut experiment, &mut trials)?;
            subjects.extend(chain.causes.iter().map(|cause| (*cause).to_owned()));
        }
        if let Some(chain) = variant.chain {
            chain.add_to(&mut experiment);
            subjects.extend(chain.causes.iter().map(|cause| (*cause).to_owned()));
        }
        if let Some(synthetic) = &mut experiment.synthetic {
            synthetic.seed = variant.seed;
            if let Some(kind) = variant.fault {
                let fault = Fault::usual(kind, &trials, synthetic.camera.rate_hz);
                subjects.extend(fault.as_ref().and_then(|fault| fault.subject(&trials)));
                synthetic.faults.extend(fault);
            }
            if let Some(effect) = variant.effect {
                effect.add_to(synthetic);
                subjects.extend(effect.causes.iter().map(|cause| (*cause).to_owned()));
            }
        }
        if let Some(protocol) = variant.protocol {
            protocol.apply(&mut experiment, &mut trials)?;
            subjects.extend(protocol.causes.iter().map(|cause| (*cause).to_owned()));
        }
        let text = toml::to_string(&experiment).map_err(|wrong| Error::Argument(wrong.to_string()))?;
        let calibration = experiment.camera.calibration.as_ref();
        let calibration = calibration.map(|name| read_text(&path.with_file_name(name))).transpose()?;
        let versions = format!("{EVALUATION_VERSION}, {}", chainwave_correlation::ALGORITHM_VERSION);
        let key = vec![
            Dependency::new("experiment", text),
            Dependency::new("trials", format!("{trials:?}")),
            Dependency::new("calibration", calibration.unwrap_or_default()),
            Dependency::new("algorithm", versions),
            Dependency::new("findings", ProofFinding::VERSION.to_string()),
        ];
        let name = format!("{}-{}", variant.name(), &digest(format!("{key:?}").as_bytes())[..16]);
        Ok(Self { variant, experiment, trials, path, jobs: arguments.jobs, subjects, key, name })
    }

    /// The kept findings; where there are none, the experiment is filmed and processed, and its recordings are removed.
    fn findings(&self, kept: &KeptFolder) -> Result<Table, Error> {
        let subject = self.variant.name();
        if let Ok(Some(table)) = kept.table(&self.name, &subject, &self.key) {
            return Ok(table);
        }
        let folder = kept.path(&self.name).with_extension("");
        let (found, said) = self.carry_out(&folder).or_else(|error| {
            // What was stopped goes on from its films. What failed would fail again, and they are large.
            if !error.is_interruption() {
                remove_folder(&folder)?;
            }
            Err(error)
        })?;
        let columns = ProofFinding::columns(self.variant, &said, &found);
        kept.keep_table(&self.name, &subject, &self.key, columns)?;
        remove_folder(&folder)?;
        table::read(&kept.path(&self.name))
    }

    /// The findings, and what the experiment is warned of.
    fn carry_out(&self, folder: &Path) -> Result<(Vec<ProofFinding>, Said), Error> {
        let recordings = folder.join("recordings");
        film_into(&self.experiment, &self.trials, self.path, &recordings, self.jobs)?;
        if let Some(name) = &self.experiment.camera.calibration {
            write_text(&recordings.join(name), &read_text(&self.path.with_file_name(name))?)?;
        }
        let setup = Setup::read(&recordings.join("experiment.toml"), None)?;
        let store = KeptFolder::in_results(&folder.join("results"))?;
        let results = setup.run(&store, threads(self.jobs), &progress::monitor(&|_| ()))?;
        let mut outcome = Outcome::default();
        name_failed(&results.tracked.failed, &mut outcome);
        let warnings = results.evaluation.warnings();
        let named = if self.subjects.is_empty() {
            !warnings.is_empty()
        } else {
            // What is wrong with one recording may stand in a decision; what is wrong with all of them is to be warned of.
            let decisions = results.decisions.iter().filter(|_| self.variant.effect.is_none());
            let evidence = decisions.map(|decision| decision.evidence.clone());
            let texts = warnings.iter().map(ToString::to_string);
            let mut said = outcome.failures().iter().cloned().chain(texts).chain(evidence);
            said.any(|text| self.subjects.iter().any(|subject| text.contains(subject)))
        };
        let mut codes: Vec<&str> = warnings.iter().map(|warning| warning.code).collect();
        codes.sort_unstable();
        codes.dedup();
        Ok((findings::findings(&setup, &results)?, Said { named, warned_of: codes.join(" ") }))
    }
}

/// Removes a folder, if it is there.
fn remove_folder(folder: &Path) -> Result<(), Error> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::file(folder, "remove")(error))
        }
        _ => Ok(()),
    }
}
