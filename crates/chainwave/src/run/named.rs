//! What is wrong, by its name, on standard error.

use chainwave_experiment::{FailedRecording, Finding};

use super::summary;
use crate::error::hint_of;
use crate::outcome::Outcome;

/// Tells what contradicts the experiment before time is spent on it; the summary says so again.
pub(super) fn name_findings(findings: &[Finding]) {
    summary::print_lines(findings.iter().map(|finding| format!("warning, before work: {finding}")));
}

/// Names recordings that failed on standard error.
pub(crate) fn name_failed(failed: &[FailedRecording], outcome: &mut Outcome) {
    failed.iter().for_each(|one| outcome.fail(format!("{}{}", one.error, hint_of(&one.error))));
}
