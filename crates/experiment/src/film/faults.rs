//! What the faults of an experiment do to its films.

use std::path::Path;

use chainwave_synthetic::{Cover, FileFaults};

use crate::configuration::{Fault, Trial};
use crate::error::Error;

/// The faults of an experiment, asked by recording.
pub(super) struct Faults<'a>(pub(super) &'a [Fault]);

impl Faults<'_> {
    /// Refuses a fault of a recording or view that the trials table does not have; `path` is the experiment.
    pub(super) fn check(&self, trials: &[Trial], path: &Path) -> Result<(), Error> {
        let missing = |what: String| Error::Configuration {
            path: path.to_owned(),
            message: format!(
                "[[synthetic.faults]]: expected a recording or view of the trials table, found {what}"
            ),
        };
        for fault in self.0 {
            if let Fault::MissingView { view } = fault
                && trials.iter().all(|trial| trial.view != *view)
            {
                return Err(missing(format!("view {view}")));
            }
            let unknown = |name: &&&String| trials.iter().all(|trial| trial.recording != ***name);
            if let Some(name) = fault.recordings().iter().find(unknown) {
                return Err(missing(format!("\"{name}\"")));
            }
        }
        Ok(())
    }

    /// The kinds of a trial's faults, for its truth.
    pub(super) fn names(&self, trial: &Trial) -> String {
        let names: Vec<&str> = self.of(trial).map(Fault::name).collect();
        names.join(" ")
    }

    /// Whether a trial's recording is lost.
    pub(super) fn is_lost(&self, trial: &Trial) -> bool {
        self.of(trial).any(|fault| matches!(fault, Fault::MissingView { .. }))
    }

    /// Whether the trial is one that the experiment's mean motion is about.
    pub(super) fn is_sound(&self, trial: &Trial) -> bool {
        !self.is_lost(trial) && !self.of(trial).any(|fault| matches!(fault, Fault::StruckTooFast { .. }))
    }

    /// Factor on the striker's drawn velocity.
    pub(super) fn striker_factor(&self, trial: &Trial) -> f64 {
        let factor = |fault: &Fault| match fault {
            Fault::StruckTooFast { factor, .. } => Some(factor.get()),
            _ => None,
        };
        self.of(trial).filter_map(factor).product()
    }

    /// The name under which a trial's recording is kept.
    pub(super) fn file_name<'b>(&'b self, trial: &'b Trial) -> &'b str {
        let swapped = self.of(trial).find_map(|fault| match fault {
            Fault::SwappedFiles { recordings } => recordings.iter().find(|name| **name != trial.recording),
            _ => None,
        });
        swapped.unwrap_or(&trial.recording)
    }

    /// What hides bodies in a trial.
    pub(super) fn covers(&self, trial: &Trial) -> Vec<Cover> {
        let cover = |fault: &Fault| match fault {
            Fault::CoveredBody { body, from_s, until_s, .. } => {
                Some(Cover { body: *body, from_s: *from_s, until_s: *until_s })
            }
            _ => None,
        };
        self.of(trial).filter_map(cover).collect()
    }

    /// What is wrong with a trial's file.
    pub(super) fn of_file(&self, trial: &Trial) -> FileFaults {
        let mut faults = FileFaults::default();
        for fault in self.of(trial) {
            match fault {
                Fault::TruncatedFile { kept_fraction, .. } => faults.kept_fraction = Some(*kept_fraction),
                Fault::DroppedFrames { first_frame, n_frames, .. } => {
                    faults.dropped_frames = Some(*first_frame..first_frame.saturating_add(*n_frames));
                }
                Fault::WrongRate { header_rate_hz, .. } => faults.header_rate_hz = Some(*header_rate_hz),
                _ => {}
            }
        }
        faults
    }

    fn of(&self, trial: &Trial) -> impl Iterator<Item = &Fault> {
        self.0.iter().filter(|fault| match fault {
            Fault::MissingView { view } => *view == trial.view,
            _ => fault.recordings().contains(&&trial.recording),
        })
    }
}
