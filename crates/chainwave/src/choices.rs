//! What `track` and `correlate` chose by themselves: said with their closing line, and written beside their table.

use std::path::{Path, PathBuf};

use chainwave_correlation::Method;
use chainwave_experiment::USUAL_ERROR_PX;
use serde::Serialize;

use crate::error::Error;
use crate::output::write_text;

/// Why a field has its step, where its half size was given.
pub(crate) const BY_HALF_SIZE: &str = "the step that goes with the half size";

/// The choices of one run.
#[derive(Serialize)]
pub(crate) struct Choices {
    program: &'static str,
    version: &'static str,
    /// The error that was aimed at.
    error_px: f64,
    /// Methods that were chosen for it, each with its recording.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    method: Vec<ChosenMethod>,
    /// Sizes of subsets that were chosen.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    subset: Vec<ChosenSize>,
}

/// A method that was chosen.
#[derive(Serialize)]
struct ChosenMethod {
    recording: String,
    method: String,
}

/// A size that was chosen.
#[derive(Serialize)]
pub(crate) struct ChosenSize {
    pub(crate) recording: String,
    /// The point; `field` for all of a field's.
    pub(crate) point: String,
    pub(crate) half_width_px: usize,
    pub(crate) half_height_px: usize,
    /// Of a field, from one point to the next.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) step_px: Option<usize>,
    /// What noise leaves, along the worse axis; none without texture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) noise_px: Option<f64>,
    /// What settled it.
    pub(crate) reason: String,
}

impl Choices {
    /// None yet, with the error that is aimed at.
    pub(crate) fn new(accuracy_px: Option<f64>) -> Self {
        Self {
            program: "chainwave",
            version: env!("CARGO_PKG_VERSION"),
            error_px: accuracy_px.unwrap_or(USUAL_ERROR_PX),
            method: Vec::new(),
            subset: Vec::new(),
        }
    }

    /// Adds the method that an accuracy led to in a recording.
    pub(crate) fn add_method(&mut self, recording: &Path, method: Method) {
        self.method.push(ChosenMethod { recording: file_name(recording), method: method.to_string() });
    }

    /// Adds sizes.
    pub(crate) fn add_sizes(&mut self, sizes: impl IntoIterator<Item = ChosenSize>) {
        self.subset.extend(sizes);
    }

    /// What is said of them, a line for each kind.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let mut methods: Vec<&str> = self.method.iter().map(|one| one.method.as_str()).collect();
        methods.dedup();
        if !methods.is_empty() {
            lines.push(format!("chosen for an error of {} px: {}", self.error_px, methods.join(", ")));
        }
        let mut reasons: Vec<&str> = self.subset.iter().map(|one| one.reason.as_str()).collect();
        reasons.sort_unstable();
        reasons.dedup();
        lines.extend(reasons.into_iter().map(|reason| self.line_of(reason)));
        lines
    }

    /// The sizes that were chosen for one reason.
    fn line_of(&self, reason: &str) -> String {
        let of_reason = || self.subset.iter().filter(|one| one.reason == reason);
        let range = |value: fn(&ChosenSize) -> usize| {
            let (least, most) = (of_reason().map(value).min(), of_reason().map(value).max());
            match (least, most) {
                (Some(least), Some(most)) if least < most => format!("{least}..{most}"),
                (least, _) => least.unwrap_or(0).to_string(),
            }
        };
        let (half_width, half_height) = (range(|one| one.half_width_px), range(|one| one.half_height_px));
        let step = of_reason().find_map(|one| one.step_px);
        if let Some(step) = step.filter(|_| reason == BY_HALF_SIZE) {
            return format!("chosen: step {step} px ({reason} of {half_width} px)");
        }
        let mut line = match step {
            Some(step) => format!("chosen: half size {half_width} px, step {step} px"),
            None => format!("chosen: half size {half_width} x {half_height} px of {}", self.points(reason)),
        };
        let worst_px = of_reason().filter_map(|one| one.noise_px).fold(0.0, f64::max);
        let missed = if worst_px > self.error_px {
            format!(", not reached: {} px", two_digits(worst_px))
        } else {
            String::new()
        };
        line.push_str(&format!(" ({reason}; aimed at {} px{missed})", self.error_px));
        line
    }

    /// The points of one reason: up to three by name.
    fn points(&self, reason: &str) -> String {
        let names: Vec<&str> =
            self.subset.iter().filter(|one| one.reason == reason).map(|one| one.point.as_str()).collect();
        match names.as_slice() {
            [] | [_] | [_, _] | [_, _, _] => names.join(", "),
            all => format!("{} points", all.len()),
        }
    }

    /// Writes them beside a table, where anything was chosen: `tracks.csv` has `tracks.provenance.toml`. It holds no time and no folder, so
    /// equal inputs give equal bytes.
    pub(crate) fn write_beside(&self, table: &Path) -> Result<(), Error> {
        if self.method.is_empty() && self.subset.is_empty() {
            return Ok(());
        }
        let text = toml::to_string(self).map_err(|wrong| Error::Argument(wrong.to_string()))?;
        write_text(&Self::path_beside(table), &text)
    }

    /// Where what was chosen for a table is written.
    pub(crate) fn path_beside(table: &Path) -> PathBuf {
        table.with_extension("provenance.toml")
    }
}

/// A positive number in two digits.
fn two_digits(value: f64) -> String {
    let n_decimals = (1.0 - value.log10().floor()).max(0.0) as usize;
    format!("{value:.n_decimals$}")
}

/// The name of a recording without its folder.
pub(crate) fn file_name(recording: &Path) -> String {
    recording.file_name().unwrap_or(recording.as_os_str()).to_string_lossy().into_owned()
}
