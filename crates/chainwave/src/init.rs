//! `chainwave init`: a first `experiment.toml` and `trials.csv` for a folder of recordings.

use std::path::{Path, PathBuf};

use chainwave_camera::OpenOptions;
use chainwave_measurement::RecordingInfo;

use crate::cli::Init;
use crate::error::Error;
use crate::listing::recordings_in;
use crate::outcome::Outcome;
use crate::output::write_text;

/// Writes both files beside the recordings, with what the recordings say filled in and the rest marked. Nothing is
/// overwritten.
#[expect(clippy::print_stdout, reason = "the next steps are the command's result")]
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
    let Some((_, info)) = found.first() else {
        return Err(Error::Argument(format!(
            "{}: expected recordings, found none that can be read",
            folder.display()
        )));
    };
    write_text(&trials_path, &trials_table(&found))?;
    write_text(&experiment_path, &experiment_text(folder, info))?;
    println!("{} recordings; wrote {} and {}", found.len(), experiment_path.display(), trials_path.display());
    println!(
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

fn experiment_text(folder: &Path, info: &RecordingInfo) -> String {
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
scale_px_per_m = FILL_IN          # pixels between neighbours over the pitch
first_body_px = [FILL_IN, {row:.0}]   # column and row of body 1's marker at rest, with the stage at 0

[tracking]
half_width_px = 16                # the subset is 33 x 33 px: the speckled part of a marker
half_height_px = 16
rest_until_s = -1e-4              # frames before this time (after the trigger) show the chain at rest
",
        format = info.format,
        width = info.width_px,
        height = info.height_px,
        bits = info.bit_depth,
        n = info.n_frames,
        row = (info.height_px as f64 - 1.0) / 2.0,
    )
}
