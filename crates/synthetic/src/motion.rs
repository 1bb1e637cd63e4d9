use chainwave_measurement::Trajectory;

use crate::SyntheticError;

/// Checks that a trajectory can be interpolated: finite, increasing times, one row for each of `n_bodies`.
pub(crate) fn check(motion: &Trajectory, n_bodies: usize) -> Result<(), SyntheticError> {
    let shape = (n_bodies, motion.times_s.len());
    require(!motion.times_s.is_empty(), "at least one sample", || "none".into())?;
    require(
        motion.displacement_m.dim() == shape,
        "displacements of shape [body, time] as the specimen has bodies",
        || format!("{:?} for {shape:?}", motion.displacement_m.dim()),
    )?;
    require(
        motion.velocity_m_per_s.dim() == shape,
        "velocities of shape [body, time] as the specimen has bodies",
        || format!("{:?} for {shape:?}", motion.velocity_m_per_s.dim()),
    )?;
    let increasing = motion.times_s.windows(2).all(|pair| pair[0] < pair[1]);
    let finite = motion.times_s.iter().chain(&motion.displacement_m).chain(&motion.velocity_m_per_s);
    require(increasing, "increasing times", || "a time that is not above the one before it".into())?;
    require(finite.into_iter().all(|value| value.is_finite()), "finite numbers", || "NaN or infinity".into())
}

fn require(holds: bool, expected: &'static str, found: impl Fn() -> String) -> Result<(), SyntheticError> {
    if holds { Ok(()) } else { Err(SyntheticError::Motion { expected, found: found() }) }
}

/// The displacement of every body at `time_s`, in metres, by the cubic Hermite interpolant of the samples around it;
/// `None` after the last sample. Before the first sample the bodies rest where they are at it.
pub(crate) fn displacements_m(motion: &Trajectory, time_s: f64) -> Option<Vec<f64>> {
    let after = motion.times_s.partition_point(|&sample_s| sample_s <= time_s);
    let bodies = 0..motion.displacement_m.nrows();
    if after == 0 {
        return Some(bodies.map(|body| motion.displacement_m[[body, 0]]).collect());
    }
    let (before, &start_s) = (after - 1, motion.times_s.get(after - 1)?);
    let Some(&end_s) = motion.times_s.get(after) else {
        let at_last_sample = time_s <= start_s;
        return at_last_sample.then(|| bodies.map(|body| motion.displacement_m[[body, before]]).collect());
    };
    let basis = hermite_basis((time_s - start_s) / (end_s - start_s), end_s - start_s);
    let interpolated = bodies.map(|body| {
        basis[0] * motion.displacement_m[[body, before]]
            + basis[1] * motion.velocity_m_per_s[[body, before]]
            + basis[2] * motion.displacement_m[[body, after]]
            + basis[3] * motion.velocity_m_per_s[[body, after]]
    });
    Some(interpolated.collect())
}

/// Weights of the value and slope at the start, and of the value and slope at the end, of an interval of length `step`,
/// at the fraction `at` of it.
fn hermite_basis(at: f64, step: f64) -> [f64; 4] {
    let rest = 1.0 - at;
    [
        (1.0 + 2.0 * at) * rest * rest,
        at * rest * rest * step,
        at * at * (3.0 - 2.0 * at),
        -at * at * rest * step,
    ]
}

#[cfg(test)]
mod tests {
    use ndarray::Array2;

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

    fn largest_error(omega: f64, step_s: f64) -> f64 {
        let n = (0.01 / step_s).round() as usize + 1;
        let motion = sine(omega, step_s, n);
        (0..997)
            .map(|i| i as f64 * 1.0e-5)
            .map(|t| (displacements_m(&motion, t).unwrap()[0] - (omega * t).sin()).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn the_error_stays_below_its_bound_and_falls_with_the_fourth_power() {
        // 572 Hz, the top of the chain's band; h^4/384 max|x''''| with max|x''''| = omega^4.
        let omega = 2.0 * std::f64::consts::PI * 572.0;
        for step_s in [4.0e-4, 2.0e-4, 1.0e-4] {
            assert!(largest_error(omega, step_s) <= (omega * step_s).powi(4) / 384.0);
        }
        let order = (largest_error(omega, 4.0e-4) / largest_error(omega, 1.0e-4)).log2() / 2.0;
        // 0.1: the sine's fifth derivative over the coarser step.
        assert!((order - 4.0).abs() < 0.1, "{order}");
    }

    #[test]
    fn bodies_rest_before_the_first_sample_and_are_unknown_after_the_last() {
        let motion = sine(100.0, 1.0e-3, 11);
        assert_eq!(displacements_m(&motion, -5.0), Some(vec![0.0]));
        assert_eq!(displacements_m(&motion, motion.times_s[10]), Some(vec![motion.displacement_m[[0, 10]]]));
        assert_eq!(displacements_m(&motion, 0.0101), None);
    }

    #[test]
    fn a_table_of_the_wrong_shape_is_refused() {
        let mut motion = sine(100.0, 1.0e-3, 11);
        assert!(check(&motion, 1).is_ok());
        assert!(matches!(check(&motion, 2), Err(SyntheticError::Motion { .. })));
        motion.times_s[3] = motion.times_s[2];
        assert!(matches!(check(&motion, 1), Err(SyntheticError::Motion { .. })));
    }
}
