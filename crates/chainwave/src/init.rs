//! `chainwave init`: a first `experiment.toml` and `trials.csv` for a folder of recordings, with what the pictures tell filled in.

pub(crate) mod draft;
mod seen;

use std::collections::BTreeMap;
use std::path::Path;

use chainwave_camera::OpenOptions;
use chainwave_measurement::median;

use self::draft::{Draft, file_name, first_lines, trials_table};
pub(crate) use self::seen::SeenInRecording;
use crate::cli::Init;
use crate::digits::counted;
use crate::error::Error;
use crate::listing::recordings_in;
use crate::outcome::Outcome;
use crate::output::write_text;
use crate::terminal::say;

/// Writes both files beside the recordings, with what the recordings say filled in and the rest marked. Nothing is
/// overwritten.
pub(crate) fn init(arguments: &Init) -> Result<Outcome, Error> {
    let mut outcome = Outcome::default();
    let folder = &arguments.folder;
    let (experiment_path, trials_path) = (folder.join("experiment.toml"), folder.join("trials.csv"));
    for path in [&experiment_path, &trials_path] {
        if path.exists() {
            return Err(Error::Argument(format!(
                "{}: is there already, and init overwrites nothing (hint: `chainwave check` says what it still lacks; move it away to begin anew)",
                path.display()
            )));
        }
    }
    let (listed, failed) = recordings_in(folder, &OpenOptions::default())?;
    failed.into_iter().for_each(|error| outcome.fail(error));
    let names: Vec<String> = listed.iter().map(|(path, _)| file_name(path)).collect();
    let Some((first, info)) = listed.first() else {
        return Err(without_recordings(folder));
    };
    let seen = SeenInRecording::of(first);
    let known = BTreeMap::new();
    let draft = Draft {
        name: file_name(folder),
        info,
        known: &known,
        pictures: first_lines(info, seen.as_ref().ok()),
    };
    write_text(&trials_path, &trials_table(&names, None))?;
    write_text(&experiment_path, &draft.text())?;
    let n_recordings = counted(names.len(), "recording");
    say!("{n_recordings}; wrote {} and {}", experiment_path.display(), trials_path.display());
    match &seen {
        Ok(seen) => {
            let stem = folder.join("markers");
            seen.draw(first, &stem)?;
            say!(
                "{}; they are drawn in {}",
                in_words(&file_name(first), seen),
                stem.with_extension("png").display()
            );
        }
        Err(why) => say!(
            "no markers were found by themselves ({why}); `chainwave view {}` shows the pictures",
            first.display()
        ),
    }
    say!("next: fill in every FILL_IN of both files, then chainwave check {}", experiment_path.display());
    Ok(outcome)
}

/// Why there is nothing to begin with: a folder of images is itself a recording, and what else there is cannot be read.
fn without_recordings(folder: &Path) -> Error {
    let found = match chainwave_camera::open(folder) {
        Ok(recording) => {
            let n_images = counted(recording.info().n_frames, "image");
            format!(
                "found one recording of {n_images}, which is the folder itself (hint: name the folder above it)"
            )
        }
        Err(_) => {
            format!(
                "found none that can be read (readable formats: {})",
                chainwave_camera::format_names().join("; ")
            )
        }
    };
    Error::Argument(format!("{}: expected recordings in the folder, {found}", folder.display()))
}

/// What was found, in a sentence.
fn in_words(recording: &str, seen: &SeenInRecording) -> String {
    let n = seen.row.markers.len();
    let pitch = seen
        .row
        .pitch_px
        .map_or_else(String::new, |pitch| format!(", {:.2} +- {:.2} px apart", pitch.value, pitch.sigma));
    let sigmas: Vec<f64> =
        seen.row.markers.iter().filter_map(|marker| Some(marker.sigma_px.as_ref().ok()?[0])).collect();
    let sigma =
        median(sigmas).map_or_else(String::new, |sigma_px| format!(", each read to {sigma_px:.4} px or so"));
    format!("{recording} shows {}{pitch}{sigma}", counted(n, "marker"))
}
