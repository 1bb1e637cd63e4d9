//! Checks of a prescribed motion.

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

#[cfg(test)]
mod tests {
    use ndarray::Array2;

    use super::*;

    #[test]
    fn a_table_of_the_wrong_shape_is_refused() {
        let still = || Array2::zeros((1, 11));
        let mut motion = Trajectory {
            times_s: (0..11).map(f64::from).collect(),
            displacement_m: still(),
            velocity_m_per_s: still(),
        };
        assert!(check(&motion, 1).is_ok());
        assert!(matches!(check(&motion, 2), Err(SyntheticError::Motion { .. })));
        motion.times_s[3] = motion.times_s[2];
        assert!(matches!(check(&motion, 1), Err(SyntheticError::Motion { .. })));
    }
}
