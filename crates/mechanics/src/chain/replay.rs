//! A motion of all masses part by part: from its steps where they are few and were held, and else gone through again as it was solved, so that they are
//! never held over all of a long time.

use chainwave_measurement::Trajectory;
use ndarray::Array2;

use super::{
    recorded_steps::RecordedSteps,
    run::{Run, RunState},
    run_request::RunRequest,
    step_size::Pace,
};
use crate::equations::{parameters::Chain, row::MassRow};
use crate::error::MechanicsError;

/// The motion of all masses from one output to another.
#[derive(Debug, PartialEq)]
pub struct Stretch {
    /// The first output and the last one.
    pub(super) outputs: [usize; 2],
    /// At all steps of the variational equations between these, both ends included.
    pub(super) masses: Trajectory,
}

/// A motion on its way from output to output, the same to the last bit as when it was solved first.
pub struct Replay<'a> {
    source: Source<'a>,
    /// Steps between outputs, and how long one is.
    n_between: usize,
    interval_s: f64,
    n_outputs: usize,
    /// Where it stands.
    output: usize,
}

/// From where its steps come.
enum Source<'a> {
    Held(&'a RecordedSteps),
    Again(Box<Again<'a>>),
}

/// A run that is made again.
struct Again<'a> {
    run: Run<'a, RecordedSteps>,
    at: RunState,
}

impl Again<'_> {
    /// Goes on to a step, and hands out so many up to it; that one stays, and those behind it.
    fn until(&mut self, last: usize, n: usize) -> Result<[Array2<f64>; 2], MechanicsError> {
        self.run.go_on(&mut self.at, last)?;
        let steps = self.run.record.of(0, n);
        self.run.record.forget(n - 1);
        Ok(steps)
    }
}

impl<'a> Replay<'a> {
    /// From t = 0, of a chain that was integrated by an order.
    pub(super) fn of(chain: &'a Chain, order: RunRequest, n_outputs: usize) -> Result<Self, MechanicsError> {
        let steps = RecordedSteps::new(&MassRow::of(chain), 0);
        let (run, at) = Run::begin(chain, &Pace::new(chain), order, steps)?;
        Ok(Self::from(Source::Again(Box::new(Again { run, at })), order, n_outputs))
    }

    /// The same from the steps that were held when it was solved.
    pub(super) fn held(steps: &'a RecordedSteps, order: RunRequest, n_outputs: usize) -> Self {
        Self::from(Source::Held(steps), order, n_outputs)
    }

    fn from(source: Source<'a>, order: RunRequest, n_outputs: usize) -> Self {
        let (n_between, interval_s) = (order.keep_every, order.output_interval_s);
        Self { source, n_between, interval_s, n_outputs, output: 0 }
    }

    /// Goes on to an output, and gives the motion from the output where it stood to that one.
    ///
    /// # Errors
    /// As the motion's that is gone through.
    pub fn until(&mut self, output: usize) -> Result<Stretch, MechanicsError> {
        let first = self.output;
        let last = output.min(self.n_outputs - 1).max(first);
        self.output = last;
        let steps = first * self.n_between..=last * self.n_between;
        let n = steps.clone().count();
        let [displacement_m, velocity_m_per_s] = match &mut self.source {
            Source::Held(held) => held.of(*steps.start(), n),
            Source::Again(again) => again.until(*steps.end(), n)?,
        };
        let times_s = steps.map(|k| k as f64 * self.interval_s).collect();
        let masses = Trajectory { times_s, displacement_m, velocity_m_per_s };
        Ok(Stretch { outputs: [first, last], masses })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{
        schedule::Schedule,
        sensitivity::{Kept, ReferenceMotion},
    };
    use super::*;

    fn n_held(replay: &Replay<'_>) -> usize {
        match &replay.source {
            Source::Held(steps) => steps.n_held(),
            Source::Again(again) => again.run.record.n_held(),
        }
    }

    /// The most displacements that parts of so many outputs hold at once, and those of all steps.
    fn held(n_bodies: usize, length: usize) -> (usize, usize) {
        let (chain, interval_s) = (Chain::of_rings(n_bodies), 1e-4);
        let schedule = Schedule::automatic(6e-4 * n_bodies as f64, interval_s);
        let motion = ReferenceMotion::solve(&chain, &schedule, Kept::Outputs).unwrap();
        let at_steps = ReferenceMotion::solve(&chain, &schedule, Kept::Steps).unwrap();
        let mut from_held = at_steps.replay().unwrap();
        assert!(matches!(from_held.source, Source::Held(_)));
        let (mut replay, n_outputs) = (motion.replay().unwrap(), motion.n_outputs());
        let (mut most, mut all) = (0, 0);
        let moved = &motion.simulation().trajectory.displacement_m;
        for first in (0..n_outputs - 1).step_by(length) {
            let stretch = replay.until(first + length).unwrap();
            assert_eq!(stretch, from_held.until(first + length).unwrap());
            let Stretch { outputs: [start, end], masses } = stretch;
            assert_eq!([start, end], [first, (first + length).min(n_outputs - 1)]);
            most = most.max(masses.displacement_m.len() + n_held(&replay));
            all += masses.displacement_m.len();
            // The same motion, to the last bit.
            for (output, k) in (start..=end).zip((0..).step_by(replay.n_between)) {
                let found = masses.displacement_m.column(k);
                assert!(found.iter().skip(1).eq(moved.column(output)), "{output}");
            }
        }
        (most, all)
    }

    #[test]
    fn what_is_held_at_once_grows_with_the_chain_and_not_with_its_time() {
        let ((few, of_short), (many, of_long)) = (held(20, 8), held(80, 8));
        // Four times the bodies for four times as long: sixteen times as much in all.
        assert!(of_long as f64 > 15.0 * of_short as f64, "{of_short} {of_long}");
        // A step of the motion may go beyond the part that it was asked for, by more in the one chain than in the other.
        assert!((many as f64) < 2.0 * 4.0 * few as f64, "{few} {many}");
    }
}
