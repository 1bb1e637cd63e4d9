//! `chainwave review`: the readings of a run that deserve a look, the most doubtful first.

mod results;

use std::path::Path;

use chainwave_experiment::{Doubt, DoubtfulReading, ReviewedRecording, review_queue};
use polars_core::prelude::Column;
use serde_json::{Value, json};

pub(crate) use self::results::ReviewedResults;
use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::table::{self, column};
use crate::terminal::{answer, is_json, say};

/// Readings that are listed where nothing else is asked for: as many as somebody looks at in an hour.
const USUAL: usize = 200;
/// Of those, the ones that a screen holds.
const ON_SCREEN: usize = 20;

/// Writes or prints the queue.
pub(crate) fn review(arguments: &cli::Review) -> Result<Outcome, Error> {
    if let Some(out) = &arguments.out {
        table::expect_writable(out)?;
    }
    let results = ReviewedResults::read(&arguments.results)?;
    let whole = results.queue();
    let n_readings = whole.len();
    let most = arguments.most.unwrap_or(USUAL);
    let queue: Vec<DoubtfulReading> = whole.into_iter().take(most).collect();
    if let Some(out) = &arguments.out {
        table::write(out, columns(&results, &queue))?;
    }
    match is_json() {
        true => answer(&json!({
            "n_readings": n_readings,
            "queue": queue.iter().map(|one| as_json(&results, one)).collect::<Vec<_>>(),
        })),
        false => in_words(&results, &queue, n_readings, arguments.out.as_deref()),
    }
    Ok(Outcome::default())
}

impl ReviewedResults {
    /// All readings, the most doubtful first.
    pub(crate) fn queue(&self) -> Vec<DoubtfulReading> {
        let recordings: Vec<ReviewedRecording<'_>> = self
            .recordings
            .iter()
            .map(|one| ReviewedRecording { recording: &one.name, view: one.view, tracks: &one.tracks })
            .collect();
        review_queue(&recordings)
    }

    fn time_s(&self, one: &DoubtfulReading) -> f64 {
        self.recordings[one.recording].tracks.times_s[one.frame]
    }
}

/// What a reading's doubt consists of, in words.
pub(crate) fn reasons(one: &DoubtfulReading) -> String {
    if let Some(lost) = one.lost {
        return format!("lost: {}", lost.as_str());
    }
    let mut of_each = one.of_each.clone();
    of_each.sort_by(|a, b| b.1.total_cmp(&a.1));
    let told = |(doubt, sigmas): &(Doubt, f64)| {
        let what = match doubt {
            Doubt::OtherTrials => "off the other trials",
            Doubt::Neighbours => "off the frames before and after",
            Doubt::Residual => "residual above the usual",
            Doubt::Sigma => "sigma above the usual",
        };
        format!("{what} by {sigmas:.1}")
    };
    let large: Vec<String> = of_each.iter().filter(|(_, sigmas)| *sigmas >= 2.0).map(told).collect();
    if large.is_empty() { "nothing unusual".into() } else { large.join(", ") }
}

fn of_doubt(one: &DoubtfulReading, wanted: Doubt) -> Option<f64> {
    one.of_each.iter().find(|(doubt, _)| *doubt == wanted).map(|(_, sigmas)| *sigmas)
}

const DOUBTS: [Doubt; 4] = [Doubt::OtherTrials, Doubt::Neighbours, Doubt::Residual, Doubt::Sigma];

fn columns(results: &ReviewedResults, queue: &[DoubtfulReading]) -> Vec<Column> {
    let frames =
        |of: fn(&DoubtfulReading) -> usize| queue.iter().map(|one| of(one) as u32).collect::<Vec<_>>();
    let name = |one: &DoubtfulReading| results.recordings[one.recording].name.clone();
    let status = |one: &DoubtfulReading| one.lost.map_or("ok", |lost| lost.as_str()).to_owned();
    let mut columns = vec![
        column("recording", queue.iter().map(name).collect::<Vec<_>>()),
        column("body", frames(|one| one.body)),
        column("frame", frames(|one| one.frame)),
        column("t_s", queue.iter().map(|one| results.time_s(one)).collect::<Vec<_>>()),
        column("doubt", queue.iter().map(|one| one.doubt).collect::<Vec<_>>()),
    ];
    for doubt in DOUBTS {
        let values: Vec<Option<f64>> = queue.iter().map(|one| of_doubt(one, doubt)).collect();
        columns.push(column(&format!("doubt_{}", doubt.as_str()), values));
    }
    columns.push(column("status", queue.iter().map(status).collect::<Vec<_>>()));
    columns.push(column("first_frame", frames(|one| one.stretch[0])));
    columns.push(column("last_frame", frames(|one| one.stretch[1])));
    columns
}

fn as_json(results: &ReviewedResults, one: &DoubtfulReading) -> Value {
    let mut value = json!({
        "recording": results.recordings[one.recording].name, "body": one.body, "frame": one.frame,
        "t_s": results.time_s(one), "doubt": one.doubt, "status": one.lost.map_or("ok", |lost| lost.as_str()),
        "first_frame": one.stretch[0], "last_frame": one.stretch[1], "reasons": reasons(one),
    });
    for doubt in DOUBTS {
        value[format!("doubt_{}", doubt.as_str())] = json!(of_doubt(one, doubt));
    }
    value
}

fn in_words(results: &ReviewedResults, queue: &[DoubtfulReading], n_readings: usize, out: Option<&Path>) {
    say!("{:<28}{:>5}{:>7}{:>9}  why", "recording", "body", "frame", "doubt");
    for one in queue.iter().take(ON_SCREEN) {
        let name = &results.recordings[one.recording].name;
        say!("{name:<28}{:>5}{:>7}{:>9.1}  {}", one.body, one.frame, one.doubt, reasons(one));
    }
    say!("{n_readings} readings, the {} most doubtful first", queue.len().min(ON_SCREEN));
    if let Some(out) = out {
        say!("wrote {}: {} readings", out.display(), queue.len());
    }
}
