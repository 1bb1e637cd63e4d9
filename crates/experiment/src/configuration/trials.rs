//! `trials.csv`: the recordings of an experiment.

use std::path::{Component, Path, PathBuf};

use chainwave_measurement::Estimate;

use super::Experiment;
use super::fill_in::expect_filled_in;
use super::trial::Trial;
use crate::error::Error;
use crate::input::table::Table;
use crate::input::text_file::read_text;

impl Experiment {
    /// Reads the table of recordings that the experiment names; `experiment_path` is where the experiment itself lies.
    pub fn read_trials(&self, experiment_path: &Path) -> Result<Vec<Trial>, Error> {
        let path = experiment_path.with_file_name(&self.trials);
        expect_filled_in(&path, &read_text(&path)?)?;
        self.trials_of(&Table::read_csv(&path)?)
    }

    /// The recordings of a table with the columns of `trials.csv`.
    ///
    /// # Errors
    /// A missing column, a cell that makes no sense, a recording twice, a trial of a view twice at one striker velocity, and no recording at
    /// all.
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
            let path = plain(&recording);
            if let Some(earlier) = rows.iter().position(|earlier| plain(&earlier.recording) == path) {
                let found = format!("{recording}, which line {} has", table.line(earlier));
                return Err(table.cell(row, "recording", "each recording once", &found));
            }
            let number = |name: &str, count: usize| {
                u32::try_from(count)
                    .map_err(|_too_large| table.cell(row, name, "a number below 2^32", &count.to_string()))
            };
            let (view, trial) = (number("view", views[row])?, number("trial", trials[row])?);
            let striker_velocity_m_per_s = strikers.as_ref().map(|strikers| strikers[row]);
            let (stage_m, scale_px_per_m) = (stages_m[row], scales[row]);
            let one = Trial { recording, view, trial, stage_m, scale_px_per_m, striker_velocity_m_per_s };
            if let Some(earlier) = rows.iter().position(|earlier| earlier.is_same_shot(&one)) {
                return Err(same_shot(table, &rows, earlier, &one));
            }
            rows.push(one);
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

/// A recording's path without the parts that lead nowhere: `./a/`, `b/../a` and `a` name one recording.
fn plain(recording: &str) -> PathBuf {
    let mut path = PathBuf::new();
    for part in Path::new(recording).components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(path.components().next_back(), Some(Component::Normal(_))) => {
                path.pop();
            }
            other => path.push(other),
        }
    }
    path
}

/// What is said of a row that follows `rows` and states the shot of the row `earlier` again.
fn same_shot(table: &Table, rows: &[Trial], earlier: usize, one: &Trial) -> Error {
    let expected = format!("each trial of view {} once at a striker velocity", one.view);
    let (first, line) = (&rows[earlier].recording, table.line(earlier));
    let found = format!("trial {} of {} again, which line {line} has of {first}", one.trial, one.recording);
    table.cell(rows.len(), "trial", &expected, &found)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What the small experiment reads of a table of recordings.
    fn read(text: &str) -> Result<Vec<Trial>, String> {
        let path =
            Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/small-experiment/experiment.toml"));
        let experiment = Experiment::read(path).unwrap();
        let table = Table::parse_csv(Path::new("trials.csv"), text).unwrap();
        experiment.trials_of(&table).map_err(|error| error.to_string())
    }

    #[test]
    fn a_trial_of_a_view_that_stands_there_twice_is_refused_with_both_rows() {
        let said = read(
            "recording,view,trial,stage_m\na.cine,1,1,0\nb.cine,1,2,0\n\nc.cine,2,1,0.1\nd.cine,1,2,0\n",
        )
        .unwrap_err();
        // Lines of the file from 1: its header, two rows, an empty line, two rows.
        for part in ["trials.csv", "line 6", "column trial", "trial 2 of d.cine", "line 3 has of b.cine"] {
            assert!(said.contains(part), "{part}: {said}");
        }
    }

    #[test]
    fn a_recording_is_the_same_however_its_path_is_written() {
        for other in ["view1/a", "./view1/a", "view1/a/", "view1/./a", "view1/b/../a", "./view1/../view1//a"]
        {
            let said =
                read(&format!("recording,view,trial,stage_m\nview1/a,1,1,0\n{other},1,2,0\n")).unwrap_err();
            for part in ["line 3, column recording", "each recording once", other, "which line 2 has"] {
                assert!(said.contains(part), "{part}: {said}");
            }
        }
        assert!(read("recording,view,trial,stage_m\nview1/a,1,1,0\n../view1/a,1,2,0\na,1,3,0\n").is_ok());
    }

    #[test]
    fn a_trial_number_may_stand_there_again_in_another_view_or_at_another_striker_velocity() {
        let velocities = "recording,view,trial,stage_m,striker_velocity_m_per_s\n\
            a.cine,1,1,0,1.0\nb.cine,1,1,0,2.0\nc.cine,2,1,0.1,1.0\n";
        assert_eq!(read(velocities).unwrap().len(), 3);
        let again = format!("{velocities}d.cine,1,1,0,2.0\n");
        assert!(read(&again).unwrap_err().contains("line 3 has of b.cine"), "{:?}", read(&again));
    }
}
