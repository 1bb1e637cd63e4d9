//! The tracks as a data set: a Parquet file a recording, in folders that say velocity, view and trial, as Apache Hive lays them out.
//!
//! Readers that know the layout (polars, DuckDB, pandas with pyarrow, Spark) take `velocity`, `view` and `trial` for columns, and open only
//! the files that a query needs.

use std::fs;
use std::io;
use std::path::Path;

use chainwave_experiment::{Setup, TRACK_COLUMNS, TrackRows, Tracked};

use crate::error::Error;
use crate::output::make_folder;
use crate::table;

/// Writes the tracks of one striker velocity; what an earlier run left of that velocity goes.
pub(super) fn write(setup: &Setup, folder: &Path, tracked: &Tracked) -> Result<(), Error> {
    let experiment = &setup.experiment;
    let strength = experiment.nominal_drive().value;
    let driven = if experiment.striker.is_some() { "velocity" } else { "drive" };
    let of_velocity = folder.join(format!("{driven}={strength}"));
    match fs::remove_dir_all(&of_velocity) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(Error::file(&of_velocity, "remove")(error));
        }
        _ => {}
    }
    for (index, one) in tracked.recordings.iter().enumerate() {
        let trial = &one.trial;
        let part = of_velocity.join(format!("view={}", trial.view)).join(format!("trial={}", trial.trial));
        make_folder(&part)?;
        let mut rows = TrackRows::default();
        rows.add_bodies(&trial.recording, &one.tracks);
        // The number keeps recordings apart that share a view and a trial.
        let path = part.join(format!("tracks-{index}.parquet"));
        table::write_described(&path, rows.table(), &TRACK_COLUMNS)?;
    }
    Ok(())
}
