//! What the reader should know although nothing is wrong: what recordings had amiss that was put right or does no harm, what the alignment rests
//! on, and what there is none of.

use chainwave_inference::FitError;
use chainwave_measurement::{Estimate, Observation, median};

use crate::configuration::Experiment;
use crate::error::Error;
use crate::evaluation::lost_bodies::lost_for_good;
use crate::evaluation::recording_alignment::{RecordingAlignment, RecordingAlignments};
use crate::evaluation::unseen_bodies::unseen_for_a_while;
use crate::finding::Finding;
use crate::input::numbers::NotNegative;
use crate::tracked::TrackedRecording;
use crate::wording::{estimate, grouped, named};

/// Everything worth knowing of the recordings that were used, each with the names of those that it is about.
pub(crate) fn notices(
    experiment: &Experiment,
    recordings: &[TrackedRecording],
    observations: &[Observation],
    recording_alignments: &RecordingAlignments,
) -> Vec<Finding> {
    let of_file = |one: &TrackedRecording| {
        one.remarks.iter().map(|remark| (one.trial.recording.clone(), remark.clone())).collect::<Vec<_>>()
    };
    let remarks = grouped(&recordings.iter().flat_map(of_file).collect::<Vec<_>>());
    let remark = |(recordings, remark): (String, String)| Finding {
        code: "recording",
        subject: recordings,
        text: remark,
    };
    let remarks = remarks.into_iter().map(remark);
    let shows_again = |observation: &Observation, frame: usize| {
        let own = recordings.iter().find(|one| one.trial.recording == observation.recording);
        own.is_some_and(|one| one.shows_again(frame))
    };
    let unseen = unseen_for_a_while(observations, &shows_again);
    let lost = lost_for_good(recordings);
    let drives = unusual_drives(experiment, recording_alignments).into_iter();
    let triggers = trigger_scatter_s(experiment)
        .map_or_else(Vec::new, |scatter_s| unusual_triggers(scatter_s, &recording_alignments.of_recordings));
    remarks.chain(unseen).chain(lost).chain(drives.map(|drive| drive.warning())).chain(triggers).collect()
}

/// Says what the alignment of a chain that is driven at both ends rests on.
pub(crate) fn aligned_by_one_striker() -> Finding {
    let text = "with a [far_striker] views and trials are aligned as if what differs from strike to strike were the first striker's alone: a \
                recording has two drives, of which the alignment tells none; triggers of views that the other one moves are less certain than stated; \
                what the motion would be with drives that are alike is an error of it. The fits take the other one to be as stated, or of one other velocity, in every trial";
    Finding { code: "far_striker", subject: "the alignment".into(), text: text.into() }
}

/// Says what the alignment of a shaken chain rests on where too few recordings see the body that is shaken.
pub(crate) fn aligned_without_body_1(observations: &[Observation]) -> Option<Finding> {
    const ENOUGH: usize = 3;
    let sees = |one: &&Observation| one.bodies.iter().any(|track| track.body == 1);
    let n_seen = observations.iter().filter(sees).count();
    let text = format!(
        "body 1, whose motion is in proportion to the drive, is seen by {n_seen} recordings: views and trials are aligned as if the first body that {ENOUGH} \
         see began in proportion to it, which a wave that was dispersed on its way does not quite"
    );
    (n_seen < ENOUGH).then(|| Finding { code: "drive", subject: "the alignment".into(), text })
}

/// Says which recordings say nothing of the chain but that it rests.
pub(crate) fn before_the_wave(all: &[Observation], reached: &[Observation]) -> Option<Finding> {
    let is_reached = |one: &&Observation| reached.iter().any(|other| other.recording == one.recording);
    let unreached: Vec<&str> =
        all.iter().filter(|one| !is_reached(one)).map(|one| one.recording.as_str()).collect();
    let text = "they end before the wave comes to what they show, so that nothing tells their trigger and drive: they are no part of the fit to the \
                tracks, nor of the mean that triggers, drives and the motion by the model count from. Record longer, or trigger these views later";
    (!unreached.is_empty()).then(|| Finding {
        code: "unreached",
        subject: named(&unreached),
        text: text.into(),
    })
}

/// Says that the fitted chain model is not shown beside the motion.
pub(crate) fn not_shown(why: &Error) -> Finding {
    let text = format!("not shown beside the motion: {why}");
    Finding { code: "chain_model", subject: "the fitted model".into(), text }
}

/// Says that a film's truth is not compared with what was found.
pub(crate) fn not_compared(why: &Error) -> Finding {
    Finding {
        code: "film_truth",
        subject: "the truth of the films".into(),
        text: format!("not compared: {why}"),
    }
}

/// Says that the accepted chain model aligns no motion.
pub(crate) fn not_aligned(why: &FitError) -> Finding {
    let text = format!("there is none: {why}");
    Finding { code: "chain_model", subject: "the motion aligned by the chain model".into(), text }
}

/// A trial whose drive lies far from the others'.
pub(crate) struct UnusualDrive {
    recording: String,
    /// Less the median of all recordings.
    deviation: Estimate,
    /// The same in units of the scatter that the experiment states.
    in_scatters: f64,
    /// The same in units of what scatter and its own error leave it.
    in_deviations: f64,
}

impl UnusualDrive {
    /// The recording and how far its drive is off.
    pub(crate) fn as_text(&self) -> String {
        format!("{}, {}", self.recording, self.how_far())
    }

    fn how_far(&self) -> String {
        format!(
            "struck {} % off the median ({:.1} of the stated scatter)",
            estimate(self.deviation.scaled(100.0)),
            self.in_scatters
        )
    }

    fn warning(&self) -> Finding {
        let text = format!("{}: kept, with its own drive fitted", self.how_far());
        Finding { code: "unusual_drive", subject: self.recording.clone(), text }
    }
}

/// Recordings whose drive the stated scatter hardly explains.
fn unusual_drives(experiment: &Experiment, recording_alignments: &RecordingAlignments) -> Vec<UnusualDrive> {
    let drives = recording_alignments
        .of_recordings
        .iter()
        .filter_map(|one| drive(experiment, recording_alignments, one));
    drives.filter(|drive| drive.deviation.is_unusual(experiment.drive_scatter())).collect()
}

/// The scatter of triggers within and between views, where one is stated.
fn trigger_scatter_s(experiment: &Experiment) -> Option<f64> {
    let trigger = &experiment.trigger;
    Some(trigger.sigma_s?.get().hypot(trigger.view_sigma_s.map_or(0.0, NotNegative::get)))
}

/// Recordings whose trigger a stated scatter hardly explains: by as much as a drive is unusual.
fn unusual_triggers(scatter_s: f64, of_recordings: &[RecordingAlignment]) -> Vec<Finding> {
    let middle_s =
        median(of_recordings.iter().map(|one| one.trigger_offset_s.value).collect()).unwrap_or(0.0);
    let unusual = |one: &RecordingAlignment| {
        let off_s = Estimate::new(one.trigger_offset_s.value - middle_s, one.trigger_offset_s.sigma);
        off_s.is_unusual(scatter_s).then(|| Finding {
            code: "unusual_trigger",
            subject: one.recording.clone(),
            text: format!(
                "triggered {} us off the median ({:.1} of the stated scatter): kept, with its own trigger fitted (hint: a frame that is missing \
                 while all rests looks the same; or [trigger] states too little)",
                estimate(off_s.scaled(1e6)),
                off_s.value / scatter_s
            ),
        })
    };
    of_recordings.iter().filter_map(unusual).collect()
}

/// The recording whose drive lies farthest from the median.
pub(crate) fn farthest_drive(
    experiment: &Experiment,
    recording_alignments: &RecordingAlignments,
) -> Option<UnusualDrive> {
    let drives = recording_alignments
        .of_recordings
        .iter()
        .filter_map(|one| drive(experiment, recording_alignments, one));
    drives.max_by(|a, b| a.in_deviations.abs().total_cmp(&b.in_deviations.abs()))
}

fn drive(
    experiment: &Experiment,
    recording_alignments: &RecordingAlignments,
    one: &RecordingAlignment,
) -> Option<UnusualDrive> {
    let values =
        recording_alignments.of_recordings.iter().filter_map(|aligned| Some(aligned.drive_deviation?.value));
    let values = values.collect();
    let scatter = experiment.drive_scatter();
    let found = one.drive_deviation?;
    let deviation = Estimate::new(found.value - median(values).unwrap_or(0.0), found.sigma);
    let recording = one.recording.clone();
    Some(UnusualDrive {
        recording,
        in_scatters: deviation.value / scatter,
        in_deviations: deviation.value / scatter.hypot(deviation.sigma),
        deviation,
    })
}

#[cfg(test)]
mod tests {

    use super::*;

    #[test]
    fn a_trigger_is_unusual_by_the_stated_scatter_and_its_own_error() {
        let aligned = |number: usize, offset_us: f64, sigma_us: f64| RecordingAlignment {
            recording: format!("trial{number}"),
            trigger_offset_s: Estimate::new(1e-6 * offset_us, 1e-6 * sigma_us),
            drive_deviation: None,
        };
        let usual = [90.0, 95.0, 100.0, 105.0, 110.0].map(|offset_us| aligned(1, offset_us, 1.0));
        assert!(unusual_triggers(1e-5, &usual).is_empty());
        // 35 us from the median where 10 are stated; less than 2.58 of what is stated and of an error of its own of 15 us.
        let told = unusual_triggers(1e-5, &[&usual[..], &[aligned(4, 140.0, 1.0)]].concat());
        let [said] = told.as_slice() else { panic!("one notice, found {told:?}") };
        assert_eq!((said.code, said.subject.as_str()), ("unusual_trigger", "trial4"));
        assert!(said.text.contains("(3.5 of the stated scatter)"), "{}", said.text);
        assert!(unusual_triggers(1e-5, &[&usual[..], &[aligned(4, 140.0, 15.0)]].concat()).is_empty());
        assert!(unusual_triggers(1e-5, &[]).is_empty());
    }
}
