//! The truth beside the recordings: `truth.parquet`, `truth.json`, `truth_trials.csv`, `truth_bodies.csv`.

use std::path::Path;

use chainwave_experiment::{FilmTruth, MeanMotion, TRUTH, TrueTrial};

use crate::error::Error;
use crate::output::write_json;
use crate::table::{self, column};

/// Writes what is behind the recordings.
pub(super) fn write(truth: &FilmTruth, folder: &Path) -> Result<(), Error> {
    let drive = if truth.is_struck { "striker_velocity_m_per_s" } else { "drive" };
    write_motions(&truth.motions, drive, folder)?;
    write_json(&folder.join(TRUTH), &truth.parameters)?;
    write_trials(&truth.trials, drive, folder)?;
    let bodies: Vec<u32> = (1..).take(truth.masses_kg.len()).collect();
    let columns = vec![column("body", bodies), column("mass_kg", truth.masses_kg.clone())];
    table::write(&folder.join("truth_bodies.csv"), columns)
}

/// `truth.parquet`: the mean motions of all strikers, by time.
fn write_motions(motions: &[MeanMotion], drive: &str, folder: &Path) -> Result<(), Error> {
    let (mut times_s, mut bodies) = (Vec::new(), Vec::new());
    let (mut displacements_m, mut nominals_m_per_s) = (Vec::new(), Vec::new());
    for motion in motions {
        for ((i, row), x_m) in motion.displacement_m.indexed_iter() {
            times_s.push(motion.times_s[i]);
            bodies.push(row as u32 + 1);
            displacements_m.push(*x_m);
            nominals_m_per_s.push(motion.nominal_m_per_s);
        }
    }
    let columns = vec![
        column("t_s", times_s),
        column("body", bodies),
        column("x_m", displacements_m),
        column(drive, nominals_m_per_s),
    ];
    table::write(&folder.join("truth.parquet"), columns)
}

/// `truth_trials.csv`: one row a recording, in the order of the trials table.
fn write_trials(trials: &[TrueTrial], drive: &str, folder: &Path) -> Result<(), Error> {
    let of = |value: &dyn Fn(&TrueTrial) -> f64| trials.iter().map(value).collect::<Vec<f64>>();
    let columns = vec![
        column("recording", trials.iter().map(|trial| trial.recording.as_str()).collect::<Vec<_>>()),
        column(drive, of(&|trial| trial.striker_velocity_m_per_s)),
        column("trigger_delay_s", of(&|trial| trial.trigger_delay_s)),
        column("frame_phase_s", of(&|trial| trial.frame_phase_s)),
        column("stage_m", of(&|trial| trial.stage_m)),
        column("faults", trials.iter().map(|trial| trial.faults.as_str()).collect::<Vec<_>>()),
    ];
    table::write(&folder.join("truth_trials.csv"), columns)
}
