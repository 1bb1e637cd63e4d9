//! A motion x_n(t) as the command writes it, looked up by body and time.

use std::path::Path;

use crate::support::table::Table;

/// A motion known exactly: displacements in metres, row by row in time, as `simulate` and `synthesize` write them.
pub(crate) struct Motion {
    times_s: Vec<f64>,
    x_m: Vec<f64>,
    /// The table's first body: 0 where the striker is listed.
    first: usize,
    n_bodies: usize,
}

impl Motion {
    /// Reads a table `t_s, body, x_m` of `n_bodies` rows a time.
    pub(crate) fn read(path: &Path, n_bodies: usize) -> Self {
        let table = Table::read(path);
        assert_eq!(table.n_rows() % n_bodies, 0, "{}", path.display());
        Self {
            times_s: table.full("t_s").into_iter().step_by(n_bodies).collect(),
            x_m: table.full("x_m"),
            first: table.full("body")[0] as usize,
            n_bodies,
        }
    }

    /// Times of the samples.
    pub(crate) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Displacement of a body, linear between the samples: over 10 us at 1e4 m/s^2 that errs by 1e-7 m. At rest before.
    pub(crate) fn at(&self, body: usize, time_s: f64) -> f64 {
        if time_s <= self.times_s[0] {
            return 0.0;
        }
        let x_m = |index: usize| self.x_m[index * self.n_bodies + body - self.first];
        let right = self.times_s.partition_point(|time| *time < time_s).min(self.times_s.len() - 1);
        let (left_s, right_s) = (self.times_s[right - 1], self.times_s[right]);
        let share = (time_s - left_s) / (right_s - left_s);
        (1.0 - share) * x_m(right - 1) + share * x_m(right)
    }

    /// Shares of a `motion.parquet`'s 95 % intervals that hold this motion, where it has gone `beyond_m`, and the largest error
    /// there in metres.
    pub(crate) fn held_by(&self, motion: &Table, beyond_m: f64) -> (f64, f64) {
        let (times_s, bodies) = (motion.full("t_s"), motion.full("body"));
        let (x_m, sigma_m) = (motion.full("x_m"), motion.full("sigma_m"));
        let truth_m = |row: usize| self.at(bodies[row] as usize, times_s[row]);
        let rows: Vec<usize> = (0..x_m.len()).filter(|row| truth_m(*row) > beyond_m).collect();
        let errors_m: Vec<f64> = rows.iter().map(|row| (x_m[*row] - truth_m(*row)).abs()).collect();
        let n_held =
            rows.iter().zip(&errors_m).filter(|(row, error_m)| **error_m <= 1.96 * sigma_m[**row]).count();
        (n_held as f64 / rows.len() as f64, errors_m.into_iter().fold(0.0, f64::max))
    }
}

/// Bodies of the small experiment.
const N_BODIES: usize = 12;

/// Asserts that the 95 % intervals of the motion in a folder of results hold what was filmed of the small experiment.
///
/// 12 bodies share the errors of 15 recordings' triggers and drives: of such, 95 % +- 2.5 % hold on the whole. The bound is four of these
/// below; four above lie beyond all of them.
pub(crate) fn assert_motion_held(recordings: &Path, results: &Path) {
    let truth = Motion::read(&recordings.join("truth.parquet"), N_BODIES);
    let (held, _) = truth.held_by(&Table::read(&results.join("motion.parquet")), f64::NEG_INFINITY);
    assert!(held > 0.85, "{held}");
}
