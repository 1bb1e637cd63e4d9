//! `trials.csv`: the recordings of an experiment.

use std::path::Path;

use chainwave_measurement::Estimate;

use super::Experiment;
use super::trial::Trial;
use crate::error::Error;
use crate::sanity::expect_filled_in;
use crate::table::Table;

impl Experiment {
    /// Reads the table of recordings that the experiment names; `experiment_path` is where the experiment itself lies.
    pub fn read_trials(&self, experiment_path: &Path) -> Result<Vec<Trial>, Error> {
        let path = experiment_path.with_file_name(&self.trials);
        expect_filled_in(&path, &Error::read_text(&path)?)?;
        self.trials_of(&Table::read_csv(&path)?)
    }

    /// The recordings of a table with the columns of `trials.csv`.
    ///
    /// # Errors
    /// A missing column, a cell that makes no sense, a recording twice, and no recording at all.
    pub fn trials_of(&self, table: &Table) -> Result<Vec<Trial>, Error> {
        let recordings = table.texts("recording")?;
        let (views, trials) = (table.counts("view")?, table.counts("trial")?);
        let stages_m = table.full_numbers("stage_m")?;
        let strikers = self.striker_velocities(table)?;
        let scales = scales(table, recordings.len())?;
        let mut rows: Vec<Trial> = Vec::with_capacity(recordings.len());
        for (row, recording) in recordings.into_iter().enumerate() {
            if recording.is_empty() {
                return Err(table.cell(row, "recording", "a file name", "nothing"));
            }
            if rows.iter().any(|earlier| earlier.recording == recording) {
                return Err(table.cell(row, "recording", "each recording once", &recording));
            }
            let number = |name: &str, count: usize| {
                u32::try_from(count)
                    .map_err(|_too_large| table.cell(row, name, "a number below 2^32", &count.to_string()))
            };
            let (view, trial) = (number("view", views[row])?, number("trial", trials[row])?);
            let striker_velocity_m_per_s = strikers.as_ref().map(|strikers| strikers[row]);
            let (stage_m, scale_px_per_m) = (stages_m[row], scales[row]);
            rows.push(Trial { recording, view, trial, stage_m, scale_px_per_m, striker_velocity_m_per_s });
        }
        match rows.is_empty() {
            true => Err(table.cell(0, "recording", "at least one recording", "none")),
            false => Ok(rows),
        }
    }

    /// The striker velocities of a table that has them: the columns `striker_velocity_m_per_s` and, where its scatter is not that
    /// of the experiment, `striker_velocity_sigma_m_per_s`.
    fn striker_velocities(&self, table: &Table) -> Result<Option<Vec<Estimate>>, Error> {
        let (name, sigma_name) = ("striker_velocity_m_per_s", "striker_velocity_sigma_m_per_s");
        if !table.has(name) {
            return Ok(None);
        }
        let values = table.full_numbers(name)?;
        let Some(striker) = &self.striker else {
            return Err(table.cell(0, name, "no striker velocities of a chain that [drive] drives", "some"));
        };
        let usual = striker.velocity_sigma_m_per_s.get();
        let sigmas = match table.has(sigma_name) {
            true => table.full_numbers(sigma_name)?,
            false => vec![usual; values.len()],
        };
        for (name, numbers) in [(name, &values), (sigma_name, &sigmas)] {
            if let Some(row) = numbers.iter().position(|number| *number <= 0.0) {
                return Err(table.cell(row, name, "a number above 0", &numbers[row].to_string()));
            }
        }
        Ok(Some(values.into_iter().zip(sigmas).map(|(value, sigma)| Estimate::new(value, sigma)).collect()))
    }
}

/// The column `scale_px_per_m`, whose cells may be empty; nothing for each row of a table without it.
fn scales(table: &Table, n_rows: usize) -> Result<Vec<Option<f64>>, Error> {
    const NAME: &str = "scale_px_per_m";
    if !table.has(NAME) {
        return Ok(vec![None; n_rows]);
    }
    let scales = table.numbers(NAME)?;
    match scales.iter().position(|scale| scale.is_some_and(|scale| !(scale > 0.0 && scale.is_finite()))) {
        Some(row) => Err(table.cell(row, NAME, "a number above 0", &scales[row].unwrap_or(0.0).to_string())),
        None => Ok(scales),
    }
}
