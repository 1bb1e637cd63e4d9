//! Where each recording stands among the others: its trigger and its drive.

use chainwave_analysis::Rule;
use chainwave_inference::{FittedRecording, TrackFit};
use chainwave_measurement::Estimate;
use chainwave_stitching::Alignment;

/// Where a recording stands among the others.
#[derive(Debug, Clone)]
pub struct RecordingAlignment {
    /// Name of the recording.
    pub recording: String,
    /// Its trigger's lead over the mean trigger, in seconds.
    pub trigger_offset_s: Estimate,
    /// Its drive relative to the mean drive, less one; none where two strikers drive the chain.
    pub drive_deviation: Option<Estimate>,
}

/// Trigger and drive of all recordings.
pub struct RecordingAlignments {
    /// Whence they come.
    pub source: &'static str,
    /// One for each recording, in the order of the alignments.
    pub of_recordings: Vec<RecordingAlignment>,
}

impl RecordingAlignments {
    /// By which rule the source is chosen.
    pub fn rule() -> Rule {
        Rule {
            question: "what trigger offsets and drives are taken from",
            text: "the chain model's impacts and strikers while it explains the tracks (with what they ask for beyond the stated model), else \
                   the first body's onset, which needs no model: to the rest of the motion an earlier trigger and a drive that delays every \
                   body look alike"
                .into(),
            level: None,
            rates: Vec::new(),
        }
    }

    /// From the model where the data accept it, else, and for recordings that the wave does not reach, from the alignment without one. Of a
    /// chain that is struck at both ends drives are refused: a recording has two then, and what one number follows is either, as its view
    /// has it.
    pub(crate) fn of(alignments: &[Alignment], accepted: Option<&TrackFit>, is_struck_twice: bool) -> Self {
        let fitted = |alignment: &Alignment| {
            accepted.iter().flat_map(|fit| &fit.recordings).find(|one| one.recording == alignment.recording)
        };
        let of_recording = |alignment: &Alignment| match fitted(alignment) {
            Some(fitted) => by_model(fitted),
            None => by_onset(alignment, is_struck_twice),
        };
        let source = if accepted.is_some() {
            "the chain model's impacts and strikers"
        } else {
            "the first body's onset"
        };
        Self { source, of_recordings: alignments.iter().map(of_recording).collect() }
    }
}

fn by_model(fitted: &FittedRecording) -> RecordingAlignment {
    RecordingAlignment {
        recording: fitted.recording.clone(),
        trigger_offset_s: fitted.trigger_offset_s,
        drive_deviation: Some(fitted.drive_deviation),
    }
}

fn by_onset(alignment: &Alignment, is_struck_twice: bool) -> RecordingAlignment {
    RecordingAlignment {
        recording: alignment.recording.clone(),
        trigger_offset_s: alignment.trigger_offset_s,
        drive_deviation: (!is_struck_twice).then_some(alignment.drive_deviation),
    }
}
