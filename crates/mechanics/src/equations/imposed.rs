//! Imposed motion of the first body: a not-a-knot cubic spline through samples.

use chainwave_measurement::samples_until;

use crate::{check, error::MechanicsError};

/// A motion x_1(t) given by samples: the interpolating cubic spline, twice continuously differentiable.
///
/// The ends follow the not-a-knot condition, so a cubic motion is reproduced exactly and the error falls with the fourth
/// power of the sampling interval up to the ends.
#[derive(Debug, Clone, PartialEq)]
pub struct ImposedMotion {
    times_s: Vec<f64>,
    displacement_m: Vec<f64>,
    acceleration_m_per_s2: Vec<f64>,
}

/// Samples that a not-a-knot spline needs.
const MIN_SAMPLES: usize = 4;

impl ImposedMotion {
    /// The spline through `displacement_m` (metres) at increasing `times_s` (seconds).
    ///
    /// # Errors
    /// [`MechanicsError::Length`] for lists of unequal length or fewer than four samples,
    /// [`MechanicsError::TimesNotIncreasing`], and [`MechanicsError::NotPhysical`] for a sample that is not finite.
    pub fn from_samples(times_s: Vec<f64>, displacement_m: Vec<f64>) -> Result<Self, MechanicsError> {
        check::length("displacements of the imposed motion", times_s.len(), displacement_m.len())?;
        check::length("samples of the imposed motion", times_s.len().max(MIN_SAMPLES), times_s.len())?;
        for (i, (&time_s, &x_m)) in times_s.iter().zip(&displacement_m).enumerate() {
            check::finite(format!("time of sample {i}, in s"), time_s)?;
            check::finite(format!("displacement of sample {i}, in m"), x_m)?;
        }
        if let Some(i) = (1..times_s.len()).find(|&i| times_s[i] <= times_s[i - 1]) {
            let (previous_s, found_s) = (times_s[i - 1], times_s[i]);
            return Err(MechanicsError::TimesNotIncreasing { index: i, previous_s, found_s });
        }
        let acceleration_m_per_s2 = second_derivatives(&times_s, &displacement_m);
        Ok(Self { times_s, displacement_m, acceleration_m_per_s2 })
    }

    /// Displacement in metres at a time in seconds; beyond the samples, the cubic of the nearest interval goes on.
    pub fn displacement_m(&self, time_s: f64) -> f64 {
        self.at(time_s).0
    }

    /// Velocity in metres per second, likewise.
    pub fn velocity_m_per_s(&self, time_s: f64) -> f64 {
        self.at(time_s).1
    }

    /// Displacement in metres and velocity in metres per second.
    pub(crate) fn at(&self, time_s: f64) -> (f64, f64) {
        let last = self.times_s.len() - 2;
        let i = samples_until(&self.times_s, time_s).saturating_sub(1).min(last);
        let h = self.times_s[i + 1] - self.times_s[i];
        let (from_left, to_right) = (time_s - self.times_s[i], self.times_s[i + 1] - time_s);
        let (x_0, x_1) = (self.displacement_m[i], self.displacement_m[i + 1]);
        let (a_0, a_1) = (self.acceleration_m_per_s2[i], self.acceleration_m_per_s2[i + 1]);
        let chord = (x_1 - x_0) / h;
        let bend = a_0 * (to_right + h) + a_1 * (from_left + h);
        let x_m = x_0 + from_left * (chord - to_right * bend / (6.0 * h));
        let v = chord - h * (2.0 * a_0 + a_1) / 6.0 + from_left * (a_0 + 0.5 * (a_1 - a_0) * from_left / h);
        (x_m, v)
    }

    /// Acceleration at a time, in metres per second squared: linear between samples.
    pub(crate) fn acceleration_m_per_s2(&self, time_s: f64) -> f64 {
        let i = samples_until(&self.times_s, time_s).saturating_sub(1).min(self.times_s.len() - 2);
        let part = (time_s - self.times_s[i]) / (self.times_s[i + 1] - self.times_s[i]);
        let [a_0, a_1] = [i, i + 1].map(|i| self.acceleration_m_per_s2[i]);
        a_0 + part * (a_1 - a_0)
    }

    /// Largest size of the displacement at the samples, in metres.
    pub(crate) fn largest_displacement_m(&self) -> f64 {
        self.displacement_m.iter().map(|x_m| x_m.abs()).fold(0.0, f64::max)
    }

    /// Largest size of the velocity at the samples, in metres per second.
    pub(crate) fn largest_velocity_m_per_s(&self) -> f64 {
        self.times_s.iter().map(|&time_s| self.velocity_m_per_s(time_s).abs()).fold(0.0, f64::max)
    }

    /// Requires samples from t = 0 to `duration_s`.
    pub(crate) fn check_covers(&self, duration_s: f64) -> Result<(), MechanicsError> {
        let (first_s, last_s) = (self.times_s[0], self.times_s[self.times_s.len() - 1]);
        // The last output may lie a rounding beyond the last sample.
        if first_s > 0.0 || last_s < duration_s * (1.0 - 1e-12) {
            return Err(MechanicsError::ImposedTooShort { first_s, last_s, needed_s: duration_s });
        }
        Ok(())
    }
}

/// Second derivatives of the not-a-knot spline at its knots.
///
/// The end conditions express the outermost derivatives by their neighbours; what remains is a tridiagonal, diagonally
/// dominant system, solved by elimination from the left.
fn second_derivatives(t: &[f64], x: &[f64]) -> Vec<f64> {
    let n = t.len();
    let h = |i: usize| t[i + 1] - t[i];
    let slope = |i: usize| (x[i + 1] - x[i]) / h(i);
    let (left, right) = (h(0) / h(1), h(n - 2) / h(n - 3));
    let mut upper = vec![0.0; n];
    let mut second = vec![0.0; n];
    for i in 1..n - 1 {
        let (mut lower, mut diagonal, mut above) = (h(i - 1), 2.0 * (h(i - 1) + h(i)), h(i));
        if i == 1 {
            diagonal += h(0) * (1.0 + left);
            above -= h(0) * left;
            lower = 0.0;
        }
        if i == n - 2 {
            diagonal += h(n - 2) * (1.0 + right);
            lower -= h(n - 2) * right;
            above = 0.0;
        }
        let pivot = diagonal - lower * upper[i - 1];
        upper[i] = above / pivot;
        second[i] = (6.0 * (slope(i) - slope(i - 1)) - lower * second[i - 1]) / pivot;
    }
    for i in (1..n - 2).rev() {
        second[i] -= upper[i] * second[i + 1];
    }
    second[0] = second[1] * (1.0 + left) - second[2] * left;
    second[n - 1] = second[n - 2] * (1.0 + right) - second[n - 3] * right;
    second
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uneven_times(n: usize) -> Vec<f64> {
        (0..n).map(|i| i as f64 + 0.3 * (i as f64 * 1.7).sin()).collect()
    }

    #[test]
    fn a_cubic_motion_is_reproduced() {
        let cubic = |t: f64| (0.3 - t * (0.2 - t * (0.05 - 0.01 * t)), -0.2 + t * (0.1 - 0.03 * t));
        for n in [4, 5, 12] {
            let times_s = uneven_times(n);
            let x_m = times_s.iter().map(|&t| cubic(t).0).collect();
            let motion = ImposedMotion::from_samples(times_s, x_m).unwrap();
            for i in 0..100 {
                let t = (n - 1) as f64 * i as f64 / 100.0;
                let ((x, v), (x_true, v_true)) = (motion.at(t), cubic(t));
                // A few roundings of numbers up to 15.
                assert!((x - x_true).abs() < 1e-13 && (v - v_true).abs() < 1e-13, "{n} {t} {x} {x_true}");
            }
        }
    }

    #[test]
    fn the_error_falls_with_the_fourth_power_of_the_interval() {
        let error = |n: usize| {
            let times_s: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
            let x_m = times_s.iter().map(|t| (5.0 * t).sin()).collect();
            let motion = ImposedMotion::from_samples(times_s, x_m).unwrap();
            (0..1000)
                .map(|i| i as f64 / 1000.0)
                .map(|t| (motion.displacement_m(t) - (5.0 * t).sin()).abs())
                .fold(0.0, f64::max)
        };
        let order = (error(40) / error(80)).log2();
        assert!((order - 4.0).abs() < 0.3, "{order}");
    }

    #[test]
    fn samples_that_make_no_motion_are_refused() {
        let refused = |t: &[f64], x: &[f64]| ImposedMotion::from_samples(t.into(), x.into()).unwrap_err();
        assert!(matches!(refused(&[0.0, 1.0, 2.0], &[0.0; 3]), MechanicsError::Length { .. }));
        assert!(matches!(refused(&[0.0, 1.0, 2.0, 3.0], &[0.0; 3]), MechanicsError::Length { .. }));
        let backwards = refused(&[0.0, 1.0, 1.0, 3.0], &[0.0; 4]);
        assert!(matches!(backwards, MechanicsError::TimesNotIncreasing { index: 2, .. }));
        let lost = refused(&[0.0, 1.0, 2.0, 3.0], &[0.0, f64::NAN, 0.0, 0.0]);
        assert!(matches!(lost, MechanicsError::NotPhysical { .. }));
    }
}
