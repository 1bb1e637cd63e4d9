//! `chainwave synthesize`: the recordings of an experiment as the camera would have written them, with the truth beside.

mod truth;

use std::path::Path;

use chainwave_experiment::{Experiment, FILMED, TRUTH, Trial, film_experiment, read_text};
use chainwave_measurement::Estimate;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::{make_folder, remove_unfinished, stays_within, write_text};
use crate::parallel::threads;
use crate::progress;
use crate::table::{self, column};

/// Films every recording of an experiment's trials table. A recording that is there already with the same settings is kept.
pub(crate) fn synthesize(arguments: &cli::Synthesize) -> Result<Outcome, Error> {
    let path = &arguments.experiment;
    let mut experiment = Experiment::read(path)?;
    let trials = experiment.read_trials(path)?;
    if let (Some(synthetic), Some(seed)) = (&mut experiment.synthetic, arguments.seed) {
        synthetic.seed = seed;
    }
    film_into(&experiment, &trials, path, &arguments.out, arguments.jobs)?;
    Ok(Outcome::default())
}

/// Films an experiment into a folder, and writes its plan and its truth beside the recordings, where the trials table states what views
/// are magnified by; `path` is where the experiment lies. Recordings that were not filmed are never replaced.
pub(crate) fn film_into(
    experiment: &Experiment,
    trials: &[Trial],
    path: &Path,
    folder: &Path,
    jobs: Option<u16>,
) -> Result<(), Error> {
    experiment.check_film(trials, path)?;
    expect_names_within(trials, path)?;
    make_folder(folder)?;
    remove_unfinished(folder)?;
    let trials = &experiment.with_scales_of_views(trials)[..];
    if !is_up_to_date(experiment, trials, folder)? {
        expect_own(trials, folder)?;
        // The sign stands last: until then no recording is there that it might be taken to vouch for.
        remove_recordings(trials, folder)?;
        write_plan(experiment, trials, path, folder)?;
        write_text(&folder.join(FILMED), &plan(experiment)?)?;
    }
    let bar = progress::bar("filming", 0);
    let show = progress::shown_on(&bar);
    let monitor = progress::monitor(&show);
    let truth = film_experiment(experiment, trials, path, folder, threads(jobs), &monitor)?;
    truth::write(&truth, folder)
}

/// Refuses names of recordings that lead out of the folder.
fn expect_names_within(trials: &[Trial], path: &Path) -> Result<(), Error> {
    match trials.iter().find(|trial| !stays_within(&trial.recording)) {
        Some(trial) => Err(Error::Argument(format!(
            "{}: the trials table names {}: expected recordings that lie in the folder itself, to be filmed there",
            path.display(),
            trial.recording
        ))),
        None => Ok(()),
    }
}

/// Refuses a folder that holds recordings which were not filmed: they may be real ones.
fn expect_own(trials: &[Trial], folder: &Path) -> Result<(), Error> {
    let is_own = [FILMED, TRUTH].iter().any(|name| folder.join(name).exists());
    let found = trials.iter().map(|trial| folder.join(&trial.recording)).find(|path| path.exists());
    match found.filter(|_| !is_own) {
        Some(found) => Err(Error::Argument(format!(
            "{}: expected a folder without recordings, found {}, which was not filmed here and may be a real one (hint: name another folder)",
            folder.display(),
            found.display()
        ))),
        None => Ok(()),
    }
}

/// Whether the folder already holds this very plan, so that its finished recordings may be kept.
fn is_up_to_date(experiment: &Experiment, trials: &[Trial], folder: &Path) -> Result<bool, Error> {
    let (plan, path) = (plan(experiment)?, folder.join("experiment.toml"));
    // Folders that were filmed before there was a sign have the plan as the experiment alone.
    let kept = [folder.join(FILMED), path.clone()].into_iter().find(|kept| kept.exists());
    match kept {
        Some(kept) if read_text(&kept)? == plan => {
            Ok(experiment.read_trials(&path).is_ok_and(|found| found == trials))
        }
        _ => Ok(false),
    }
}

fn remove_recordings(trials: &[Trial], folder: &Path) -> Result<(), Error> {
    for trial in trials {
        let path = folder.join(&trial.recording);
        if path.exists() {
            std::fs::remove_file(&path)
                .map_err(Error::file(&path, "remove the recording of another plan"))?;
        }
    }
    Ok(())
}

fn plan(experiment: &Experiment) -> Result<String, Error> {
    toml::to_string(experiment).map_err(|wrong| Error::Argument(wrong.to_string()))
}

/// Writes `experiment.toml` and `trials.csv` beside the recordings, so that `run` can start there. An experiment that lies there itself stays as it is
/// written, with its comments, and its trials table does where it says the same.
fn write_plan(experiment: &Experiment, trials: &[Trial], path: &Path, folder: &Path) -> Result<(), Error> {
    let there = folder.join("experiment.toml");
    let is_itself =
        there.canonicalize().is_ok_and(|there| path.canonicalize().is_ok_and(|path| path == there));
    if !is_itself {
        write_text(&there, &plan(experiment)?)?;
    }
    if is_itself && experiment.read_trials(path).is_ok_and(|found| found == trials) {
        return Ok(());
    }
    let mut columns = vec![
        column("recording", trials.iter().map(|trial| trial.recording.as_str()).collect::<Vec<_>>()),
        column("view", trials.iter().map(|trial| trial.view).collect::<Vec<_>>()),
        column("trial", trials.iter().map(|trial| trial.trial).collect::<Vec<_>>()),
        column("stage_m", trials.iter().map(|trial| trial.stage_m).collect::<Vec<_>>()),
    ];
    let scales: Vec<Option<f64>> = trials.iter().map(|trial| trial.scale_px_per_m).collect();
    if scales.iter().any(Option::is_some) {
        columns.push(column("scale_px_per_m", scales));
    }
    let strikers: Option<Vec<Estimate>> = trials.iter().map(|trial| trial.striker_velocity_m_per_s).collect();
    if let Some(strikers) = strikers {
        let of = |value: &dyn Fn(&Estimate) -> f64| strikers.iter().map(value).collect::<Vec<f64>>();
        columns.push(column("striker_velocity_m_per_s", of(&|striker| striker.value)));
        columns.push(column("striker_velocity_sigma_m_per_s", of(&|striker| striker.sigma)));
    }
    table::write(&folder.join(&experiment.trials), columns)
}
