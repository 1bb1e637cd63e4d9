//! What is shown of the results of a run: its recordings with what was tracked, the wave, and the readings to look at.

use std::path::Path;

use chainwave_experiment::{Table, read_toml};
use chainwave_view::{Collection, ShownRecording, ShownTrack, ShownWave};

use crate::cli;
use crate::error::Error;
use crate::on_demand;
use crate::review::ReviewedResults;
use crate::run::PROVENANCE;
use crate::run_files::{MOTION, STRAIN, TRACKS};
use crate::table;
use crate::view::corrections;

/// The recordings that a run tracked, with where it found the bodies.
pub(super) fn of_results(arguments: &cli::View) -> Result<Collection, Error> {
    let results = &arguments.path;
    let reviewed = ReviewedResults::read(results)?;
    let are_among_them = || reviewed.recordings.iter().any(|one| results.join(&one.name).exists());
    let folder = match &arguments.recordings {
        Some(folder) => folder,
        None if are_among_them() => results,
        None => {
            return Err(Error::Argument(format!(
                "{}: expected --recordings FOLDER beside a folder of results, which names its recordings and not where they lie",
                results.display()
            )));
        }
    };
    let provenance = provenance(&results.join(PROVENANCE))?;
    let half = |key: &str| whole(&provenance, &["experiment", "tracking", key]).unwrap_or(16);
    let half_px = [half("half_width_px"), half("half_height_px")];
    let camera = provenance.get("experiment").and_then(|experiment| experiment.get("camera"));
    let rate_hz = camera.and_then(|camera| camera.get("rate_hz")).and_then(toml::Value::as_float);
    let mut options = arguments.reading.options(arguments.frame_rate.rate_hz.or(rate_hz));
    let raw = camera.and_then(|camera| camera.get("raw")).and_then(toml::Value::as_str);
    options.raw = options.raw.or(raw.and_then(|raw| raw.parse().ok()));
    on_demand::expect_readable(reviewed.recordings.iter().map(|one| folder.join(&one.name)), &options)?;
    let (mut recordings, mut notes) = (Vec::new(), Vec::new());
    // Place in the list of each recording that is there.
    let mut places = Vec::new();
    for one in &reviewed.recordings {
        let path = folder.join(&one.name);
        if !path.exists() {
            notes.push(format!("{}: tracked, and not there", path.display()));
            places.push(None);
            continue;
        }
        places.push(Some(recordings.len()));
        let track = |body: &chainwave_experiment::FollowedBody| ShownTrack {
            name: body.body.to_string(),
            half_px,
            places_px: body
                .positions
                .iter()
                .map(|at| at.as_ref().ok().map(|at| [at.x_px.value, at.y_px.value]))
                .collect(),
        };
        recordings.push(ShownRecording {
            name: one.name.clone(),
            options: options.clone(),
            tracks: one.tracks.bodies.iter().map(track).collect(),
            ..ShownRecording::new(path)
        });
    }
    let title = results.file_name().unwrap_or(results.as_os_str()).to_string_lossy().into_owned();
    if recordings.is_empty() {
        return Err(Error::Argument(format!(
            "{}: expected the recordings that {TRACKS} names, found none of them",
            folder.display()
        )));
    }
    let review = corrections::review(arguments, folder, &reviewed, &places)?;
    Ok(Collection { title, recordings, notes, review: Some(review), wave: wave(results)?, set_up: None })
}

fn provenance(path: &Path) -> Result<toml::Table, Error> {
    Ok(read_toml(path)?)
}

/// A whole number from 0 at a place of a table.
fn whole(table: &toml::Table, [first, second, last]: &[&str; 3]) -> Option<usize> {
    let value = table.get(*first)?.get(*second)?.get(*last)?;
    usize::try_from(value.as_integer()?).ok()
}

/// What was measured; none where the tracks could not be evaluated.
fn wave(results: &Path) -> Result<Option<ShownWave>, Error> {
    let (strain, motion) = (results.join(STRAIN), results.join(MOTION));
    if !strain.is_file() || !motion.is_file() {
        return Ok(None);
    }
    let (times_s, strain) = rows(&table::read(&strain)?, "gap", "strain")?;
    let (_, displacement_m) = rows(&table::read(&motion)?, "body", "x_m")?;
    Ok(Some(ShownWave { times_s, strain, displacement_m }))
}

/// Values over time, a row for each gap or body.
type RowsOverTime = Vec<Vec<Option<f64>>>;

/// The instants of a table, in their order, and for each number of a column its row of values over them; both tables of a run have the
/// same instants.
fn rows(table: &Table, number: &str, value: &str) -> Result<(Vec<f64>, RowsOverTime), Error> {
    let (times_s, numbers, values) =
        (table.full_numbers("t_s")?, table.counts(number)?, table.numbers(value)?);
    let mut instants = times_s.clone();
    instants.sort_by(f64::total_cmp);
    instants.dedup_by(|a, b| a.total_cmp(b).is_eq());
    let n = numbers.iter().copied().max().unwrap_or(0);
    let mut rows = vec![vec![None; instants.len()]; n];
    for ((time_s, number), value) in times_s.iter().zip(numbers).zip(values) {
        let at = instants.binary_search_by(|instant| instant.total_cmp(time_s));
        if let (Ok(at), Some(row)) = (at, number.checked_sub(1).and_then(|row| rows.get_mut(row))) {
            row[at] = value;
        }
    }
    Ok((instants, rows))
}
