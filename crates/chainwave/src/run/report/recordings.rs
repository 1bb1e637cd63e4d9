//! The report on recordings: what became of each, and how well it was read.

use chainwave_experiment::{Evaluation, RecordingAlignment, RecordingState, Results, TrackedRecording};
use chainwave_measurement::median;
use chainwave_stitching::Alignment;

use super::markup::{Cell, escaped, table};

/// Every recording of the trials table.
pub(super) fn section(results: &Results, states: &[RecordingState]) -> String {
    let Results { tracked, evaluation, .. } = results;
    let row = |state: &RecordingState| {
        let name = &state.recording;
        let quality = tracked.recordings.iter().find(|one| one.trial.recording == *name).map(Quality::of);
        let of = |number: &dyn Fn(&Quality) -> Option<String>| {
            Cell::Number(quality.as_ref().and_then(number).unwrap_or_default())
        };
        let alignment = alignment_of(evaluation, name);
        let of_alignment = |number: &dyn Fn(&Alignment, &RecordingAlignment) -> String| {
            Cell::Number(
                alignment.map_or_else(String::new, |(without_model, used)| number(without_model, used)),
            )
        };
        vec![
            Cell::text(name),
            Cell::Number(state.view.to_string()),
            Cell::Number(state.trial.to_string()),
            Cell::text(&state.state.as_str().replace('_', " ")),
            of(&|quality| Some(quality.n_frames.to_string())),
            of(&|quality| Some(quality.n_bodies.to_string())),
            of(&|quality| Some(format!("{:.2}", quality.lost_percent))),
            of(&|quality| quality.sigma_px.map(|sigma_px| format!("{sigma_px:.4}"))),
            of_alignment(&|_, used| {
                let offset = used.trigger_offset_s.scaled(1e6);
                format!("{:+.2} ± {:.2}", offset.value, offset.sigma)
            }),
            of_alignment(&|_, used| match used.drive_deviation.map(|drive| drive.scaled(100.0)) {
                Some(drive) => format!("{:+.3} ± {:.3}", drive.value, drive.sigma),
                None => "refused".into(),
            }),
            of_alignment(&|without_model, _| format!("{:.2}", without_model.scatter_ratio)),
        ]
    };
    let heads = [
        "recording",
        "view",
        "trial",
        "state",
        "frames",
        "bodies",
        "readings lost (%)",
        "median σ (px)",
        "trigger offset (µs)",
        "drive (%)",
        "residuals over stated noise",
    ];
    format!(
        "<h2>Recordings</h2><p>Trigger offsets and drives are taken from {}; ± is one standard uncertainty.</p>{}",
        escaped(evaluation.recording_alignments.source),
        table(&heads, states.iter().map(row))
    )
}

/// How well a recording was read.
struct Quality {
    n_frames: usize,
    n_bodies: usize,
    lost_percent: f64,
    /// Of the readings along x that hold.
    sigma_px: Option<f64>,
}

impl Quality {
    fn of(recording: &TrackedRecording) -> Self {
        let bodies = &recording.tracks.bodies;
        let readings = || bodies.iter().flat_map(|body| &body.positions);
        let sigmas: Vec<f64> = readings().flatten().map(|found| found.x_px.sigma).collect();
        let n = readings().count();
        Self {
            n_frames: recording.tracks.times_s.len(),
            n_bodies: bodies.len(),
            lost_percent: 100.0 * (n - sigmas.len()) as f64 / n.max(1) as f64,
            sigma_px: median(sigmas),
        }
    }
}

/// A recording's alignment without the model, and the one that is used.
fn alignment_of<'a>(
    evaluation: &'a Evaluation,
    recording: &str,
) -> Option<(&'a Alignment, &'a RecordingAlignment)> {
    let mut alignments =
        evaluation.stitched.alignments.iter().zip(&evaluation.recording_alignments.of_recordings);
    alignments.find(|(alignment, _)| alignment.recording == recording)
}
