//! How long each stage of a run took.

use std::time::Instant;

/// How long each stage took.
pub(super) struct StageTimes {
    last: Instant,
    stages: Vec<(&'static str, f64)>,
}

impl StageTimes {
    pub(super) fn new() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    pub(super) fn stage(&mut self, name: &'static str) {
        self.stages.push((name, self.last.elapsed().as_secs_f64()));
        self.last = Instant::now();
    }

    /// Names and durations in seconds, in order.
    pub(super) fn stages(&self) -> &[(&'static str, f64)] {
        &self.stages
    }
}
