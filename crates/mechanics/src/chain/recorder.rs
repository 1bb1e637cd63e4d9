//! Displacements and velocities at the output times.

use chainwave_measurement::Trajectory;
use ndarray::Array2;

use super::{
    row::{End, Row},
    simulation::StrikerMotion,
    state::ChainState,
};

/// Collects the motion at the output times.
#[derive(Debug)]
pub(crate) struct Recorder {
    trajectory: Trajectory,
    /// Those of the strikers in front and at the far end, where there are any.
    strikers: [Option<StrikerMotion>; 2],
    first_body: usize,
}

impl Recorder {
    pub(crate) fn new(n_bodies: usize, times_s: Vec<f64>, row: &Row<'_>) -> Self {
        let shape = (n_bodies, times_s.len());
        let at_rest = || StrikerMotion {
            displacement_m: vec![0.0; times_s.len()],
            velocity_m_per_s: vec![0.0; times_s.len()],
        };
        let strikers = End::BOTH.map(|end| row.striker(end).map(|_| at_rest()));
        let (displacement_m, velocity_m_per_s) = (Array2::zeros(shape), Array2::zeros(shape));
        let trajectory = Trajectory { times_s, displacement_m, velocity_m_per_s };
        Self { trajectory, strikers, first_body: row.first_body() }
    }

    /// Writes `state` as output number `k`.
    pub(crate) fn record(&mut self, k: usize, state: &ChainState) {
        let first = self.first_body;
        for (to, &x_m) in self.trajectory.displacement_m.column_mut(k).iter_mut().zip(&state.x_m[first..]) {
            *to = x_m;
        }
        for (to, &v) in
            self.trajectory.velocity_m_per_s.column_mut(k).iter_mut().zip(&state.v_m_per_s[first..])
        {
            *to = v;
        }
        let behind = first + self.trajectory.displacement_m.nrows();
        for (striker, mass) in self.strikers.iter_mut().zip([0, behind]) {
            if let Some(striker) = striker {
                striker.displacement_m[k] = state.x_m[mass];
                striker.velocity_m_per_s[k] = state.v_m_per_s[mass];
            }
        }
    }

    /// Largest difference of displacement to another record over the largest displacement.
    pub(crate) fn relative_difference(&self, other: &Self) -> f64 {
        let (x, y) = (&self.trajectory.displacement_m, &other.trajectory.displacement_m);
        let largest = x.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let difference = x.iter().zip(y).fold(0.0_f64, |largest, (x, y)| largest.max((x - y).abs()));
        if difference > 0.0 { difference / largest } else { 0.0 }
    }

    pub(crate) fn finish(self) -> (Trajectory, [Option<StrikerMotion>; 2]) {
        (self.trajectory, self.strikers)
    }
}
