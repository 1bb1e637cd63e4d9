//! The course of an iteration: whether it came to rest, and how far it may still have to go.

use nalgebra::DVector;

use crate::stitched::{AlignmentPhase, Unsettled};

/// A sequence that slows down too little to tell where it ends is taken to go on for this many of its last steps.
const FARTHEST: f64 = 20.0;

/// Drives and offsets over the rounds of an alignment.
pub(crate) struct Convergence {
    rounds: usize,
    now: DVector<f64>,
    /// The last step, and the one before it.
    steps: [DVector<f64>; 2],
}

impl Convergence {
    /// Begins where drives and offsets stand.
    pub(crate) fn from(drive: &[f64], offsets_s: &[f64]) -> Self {
        let now = joined(drive, offsets_s);
        Self { rounds: 0, steps: [DVector::zeros(now.len()), DVector::zeros(now.len())], now }
    }

    /// Another round led to these drives and offsets.
    pub(crate) fn goes_to(&mut self, drive: &[f64], offsets_s: &[f64]) {
        let next = joined(drive, offsets_s);
        self.steps.swap(0, 1);
        self.steps[0] = &next - &self.now;
        self.now = next;
        self.rounds += 1;
    }

    /// What the last round still changed.
    pub(crate) fn unsettled(&self, phase: AlignmentPhase) -> Unsettled {
        let n = self.now.len() / 2;
        let largest = |from: usize| self.steps[0].rows(from, n).amax();
        Unsettled { phase, rounds: self.rounds, offset_change_s: largest(n), drive_change: largest(0) }
    }

    /// How far drives and offsets may still have to go: the sum of the further steps, were each as much smaller as the last one.
    /// One step at least, because steps may alternate.
    pub(crate) fn left(&self, frame_interval_s: f64, drive_prior: f64) -> DVector<f64> {
        let n = self.now.len() / 2;
        let length = |step: &DVector<f64>| {
            (step.rows(0, n).norm() / drive_prior).hypot(step.rows(n, n).norm() / frame_interval_s)
        };
        let ratio = length(&self.steps[0]) / length(&self.steps[1]);
        let further = if ratio < 1.0 { ratio / (1.0 - ratio) } else { FARTHEST };
        &self.steps[0] * further.clamp(1.0, FARTHEST)
    }
}

fn joined(drive: &[f64], offsets_s: &[f64]) -> DVector<f64> {
    DVector::from_iterator(2 * drive.len(), drive.iter().chain(offsets_s).copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geometric_course_knows_where_it_ends() {
        let mut course = Convergence::from(&[0.0], &[0.0]);
        for step in 1..6 {
            let way = 1.0 - 0.8_f64.powi(step);
            course.goes_to(&[1e-2 * way], &[1e-6 * way]);
        }
        let left = course.left(4e-5, 0.05);
        let expected = 0.8_f64.powi(5);
        assert!(
            (left[0] - 1e-2 * expected).abs() < 1e-12 && (left[1] - 1e-6 * expected).abs() < 1e-16,
            "{left}"
        );
        let said = course.unsettled(AlignmentPhase::Onset);
        assert_eq!(said.rounds, 5);
        assert!((said.drive_change - 1e-2 * 0.2 * 0.8_f64.powi(4)).abs() < 1e-12);
    }

    #[test]
    fn a_course_that_does_not_slow_down_goes_far() {
        let mut course = Convergence::from(&[0.0], &[0.0]);
        (1..4).for_each(|step| course.goes_to(&[1e-3 * f64::from(step)], &[0.0]));
        assert!((course.left(4e-5, 0.05)[0] - FARTHEST * 1e-3).abs() < 1e-12);
    }
}
