//! When the images of a series were taken: by the caller's rate, by a Photron header beside them, or counted in frames.

use std::path::{Path, PathBuf};

use super::numbering::Numbering;
use crate::error::CameraError;
use crate::mraw::{Sidecar, sidecar};
use crate::options::OpenOptions;
use crate::timing::Timing;

/// Times of a series, and what its header says of the shot.
pub(super) struct Schedule {
    pub(super) timing: Timing,
    pub(super) first_image: i64,
    pub(super) camera: Option<String>,
    pub(super) exposure_s: Option<f64>,
    pub(super) warnings: Vec<String>,
}

impl Schedule {
    /// The schedule of `files`, the images at `path`, which is their folder or a single one.
    ///
    /// # Errors
    /// [`CameraError`] where a header beside the images says that they were filmed in colour.
    pub(super) fn of(
        path: &Path,
        files: &[PathBuf],
        numbering: &Numbering,
        options: &OpenOptions,
    ) -> Result<Self, CameraError> {
        let steps = &numbering.steps[..files.len()];
        let found = if path.is_dir() { sidecar(path, &files[0])? } else { Ok(None) };
        let mut schedule = Self {
            timing: Timing::of(steps.iter().copied(), options, None),
            first_image: numbering.first,
            camera: None,
            exposure_s: None,
            warnings: found.as_ref().err().cloned().into_iter().collect(),
        };
        if let Ok(Some(sidecar)) = found {
            schedule.follow(&sidecar, steps, numbering.spacing, options.rate_hz);
            schedule.exposure_s = sidecar.shot.exposure_s;
            schedule.warnings.extend(sidecar.shot.exposure_remark);
            schedule.camera = sidecar.shot.camera;
        }
        Ok(schedule)
    }

    /// Takes the rate of the header, unless the caller knows it better, and its trigger where the series is the whole of what was saved.
    fn follow(&mut self, sidecar: &Sidecar, steps: &[u64], spacing: u64, caller_hz: Option<f64>) {
        let Sidecar { name, shot } = sidecar;
        let Some(step) = recorded_frames(shot.step, spacing) else {
            self.warnings.push(format!(
                "{name} beside the images says that one frame in {} was saved, but the images' numbers advance by {spacing}: no \
                 rate is taken from it, and no trigger",
                shot.step
            ));
            return;
        };
        if step != shot.step {
            self.warnings.push(format!(
                "{name} beside the images says that each frame was saved, but the images' numbers advance by {spacing}: one \
                 frame in {spacing} is taken to be there"
            ));
        }
        let record_hz = caller_hz.map_or(shot.record_hz, |rate_hz| rate_hz * step as f64);
        let rate_hz = caller_hz.unwrap_or(shot.record_hz / step as f64);
        let n_spanned = steps.last().map_or(0, |last| last.saturating_add(1));
        let is_whole = shot.n_saved == Some(n_spanned);
        let first = if is_whole { shot.start_frame - shot.trigger_frame } else { 0 };
        let zero = if is_whole { "the trigger that it states" } else { "the first image" };
        // Recorded frames are counted, so that times keep their digits.
        let frame = |&taken: &u64| first as f64 + taken as f64 * step as f64;
        self.timing = Timing {
            rate_hz: Some(rate_hz),
            times_s: steps.iter().map(|taken| frame(taken) / record_hz).collect(),
            warning: match caller_hz {
                None => format!(
                    "the images hold no time stamps: times are computed at {rate_hz} Hz, the rate of {name} beside them; t = 0 is {zero}"
                ),
                Some(_) => format!(
                    "the images hold no time stamps: times are computed at {rate_hz} Hz, as given, and not at the {} Hz of {name} beside \
                     them; t = 0 is {zero}",
                    shot.record_hz / step as f64
                ),
            },
        };
        if is_whole {
            self.first_image = first;
        }
    }
}

/// Recorded frames from one image to the next, of which the header says that one in `step` was saved and whose numbers advance by
/// `spacing`; `None` where the two contradict each other. Programs number either what they save or what was recorded.
fn recorded_frames(step: u64, spacing: u64) -> Option<u64> {
    match (step, spacing) {
        (step, 1) => Some(step),
        (1, spacing) => Some(spacing),
        (step, spacing) => (step == spacing).then_some(step),
    }
}
