//! What merging yields: the motion, and where each recording stands.

use std::fmt;

use chainwave_measurement::{ChainMotion, Estimate};

use crate::by_view::LeftByView;
use crate::clocks::ClockShown;
use crate::shown::ShownByBody;
use crate::spread::Spread;
use crate::untied::UntiedGroup;

/// Where one recording stands among the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// Name of the recording.
    pub recording: String,
    /// Number of the camera view.
    pub view: u32,
    /// Number of the trial in that view.
    pub trial: u32,
    /// Its trigger's lead over the mean trigger, in seconds: motion time = stamp - offset.
    pub trigger_offset_s: Estimate,
    /// Its drive relative to the mean drive, less one.
    pub drive_deviation: Estimate,
    /// Residuals' rms over what the trackers' sigma lets expect; near 1 when both are right.
    pub scatter_ratio: f64,
}

/// The chain's motion and how it was put together.
#[derive(Debug, Clone, PartialEq)]
pub struct Stitched {
    /// The motion at the mean drive and the mean trigger of all recordings.
    pub motion: ChainMotion,
    /// One entry for each recording, in the order given.
    pub alignments: Vec<Alignment>,
    /// Relative standard uncertainty of the scale that all drive deviations share, a part of each one's; `None` where no onset tells it.
    pub drive_scale_sigma: Option<f64>,
    /// What scatters within a trial, and what from trial to trial.
    pub spread: Spread,
    /// Rounds of the alignment until it settled, or was given up.
    pub rounds: usize,
    /// What still moved when the alignment was given up; `None` where it settled. The errors of the motion hold it.
    pub unsettled: Option<Unsettled>,
    /// Whether no smooth response to the drive tells how trials differ, so that they are averaged by their triggers.
    pub by_trigger: bool,
    /// What bodies show of the errors that were asked for.
    pub shown: Vec<ShownByBody>,
    /// What the readings say of clocks, where that was asked for.
    pub clocks: Vec<ClockShown>,
    /// Groups of recordings that share no body with the others; none where bodies tie all.
    pub untied: Vec<UntiedGroup>,
    /// What each view of a body that more than one saw leaves of the motion.
    pub left_by_views: Vec<LeftByView>,
    /// What the reader should know, such as a view that shares no body with the others.
    pub warnings: Vec<String>,
}

/// An alignment that was given up before it settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unsettled {
    /// What had not settled.
    pub phase: AlignmentPhase,
    /// Rounds after which it was given up.
    pub rounds: usize,
    /// Largest change of a trigger offset in the last round, in seconds.
    pub offset_change_s: f64,
    /// Largest change of a drive deviation in the last round.
    pub drive_change: f64,
}

/// A phase of the alignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum AlignmentPhase {
    /// Drives and offsets as the readings have them.
    Readings,
    /// What the readings leave open, from the onset of the first body.
    Onset,
}

/// An alignment that still moves triggers by more than this share of a frame in its last round goes nowhere.
const ADRIFT: f64 = 0.1;

impl Unsettled {
    /// Whether it still moved triggers by a good part of a frame when it was given up: what it leaves over are its own errors then, which may have
    /// the shape of anything, so that nothing else is to be told by it.
    pub fn is_adrift(&self, frame_interval_s: f64) -> bool {
        self.offset_change_s > ADRIFT * frame_interval_s
    }
}

impl fmt::Display for Unsettled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.phase {
            AlignmentPhase::Readings => "of trials",
            AlignmentPhase::Onset => "of trials by the first body's onset",
        };
        write!(
            f,
            "the alignment {what} had not settled after {} round{}: the last one moved triggers by up to {:.1e} us and drives by up to \
             {:.1e} %",
            self.rounds,
            if self.rounds == 1 { "" } else { "s" },
            1e6 * self.offset_change_s,
            100.0 * self.drive_change
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_by_a_part_of_a_frame_is_adrift_and_what_creeps_is_not() {
        let frame_interval_s = 4e-5;
        let moving = |offset_change_s: f64| {
            let unsettled =
                Unsettled { phase: AlignmentPhase::Readings, rounds: 50, offset_change_s, drive_change: 0.0 };
            unsettled.is_adrift(frame_interval_s)
        };
        assert!(moving(frame_interval_s) && moving(5e-6));
        assert!(!moving(3e-6) && !moving(0.0));
    }
}
