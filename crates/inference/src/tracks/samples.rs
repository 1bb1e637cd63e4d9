//! One simulation of a chain, as the fit to tracks reads it.

use std::ops::Range;

use chainwave_measurement::Trajectory;

/// One simulation, body after body: pairs of displacement and velocity, or of their derivatives.
pub(super) struct Samples {
    n_times: usize,
    pairs: Vec<[f64; 2]>,
}

impl Samples {
    pub(super) fn of(motion: &Trajectory) -> Self {
        let n_times = motion.times_s.len();
        let (x_m, v_m_per_s) = (&motion.displacement_m, &motion.velocity_m_per_s);
        let mut pairs = vec![[0.0; 2]; x_m.len()];
        // The samples of a time lie side by side in derivatives.
        for (time, (x_m, v_m_per_s)) in x_m.columns().into_iter().zip(v_m_per_s.columns()).enumerate() {
            let places = pairs.iter_mut().skip(time).step_by(n_times);
            places.zip(x_m.iter().zip(v_m_per_s)).for_each(|(place, (x_m, v))| *place = [*x_m, *v]);
        }
        Self { n_times, pairs }
    }

    /// Number of pairs.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Of a body over some times.
    pub(super) fn of_body(&self, body: usize, range: &Range<usize>) -> &[[f64; 2]] {
        let first = (body - 1) * self.n_times;
        &self.pairs[first + range.start..first + range.end]
    }
}
