//! One simulation of a chain, as the fit to tracks reads it.

use std::ops::Range;

use chainwave_measurement::Trajectory;

/// One simulation, body after body: pairs of displacement and velocity, or of their derivatives.
pub(super) struct Samples {
    n_times: usize,
    pairs: Vec<[f64; 2]>,
}

/// Times of a body that are written together, so that a line of memory is fetched once for all of them.
const TOGETHER: usize = 16;

impl Samples {
    pub(super) fn of(motion: &Trajectory) -> Self {
        let n_times = motion.times_s.len();
        let (x_m, v_m_per_s) = (&motion.displacement_m, &motion.velocity_m_per_s);
        let mut pairs = vec![[0.0; 2]; x_m.len()];
        let of_bodies = pairs.chunks_exact_mut(n_times.max(1));
        // The samples of a time lie side by side in derivatives, those of a body in motions.
        match [x_m, v_m_per_s].map(|all| all.t().to_slice()) {
            [Some(x_m), Some(v_m_per_s)] => gather([x_m, v_m_per_s], x_m.len() / n_times.max(1), of_bodies),
            _ => {
                for (pairs, (x_m, v_m_per_s)) in of_bodies.zip(x_m.outer_iter().zip(v_m_per_s.outer_iter())) {
                    let samples = x_m.into_iter().zip(v_m_per_s);
                    pairs.iter_mut().zip(samples).for_each(|(pair, (x_m, v))| *pair = [*x_m, *v]);
                }
            }
        }
        Self { n_times, pairs }
    }

    /// Displacements from the first ones, which are where pictures at rest show the bodies: a chain that is let go was held displaced until then.
    pub(super) fn since_the_first(mut self) -> Self {
        for pairs in self.pairs.chunks_exact_mut(self.n_times.max(1)) {
            let first_m = pairs[0][0];
            pairs.iter_mut().for_each(|[x_m, _]| *x_m -= first_m);
        }
        self
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

/// Puts displacements and velocities, those of all bodies at one time behind those at the time before, into the bodies' pairs.
fn gather<'a>(
    [x_m, v_m_per_s]: [&[f64]; 2],
    n_bodies: usize,
    of_bodies: impl Iterator<Item = &'a mut [[f64; 2]]>,
) {
    let mut of_bodies: Vec<_> = of_bodies.map(|pairs| pairs.chunks_mut(TOGETHER)).collect();
    let n = (n_bodies * TOGETHER).max(1);
    for (x_m, v_m_per_s) in x_m.chunks(n).zip(v_m_per_s.chunks(n)) {
        for (body, pairs) in of_bodies.iter_mut().enumerate() {
            let [x_m, v_m_per_s] = [x_m, v_m_per_s].map(|all| all[body..].iter().step_by(n_bodies));
            let samples = x_m.zip(v_m_per_s);
            let pairs = pairs.next().into_iter().flatten();
            pairs.zip(samples).for_each(|(pair, (x_m, v))| *pair = [*x_m, *v]);
        }
    }
}
