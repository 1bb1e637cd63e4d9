//! `chainwave init`: a first `experiment.toml` and `trials.csv` for a folder of recordings, with what the pictures tell filled in.

mod seen;

use std::path::{Path, PathBuf};

use chainwave_camera::OpenOptions;
use chainwave_measurement::{RecordingInfo, median};

use self::seen::Seen;
use crate::cli::Init;
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
                "{}: is there already, and init overwrites nothing",
                path.display()
            )));
        }
    }
    let (listed, failed) = recordings_in(folder, &OpenOptions::default())?;
    failed.into_iter().for_each(|error| outcome.fail(error));
    let name_of = |path: PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let found: Vec<(String, RecordingInfo)> =
        listed.into_iter().map(|(path, info)| (name_of(path), info)).collect();
    let Some((name, info)) = found.first() else {
        return Err(Error::Argument(format!(
            "{}: expected recordings, found none that can be read",
            folder.display()
        )));
    };
    let first = folder.join(name);
    let seen = Seen::of(&first);
    write_text(&trials_path, &trials_table(&found))?;
    write_text(&experiment_path, &experiment_text(folder, info, seen.as_ref().ok()))?;
    say!("{} recordings; wrote {} and {}", found.len(), experiment_path.display(), trials_path.display());
    match &seen {
        Ok(seen) => {
            let stem = folder.join("markers");
            seen.draw(&first, &stem)?;
            say!("{}; they are drawn in {}", in_words(name, seen), stem.with_extension("png").display());
        }
        Err(why) => say!(
            "no markers were found by themselves ({why}); `chainwave view {}` shows the pictures",
            first.display()
        ),
    }
    say!(
        "next: fill in every FILL_IN of both files, then chainwave run {} --out RESULTS",
        experiment_path.display()
    );
    Ok(outcome)
}

/// One row a recording; view and trial are the last two numbers of its name, where it has two.
fn trials_table(found: &[(String, RecordingInfo)]) -> String {
    let mut text = String::from("recording,view,trial,stage_m\n");
    for (name, _) in found {
        let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy();
        let numbers: Vec<u64> =
            stem.split(|c: char| !c.is_ascii_digit()).filter_map(|digits| digits.parse().ok()).collect();
        let (view, trial) = match numbers.as_slice() {
            [.., view, trial] => (view.to_string(), trial.to_string()),
            _ => ("FILL_IN".to_owned(), "FILL_IN".to_owned()),
        };
        text.push_str(&format!("{name},{view},{trial},FILL_IN\n"));
    }
    text
}

/// What was found, in a sentence.
fn in_words(recording: &str, seen: &Seen) -> String {
    let n = seen.row.markers.len();
    let pitch = seen
        .row
        .pitch_px
        .map_or_else(String::new, |pitch| format!(", {:.2} +- {:.2} px apart", pitch.value, pitch.sigma));
    let sigmas: Vec<f64> =
        seen.row.markers.iter().filter_map(|marker| Some(marker.sigma_px.as_ref().ok()?[0])).collect();
    let sigma =
        median(sigmas).map_or_else(String::new, |sigma_px| format!(", each read to {sigma_px:.4} px or so"));
    format!("{recording} shows {n} markers{pitch}{sigma}")
}

/// What `experiment.toml` says of the pictures, in the form of its lines.
struct Lines {
    scale: String,
    first_body: String,
    subset: String,
    rest: String,
}

impl Lines {
    fn of(info: &RecordingInfo, seen: Option<&Seen>) -> Self {
        let middle = (info.height_px as f64 - 1.0) / 2.0;
        let asked = Self {
            scale: "FILL_IN          # pixels between neighbours over the pitch".into(),
            first_body: format!("[FILL_IN, {middle:.0}]   # column and row of body 1's marker at rest, with the stage at 0"),
            subset: "half_width_px = 16                # the subset is 33 x 33 px: the speckled part of a marker\nhalf_height_px = 16"
                .into(),
            rest: "-1e-4              # frames before this time (after the trigger) show the chain at rest".into(),
        };
        let Some((seen, first)) = seen.and_then(|seen| Some((seen, seen.row.markers.first()?))) else {
            return asked;
        };
        let subset = &first.subset;
        Self {
            scale: seen.row.pitch_px.map_or(asked.scale, |pitch| {
                format!("FILL_IN          # pixels between neighbours over the pitch: {:.2} +- {:.2} px / pitch_m", pitch.value, pitch.sigma)
            }),
            first_body: format!(
                "[{:.2}, {:.2}]   # the first marker of the first recording; right if that is body 1 and the stage stood at 0",
                subset.x_px, subset.y_px
            ),
            subset: format!(
                "half_width_px = {}                # the part of a marker that has texture, off its edge\nhalf_height_px = {}",
                subset.half_width_px, subset.half_height_px
            ),
            rest: seen.rest_until_s.map_or(asked.rest, |rest_s| {
                format!("{rest_s:.3e}        # frames before this time (after the trigger) show the chain at rest: found in the first recording")
            }),
        }
    }
}

fn experiment_text(folder: &Path, info: &RecordingInfo, seen: Option<&Seen>) -> String {
    let Lines { scale, first_body, subset, rest } = Lines::of(info, seen);
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let first_ms = 1e3 * info.times_s.first().copied().unwrap_or(0.0);
    let last_ms = 1e3 * info.times_s.last().copied().unwrap_or(0.0);
    format!(
        "# The first recording: {format}, {width} x {height} px, {bits} bit, {n} frames from {first_ms:.3} to {last_ms:.3} ms.
# FILL_IN marks what only you know. SI units.
name = {name:?}
trials = \"trials.csv\"             # recording, view, trial, stage_m (position of the stage along the chain)

[chain]
n_bodies = FILL_IN
pitch_m = FILL_IN                 # distance between neighbours at rest
mass_kg = FILL_IN                 # of one body

[striker]
mass_kg = FILL_IN
velocity_m_per_s = FILL_IN
velocity_sigma_m_per_s = FILL_IN  # from trial to trial

[contact]                         # force = a ((overlap + delta_0)^p - delta_0^p), from a compression curve
law = \"power\"
a = FILL_IN
delta_0_m = FILL_IN
p = FILL_IN

[camera]
scale_px_per_m = {scale}
first_body_px = {first_body}

[tracking]
{subset}
rest_until_s = {rest}
",
        format = info.format,
        width = info.width_px,
        height = info.height_px,
        bits = info.bit_depth,
        n = info.n_frames,
    )
}
