//! Displacements and velocities at the output times.

use chainwave_measurement::Trajectory;
use ndarray::Array2;

use super::{record::Record, recorded_steps::RecordedSteps, simulation::StrikerMotion};
use crate::equations::{
    row::{MassRow, RowEnd},
    state::ChainState,
};

/// Collects the motion at the output times.
#[derive(Debug)]
pub(crate) struct Recorder {
    trajectory: Trajectory,
    /// Those of the strikers in front and at the far end, where there are any.
    strikers: [Option<StrikerMotion>; 2],
    first_body: usize,
    /// Of so many outputs one is kept.
    keep_every: usize,
    /// Displacements and velocities of the bodies at the outputs that are not written yet, output after output, and the number of the first of these.
    waiting: [Vec<f64>; 2],
    first_waiting: usize,
    /// The states of all masses at all outputs, where they are held.
    steps: Option<RecordedSteps>,
}

/// Outputs that are written together: the times of a body lie side by side, so that one output by itself would touch a line of memory for each body.
const TOGETHER: usize = 32;

impl Recorder {
    /// Of as many outputs as there are times, each the last one of `keep_every` outputs, whose steps are held beside or not.
    pub(crate) fn new(
        row: &MassRow<'_>,
        n_bodies: usize,
        (times_s, keep_every): (Vec<f64>, usize),
        steps: Option<RecordedSteps>,
    ) -> Self {
        let shape = (n_bodies, times_s.len());
        let at_rest = || StrikerMotion {
            displacement_m: vec![0.0; times_s.len()],
            velocity_m_per_s: vec![0.0; times_s.len()],
        };
        let strikers = RowEnd::BOTH.map(|end| row.striker(end).map(|_| at_rest()));
        let (displacement_m, velocity_m_per_s) = (Array2::zeros(shape), Array2::zeros(shape));
        let trajectory = Trajectory { times_s, displacement_m, velocity_m_per_s };
        Self {
            trajectory,
            strikers,
            first_body: row.first_body(),
            keep_every,
            waiting: [Vec::new(), Vec::new()],
            first_waiting: 0,
            steps,
        }
    }

    /// Writes what waits. What rests is zero already: where a body does for long, no memory is taken.
    pub(crate) fn write(&mut self) {
        let Trajectory { displacement_m, velocity_m_per_s, .. } = &mut self.trajectory;
        let (n_bodies, first) = (displacement_m.nrows(), self.first_waiting);
        for (rows, waiting) in [displacement_m, velocity_m_per_s].into_iter().zip(&mut self.waiting) {
            let outputs = waiting.chunks_exact(n_bodies);
            self.first_waiting = first + outputs.len();
            for (body, mut row) in rows.rows_mut().into_iter().enumerate() {
                let values = outputs.clone().map(|output| output[body]);
                if values.clone().any(|value| value != 0.0) {
                    row.iter_mut().skip(first).zip(values).for_each(|(place, value)| *place = value);
                }
            }
            waiting.clear();
        }
    }

    /// Largest difference of displacement to another record over the largest displacement.
    pub(crate) fn relative_difference(&self, other: &Self) -> f64 {
        let (x, y) = (&self.trajectory.displacement_m, &other.trajectory.displacement_m);
        let largest = x.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let difference = x.iter().zip(y).fold(0.0_f64, |largest, (x, y)| largest.max((x - y).abs()));
        if difference > 0.0 { difference / largest } else { 0.0 }
    }

    /// Hands out the steps that are held.
    pub(crate) fn take_steps(&mut self) -> Option<RecordedSteps> {
        self.steps.take()
    }

    pub(crate) fn finish(self) -> (Trajectory, [Option<StrikerMotion>; 2]) {
        (self.trajectory, self.strikers)
    }
}

impl Record for Recorder {
    fn takes(&self, k: usize) -> bool {
        self.steps.is_some() || k.is_multiple_of(self.keep_every)
    }

    fn record(&mut self, k: usize, state: &ChainState) {
        if let Some(steps) = &mut self.steps {
            steps.record(k, state);
        }
        if !k.is_multiple_of(self.keep_every) {
            return;
        }
        let k = k / self.keep_every;
        let first = self.first_body;
        let n_bodies = self.trajectory.displacement_m.nrows();
        let of_bodies = first..first + n_bodies;
        let [x_m, v_m_per_s] = &mut self.waiting;
        x_m.extend_from_slice(&state.x_m[of_bodies.clone()]);
        v_m_per_s.extend_from_slice(&state.v_m_per_s[of_bodies.clone()]);
        let behind = of_bodies.end;
        for (striker, mass) in self.strikers.iter_mut().zip([0, behind]) {
            if let Some(striker) = striker {
                striker.displacement_m[k] = state.x_m[mass];
                striker.velocity_m_per_s[k] = state.v_m_per_s[mass];
            }
        }
        if k + 1 == self.first_waiting + TOGETHER {
            self.write();
        }
    }
}
