//! `chainwave watch`: each shot looked at as soon as it is saved, so that it can be repeated while the chain still stands.

mod saved;
mod views;

use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use chainwave_camera::{CameraError, OpenOptions};
use chainwave_correlation::Method;
use chainwave_experiment::{LookedAt, Setup, Shot};
use chainwave_measurement::{Recording, Region};
use serde_json::{Value, json};

use self::saved::Folder;
use self::views::Views;
use crate::cli;
use crate::error::Error;
use crate::interrupt;
use crate::outcome::Outcome;
use crate::parallel::threads;
use crate::terminal::{complain, is_json};

/// Longest sleep without looking whether the user asked to stop.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Looks at every recording of a folder, those that are there and those that come, until Ctrl-C.
pub(crate) fn watch(arguments: &cli::Watch) -> Result<Outcome, Error> {
    if !(0.01..=3600.0).contains(&arguments.every) {
        return Err(Error::Argument(format!("--every: expected 0.01 to 3600 s, found {}", arguments.every)));
    }
    let setup = arguments.experiment.as_deref().map(|path| Setup::read(path, Some(&arguments.folder)));
    let setup = setup.transpose()?;
    let options = match &setup {
        Some(setup) => setup.open_options(),
        None => arguments.reading.options(arguments.frame_rate.rate_hz),
    };
    let mut folder = Folder::of(&arguments.folder)?;
    let listed = setup.iter().flat_map(|setup| &setup.trials).map(|trial| trial.view);
    let views = Views::behind(listed.max().unwrap_or(0));
    let mut watching = Watching { arguments, setup, options, views, looked_at: Vec::new() };
    // A folder on another machine may be gone for a while.
    let mut is_gone = false;
    while !interrupt::is_asked() {
        let saved = folder.newly_saved();
        match (&saved, is_gone) {
            (Err(why), false) => complain(format!("{why}; looked for again every {} s", arguments.every)),
            (Ok(_), true) => complain(format!("{}: it is there again", arguments.folder.display())),
            _ => {}
        }
        is_gone = saved.is_err();
        for path in saved.unwrap_or_default() {
            if interrupt::is_asked() {
                break;
            }
            if !watching.look_at(&path, &mut folder) {
                // Whoever read the lines has gone.
                return Ok(Outcome::default());
            }
        }
        sleep(Duration::from_secs_f64(arguments.every));
    }
    Ok(Outcome::default())
}

/// Sleeps, unless the user asks to stop.
fn sleep(duration: Duration) {
    let until = Instant::now() + duration;
    while !interrupt::is_asked() {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return;
        }
        std::thread::sleep(left.min(POLL_INTERVAL));
    }
}

struct Watching<'a> {
    arguments: &'a cli::Watch,
    setup: Option<Setup>,
    options: OpenOptions,
    views: Views,
    looked_at: Vec<LookedAt>,
}

impl Watching<'_> {
    /// Looks at a file that has stood still, and says what is found; whether anybody still reads.
    fn look_at(&mut self, path: &Path, folder: &mut Folder) -> bool {
        let begin = Instant::now();
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let recording = match whole(path, &self.options) {
            Ok(Some(recording)) => recording,
            Ok(None) => {
                folder.has_settled(path);
                return true;
            }
            // It may still grow after a pause; it is named once it has stood still for long.
            Err(_) if !folder.has_settled(path) => return true,
            Err(error) => return self.say(&name, None, &[("broken", error)], begin),
        };
        folder.is_done(path);
        match self.judge(&name, recording.as_ref()) {
            Ok(looked_at) => {
                let findings: Vec<(&str, String)> =
                    looked_at.findings.iter().map(|finding| (finding.code, finding.text.clone())).collect();
                let seen = (looked_at.tracks.bodies.len(), recording.info().n_frames);
                // A shot that was made again under the same name takes the place of the one before.
                self.looked_at.retain(|one| one.recording != looked_at.recording);
                self.looked_at.push(looked_at);
                self.say(&name, Some(seen), &findings, begin)
            }
            Err(error) => self.say(&name, None, &[("broken", error.to_string())], begin),
        }
    }

    fn judge(&mut self, name: &str, recording: &dyn Recording) -> Result<LookedAt, Error> {
        let setup = self.setup.as_ref();
        let trial = setup.and_then(|setup| setup.trials.iter().find(|trial| trial.recording == name));
        let bodies = match (setup, trial) {
            (Some(setup), Some(trial)) => {
                let view = chainwave_experiment::planned_view(setup, trial)?;
                let number =
                    |subset: chainwave_measurement::Subset| Some((subset.name.parse().ok()?, subset));
                Some(view.subsets.into_iter().filter_map(number).collect())
            }
            _ => None,
        };
        let shot = Shot {
            recording: name,
            view: trial.map_or_else(|| self.views.of_name(name), |trial| trial.view),
            bodies,
            rest_until_s: setup.map(|setup| setup.experiment.tracking.rest_until_s),
            strike_scatter: setup.map(|setup| setup.experiment.drive_scatter()),
            method: setup.map_or_else(Method::default, Setup::method),
        };
        let earlier: Vec<LookedAt> =
            self.looked_at.iter().filter(|one| one.recording != name).cloned().collect();
        Ok(shot.look_at(recording, &earlier, threads(self.arguments.jobs))?)
    }

    /// Prints the line of a shot: how many bodies in how many frames, and what is wrong; whether anybody reads it.
    fn say(
        &self,
        name: &str,
        seen: Option<(usize, usize)>,
        findings: &[(&str, String)],
        begin: Instant,
    ) -> bool {
        let (n_bodies, n_frames) = seen.unzip();
        let told = |(code, text): &(&str, String)| json!({ "code": code, "text": text });
        let line = match is_json() {
            true => json!({
                "recording": name, "ok": findings.is_empty(), "n_bodies": n_bodies, "n_frames": n_frames,
                "findings": findings.iter().map(told).collect::<Vec<Value>>(),
                "seconds": begin.elapsed().as_secs_f64(),
            })
            .to_string(),
            false if findings.is_empty() => {
                let (bodies, frames) = seen.unwrap_or_default();
                format!("{name}: ok, {bodies} bodies in {frames} frames")
            }
            false => {
                let texts: Vec<String> = findings
                    .iter()
                    .map(|(code, text)| format!("{}: {text}", code.replace('_', " ")))
                    .collect();
                format!("{name}: LOOK: {}", texts.join("; "))
            }
        };
        let mut out = std::io::stdout().lock();
        writeln!(out, "{line}").and_then(|()| out.flush()).is_ok()
    }
}

/// A recording that opens and whose last frame is there; none where a file is no recording, or a single image.
fn whole(path: &Path, options: &OpenOptions) -> Result<Option<Box<dyn Recording>>, String> {
    let recording = match chainwave_camera::open_with(path, options) {
        Ok(recording) => recording,
        Err(CameraError::UnknownFormat { .. }) => return Ok(None),
        // A folder that holds something else than images.
        Err(_) if path.is_dir() => return Ok(None),
        Err(error) => return Err(error.to_string()),
    };
    let info = recording.info();
    if info.n_frames < 2 {
        return Ok(None);
    }
    let corner = Region { x: info.width_px - 1, y: info.height_px - 1, width: 1, height: 1 };
    recording.read_region(info.n_frames - 1, corner, &mut [0.0]).map_err(|error| error.to_string())?;
    Ok(Some(recording))
}
