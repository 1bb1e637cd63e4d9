//! Motions of a chain over time: known exactly, or measured with every error that samples share.

use ndarray::Array2;

use crate::{ErrorModes, ErrorSource, Estimate};

/// A motion known exactly (computed by a model or prescribed), sampled at common times.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Sample times in seconds, increasing.
    pub times_s: Vec<f64>,
    /// Displacement from rest, shape `[body, time]`, in metres.
    pub displacement_m: Array2<f64>,
    /// Velocity, shape `[body, time]`, in metres per second.
    pub velocity_m_per_s: Array2<f64>,
}

impl Trajectory {
    /// The motion at a time: the cubic Hermite interpolant of the displacements and velocities around it. Before the first
    /// sample the bodies rest where they are at it; `None` after the last sample (and for a time that is not a number).
    ///
    /// The displacement's error is at most h^4/384 max|x''''| for samples h apart.
    pub fn at(&self, time_s: f64) -> Option<TrajectoryAt<'_>> {
        Some(TrajectoryAt { trajectory: self, instant: SampleWeights::among(&self.times_s, time_s)? })
    }
}

/// A time among the sample times of a motion: which samples stand around it, and how they add up to the motion there
/// ([`Trajectory::at`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleWeights {
    /// The samples before and after.
    samples: [usize; 2],
    /// Weights of displacement and velocity before, displacement and velocity after.
    weights: [f64; 4],
    /// The same for the velocity.
    slopes: [f64; 4],
}

impl SampleWeights {
    /// Of a time in seconds among increasing sample times; `None` after the last one.
    pub fn among(times_s: &[f64], time_s: f64) -> Option<Self> {
        let after = samples_until(times_s, time_s);
        let still = |sample: usize, slopes: [f64; 4]| Self {
            samples: [sample, sample],
            weights: [1.0, 0.0, 0.0, 0.0],
            slopes,
        };
        if after == 0 {
            return (time_s < *times_s.first()?).then(|| still(0, [0.0; 4]));
        }
        let (before, start_s) = (after - 1, times_s[after - 1]);
        let Some(&end_s) = times_s.get(after) else {
            return (time_s <= start_s).then(|| still(before, [0.0, 1.0, 0.0, 0.0]));
        };
        let step_s = end_s - start_s;
        let at = (time_s - start_s) / step_s;
        let (weights, slopes) = (hermite_weights(at, step_s), hermite_slopes(at, step_s));
        Some(Self { samples: [before, after], weights, slopes })
    }

    /// The numbers of the samples before and after.
    pub fn samples(&self) -> [usize; 2] {
        self.samples
    }

    /// The same where samples are counted from one of them on.
    #[must_use]
    pub fn counted_from(&self, first: usize) -> Self {
        Self { samples: self.samples.map(|sample| sample - first), ..*self }
    }

    /// Displacement of a body whose samples are pairs of displacement and velocity.
    pub fn displacement_m(&self, samples: &[[f64; 2]]) -> f64 {
        self.weigh(self.weights, samples)
    }

    /// Velocity of a body whose samples are pairs of displacement and velocity.
    pub fn velocity_m_per_s(&self, samples: &[[f64; 2]]) -> f64 {
        self.weigh(self.slopes, samples)
    }

    fn weigh(&self, weights: [f64; 4], samples: &[[f64; 2]]) -> f64 {
        let [[x_0, v_0], [x_1, v_1]] = self.samples.map(|sample| samples[sample]);
        weights[0] * x_0 + weights[1] * v_0 + weights[2] * x_1 + weights[3] * v_1
    }
}

/// Number of samples up to a time (itself included), of increasing sample times: found at once where they are equally spaced, as
/// most are, else by bisection.
pub fn samples_until(times_s: &[f64], time_s: f64) -> usize {
    let equal_steps = || {
        let (first_s, last_s) = (*times_s.first()?, *times_s.last()?);
        let guess = ((time_s - first_s) / (last_s - first_s) * (times_s.len() - 1) as f64) as usize;
        let guess = guess.saturating_add(1);
        let (before_s, after_s) = (*times_s.get(guess - 1)?, *times_s.get(guess)?);
        (before_s <= time_s && time_s < after_s).then_some(guess)
    };
    equal_steps().unwrap_or_else(|| times_s.partition_point(|&sample_s| sample_s <= time_s))
}

/// A [`Trajectory`] at one time.
#[derive(Debug, Clone, Copy)]
pub struct TrajectoryAt<'a> {
    trajectory: &'a Trajectory,
    instant: SampleWeights,
}

impl TrajectoryAt<'_> {
    /// Displacement of a body (row of the trajectory) from rest, in metres.
    pub fn displacement_m(&self, row: usize) -> f64 {
        self.weigh(self.instant.weights, row)
    }

    /// Velocity of a body (row of the trajectory), in metres per second.
    pub fn velocity_m_per_s(&self, row: usize) -> f64 {
        self.weigh(self.instant.slopes, row)
    }

    /// Fills lists with the displacements (metres) and velocities (metres per second) of the first bodies, as many as they hold.
    ///
    /// Quick where the trajectory's columns lie in one piece.
    pub fn fill(&self, displacement_m: &mut [f64], velocity_m_per_s: &mut [f64]) {
        let [x_before, x_after] =
            self.instant.samples.map(|sample| self.trajectory.displacement_m.column(sample));
        let [v_before, v_after] =
            self.instant.samples.map(|sample| self.trajectory.velocity_m_per_s.column(sample));
        let columns = x_before.iter().zip(v_before).zip(x_after.iter().zip(v_after));
        let out = displacement_m.iter_mut().zip(velocity_m_per_s);
        for ((x_m, v_m_per_s), ((x_0, v_0), (x_1, v_1))) in out.zip(columns) {
            let sum = |[a, b, c, d]: [f64; 4]| a * x_0 + b * v_0 + c * x_1 + d * v_1;
            (*x_m, *v_m_per_s) = (sum(self.instant.weights), sum(self.instant.slopes));
        }
    }

    fn weigh(&self, weights: [f64; 4], row: usize) -> f64 {
        let [before, after] = self.instant.samples;
        let (x_m, v_m_per_s) = (&self.trajectory.displacement_m, &self.trajectory.velocity_m_per_s);
        weights[0] * x_m[[row, before]]
            + weights[1] * v_m_per_s[[row, before]]
            + weights[2] * x_m[[row, after]]
            + weights[3] * v_m_per_s[[row, after]]
    }
}

/// Weights of the value and slope at the start, and of the value and slope at the end, of an interval of length `step`,
/// at the fraction `at` of it.
fn hermite_weights(at: f64, step: f64) -> [f64; 4] {
    let rest = 1.0 - at;
    [
        (1.0 + 2.0 * at) * rest * rest,
        at * rest * rest * step,
        at * at * (3.0 - 2.0 * at),
        -at * at * rest * step,
    ]
}

/// Derivatives of [`hermite_weights`] along the interval.
fn hermite_slopes(at: f64, step: f64) -> [f64; 4] {
    let rest = 1.0 - at;
    let chord = 6.0 * at * rest / step;
    [-chord, rest * (1.0 - 3.0 * at), chord, at * (3.0 * at - 2.0)]
}

/// The measured motion of a chain: x_n(t) on one time base with its uncertainty.
///
/// The error of a sample is the sum of a part that is independent from sample to sample (standard deviation
/// [`ChainMotion::independent_sigma_m`]) and of the shared [`ErrorModes`], each with a random amplitude of unit variance.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainMotion {
    /// Sample times in seconds after the trigger, increasing and equally spaced.
    pub times_s: Vec<f64>,
    /// Displacement from rest in metres with its total standard uncertainty, shape `[body, time]`; `None` where no trial
    /// saw the body.
    pub displacement_m: Array2<Option<Estimate>>,
    /// Standard uncertainty of the independent part, in metres, shape `[body, time]`; zero where nothing was measured.
    pub independent_sigma_m: Array2<f64>,
    /// Errors that many samples share.
    pub modes: ErrorModes,
    /// Number of trials behind each sample, shape `[body, time]`.
    pub n_trials: Array2<u32>,
}

impl ChainMotion {
    /// A motion of which nothing was seen yet: so many bodies, at these times.
    pub fn unseen(n_bodies: usize, times_s: Vec<f64>) -> Self {
        let shape = (n_bodies, times_s.len());
        Self {
            times_s,
            displacement_m: Array2::from_elem(shape, None),
            independent_sigma_m: Array2::zeros(shape),
            modes: ErrorModes::default(),
            n_trials: Array2::zeros(shape),
        }
    }

    /// Number of bodies.
    pub fn n_bodies(&self) -> usize {
        self.displacement_m.nrows()
    }

    /// The column that holds each of these times, `None` where the motion has none. Both have times that are multiples of one interval.
    pub fn columns_at(&self, times_s: &[f64]) -> Vec<Option<usize>> {
        let interval_s = self.times_s.get(1).map_or(1.0, |second_s| second_s - self.times_s[0]);
        let column = |time_s: &f64| {
            let index = self.times_s.partition_point(|own_s| *own_s < time_s - 0.5 * interval_s);
            self.times_s.get(index).filter(|own_s| **own_s < time_s + 0.5 * interval_s).map(|_| index)
        };
        times_s.iter().map(column).collect()
    }

    /// Adds an error that many samples share, with its displacement error in metres for an amplitude of one standard deviation, shape
    /// `[body, time]`, and its share to the uncertainty of each sample.
    pub fn add_error(&mut self, source: ErrorSource, displacement_m: &Array2<f64>) {
        self.widen(displacement_m);
        self.modes.push(source, displacement_m);
    }

    /// [`ChainMotion::add_error`] of each of these, in their order.
    pub fn add_errors(&mut self, errors: ErrorModes) {
        (0..errors.len()).for_each(|k| self.widen(&errors.displacement_m(k, self.displacement_m.dim())));
        self.modes.append(errors, |source, _| source);
    }

    fn widen(&mut self, error_m: &Array2<f64>) {
        for (x, error_m) in self.displacement_m.iter_mut().zip(error_m) {
            *x = x.map(|x| Estimate::new(x.value, x.sigma.hypot(*error_m)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One body on a sine of angular frequency `omega` and amplitude 1, sampled `step_s` apart.
    fn sine(omega: f64, step_s: f64, n: usize) -> Trajectory {
        let times_s: Vec<f64> = (0..n).map(|i| i as f64 * step_s).collect();
        Trajectory {
            displacement_m: Array2::from_shape_fn((1, n), |(_, i)| (omega * times_s[i]).sin()),
            velocity_m_per_s: Array2::from_shape_fn((1, n), |(_, i)| omega * (omega * times_s[i]).cos()),
            times_s,
        }
    }

    /// Largest errors of displacement and velocity over 10 ms.
    fn largest_errors(omega: f64, step_s: f64) -> [f64; 2] {
        let motion = sine(omega, step_s, (0.01 / step_s).round() as usize + 1);
        (0..997).map(|i| f64::from(i) * 1.0e-5).fold([0.0, 0.0], |[x, v]: [f64; 2], t| {
            let moment = motion.at(t).unwrap();
            let slope = omega * (omega * t).cos();
            [
                x.max((moment.displacement_m(0) - (omega * t).sin()).abs()),
                v.max((moment.velocity_m_per_s(0) - slope).abs()),
            ]
        })
    }

    #[test]
    fn the_error_stays_below_its_bound_and_falls_with_the_fourth_power() {
        // 572 Hz, the top of the chain's band; h^4/384 max|x''''| with max|x''''| = omega^4.
        let omega = 2.0 * std::f64::consts::PI * 572.0;
        for step_s in [4.0e-4, 2.0e-4, 1.0e-4] {
            assert!(largest_errors(omega, step_s)[0] <= (omega * step_s).powi(4) / 384.0);
        }
        let (coarse, fine) = (largest_errors(omega, 4.0e-4), largest_errors(omega, 1.0e-4));
        // 0.1: the sine's next derivative over the coarser step. The velocity is a derivative, one order below.
        for (quantity, order) in [(0, 4.0), (1, 3.0)] {
            let found = (coarse[quantity] / fine[quantity]).log2() / 2.0;
            assert!((found - order).abs() < 0.1, "{found} for {order}");
        }
    }

    #[test]
    fn samples_are_found_in_equal_and_in_unequal_steps() {
        let equal: Vec<f64> = (0..1000).map(|i| 0.1 + f64::from(i) * 1e-5).collect();
        let unequal: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 1e-3).powi(2)).collect();
        for times_s in [equal, unequal, vec![0.3]] {
            let between = (0..2000).map(|i| f64::from(i) * 6e-4 - 0.05);
            for time_s in times_s.iter().copied().chain(between).chain([f64::INFINITY, f64::NAN, 1e300]) {
                let counted = times_s.iter().filter(|sample_s| **sample_s <= time_s).count();
                assert_eq!(samples_until(&times_s, time_s), counted, "{time_s} s");
            }
        }
    }

    #[test]
    fn bodies_rest_before_the_first_sample_and_are_unknown_after_the_last() {
        let motion = sine(100.0, 1.0e-3, 11);
        let state = |t| motion.at(t).map(|moment| (moment.displacement_m(0), moment.velocity_m_per_s(0)));
        let last = (motion.displacement_m[[0, 10]], motion.velocity_m_per_s[[0, 10]]);
        assert_eq!(state(-5.0), Some((0.0, 0.0)));
        assert_eq!(state(motion.times_s[10]), Some(last));
        assert_eq!(state(0.0101), None);
        assert_eq!(state(f64::NAN), None);
    }
}
