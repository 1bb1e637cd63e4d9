//! Strain of every gap over time.

use chainwave_measurement::{ChainMotion, ErrorModes, Estimate, Trajectory};
use ndarray::{Array2, ArrayView1};

use crate::AnalysisError;
use crate::check::check_motion;
use crate::spacing::Spacing;

/// Strain of every gap over time with its standard uncertainty.
///
/// Neighbouring gaps share a body, so their errors correlate (by -1/2 for equal independent errors); what needs more than
/// one gap at a time takes its uncertainty from [`crate::replicate`], not from these sigmas.
#[derive(Debug, Clone, PartialEq)]
pub struct StrainMap {
    /// Sample times in seconds, equally spaced.
    pub times_s: Vec<f64>,
    /// How far apart neighbours rest.
    pub spacing: Spacing,
    /// u_n(t), compression negative, shape `[gap, time]` (row i is gap i + 1); `None` where a body of the gap was not seen.
    pub strain: Array2<Option<Estimate>>,
}

impl StrainMap {
    /// Number of gaps.
    pub fn n_gaps(&self) -> usize {
        self.strain.nrows()
    }

    /// Interval between samples in seconds.
    pub fn interval_s(&self) -> f64 {
        match (self.times_s.first(), self.times_s.last()) {
            (Some(first), Some(last)) if self.times_s.len() > 1 => {
                (last - first) / (self.times_s.len() - 1) as f64
            }
            _ => 0.0,
        }
    }
}

/// The strain map of a motion, u_n = (x_{n+1} - x_n)/a (physics.md, Conventions); a is the distance at rest, in metres, of all gaps or of each.
///
/// The variance of a strain is the sum of both bodies' own variances and, mode by mode, the squared *difference*
/// of the bodies' errors: an error that both bodies share (a stage position, say) cancels.
///
/// # Errors
/// [`AnalysisError`] when the pitch is not positive or the motion is inconsistent.
pub fn strain_map(motion: &ChainMotion, spacing: impl Into<Spacing>) -> Result<StrainMap, AnalysisError> {
    let spacing = spacing.into();
    spacing.check()?;
    check_motion(motion)?;
    Ok(strain_with_sigma(motion, &strain_sigma(motion, &spacing), &spacing))
}

/// Residuals of a measured strain map against a model's on the same times, in units of the measured sigma, shape `[gap, time]`;
/// `None` where nothing was measured.
pub fn normalised_residuals(measured: &StrainMap, model: &StrainMap) -> Array2<Option<f64>> {
    Array2::from_shape_fn(measured.strain.dim(), |at| {
        let (measured, model) = (measured.strain[at]?, model.strain[at]?);
        (measured.sigma > 0.0).then(|| (measured.value - model.value) / measured.sigma)
    })
}

/// The strain map of a checked motion whose strains' standard uncertainties are known already, such as those of a replica's original.
pub(crate) fn strain_with_sigma(motion: &ChainMotion, sigma: &Array2<f64>, spacing: &Spacing) -> StrainMap {
    let mut strain = Array2::from_elem(sigma.dim(), None);
    for (gap, (mut strains, sigmas)) in strain.rows_mut().into_iter().zip(sigma.rows()).enumerate() {
        let pitch_m = spacing.of_gap_m(gap + 1);
        let (near, far) = rows_of_gap(&motion.displacement_m, gap);
        let ends = near.into_iter().zip(far);
        for ((strain, sigma), (near, far)) in strains.iter_mut().zip(sigmas).zip(ends) {
            *strain =
                near.zip(*far).map(|(near, far)| Estimate::new((far.value - near.value) / pitch_m, *sigma));
        }
    }
    StrainMap { times_s: motion.times_s.clone(), spacing: spacing.clone(), strain }
}

/// Standard uncertainty of each gap's strain, shape `[gap, time]`.
pub(crate) fn strain_sigma(motion: &ChainMotion, spacing: &Spacing) -> Array2<f64> {
    let mut sigma = overlap_variance_m2(motion).mapv_into(f64::sqrt);
    for (gap, mut row) in sigma.rows_mut().into_iter().enumerate() {
        row /= spacing.of_gap_m(gap + 1);
    }
    sigma
}

/// Variance of each gap's overlap in square metres, shape `[gap, time]`.
fn overlap_variance_m2(motion: &ChainMotion) -> Array2<f64> {
    let n_gaps = motion.n_bodies() - 1;
    let mut variance = Array2::zeros((n_gaps, motion.times_s.len()));
    let own = own_variance(motion);
    for (gap, mut row) in variance.rows_mut().into_iter().enumerate() {
        let (near, far) = rows_of_gap(&own, gap);
        ndarray::Zip::from(&mut row).and(near).and(far).for_each(|total, near, far| *total = near + far);
        let shared = motion.modes.variance_m2(&[(gap, -1.0), (gap + 1, 1.0)]);
        row.iter_mut().zip(shared).for_each(|(total, shared)| *total += shared);
    }
    variance
}

/// Variance of each sample that is not of a shared error. It may be less than that of [`ChainMotion::independent_sigma_m`]: a
/// sample read between frames is a mean of several, which leaves it less noise, shared with its neighbours in time.
fn own_variance(motion: &ChainMotion) -> Array2<f64> {
    let mut variance = motion.displacement_m.mapv(|x| x.map_or(0.0, |x| x.sigma.powi(2)));
    for (body, mut of_body) in variance.rows_mut().into_iter().enumerate() {
        let shared = motion.modes.variance_m2(&[(body, 1.0)]);
        of_body.iter_mut().zip(shared).for_each(|(total, shared)| *total -= shared);
    }
    variance.mapv(|own| own.max(0.0))
}

fn rows_of_gap<T>(array: &Array2<T>, gap: usize) -> (ArrayView1<'_, T>, ArrayView1<'_, T>) {
    (array.row(gap), array.row(gap + 1))
}

/// A model's motion as a measurement without error, so that model and experiment go through the same functions.
pub fn exact_motion(trajectory: &Trajectory) -> ChainMotion {
    let shape = trajectory.displacement_m.dim();
    ChainMotion {
        times_s: trajectory.times_s.clone(),
        displacement_m: trajectory.displacement_m.mapv(|x| Some(Estimate::new(x, 0.0))),
        independent_sigma_m: Array2::zeros(shape),
        modes: ErrorModes::default(),
        n_trials: Array2::ones(shape),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    fn motion() -> ChainMotion {
        // What a body's own error and, for the first two, the stage's come to.
        let seen = |x, own: f64, stage: f64| Some(Estimate::new(x, own.hypot(stage)));
        let times_s: Vec<f64> = (0..8).map(|k| f64::from(k) * 1e-3).collect();
        let column = [seen(3.0, 0.3, 5.0), seen(1.0, 0.4, 5.0), seen(1.5, 1.2, 0.0)];
        let mut displacement_m = Array2::from_shape_fn((3, 8), |(body, _)| column[body]);
        displacement_m[(2, 4)] = None;
        let stage = Array2::from_shape_fn((3, 8), |(body, _)| if body < 2 { 5.0 } else { 0.0 });
        let mut modes = ErrorModes::default();
        modes.push("stage".into(), &stage);
        ChainMotion {
            times_s,
            displacement_m,
            independent_sigma_m: Array2::from_shape_fn((3, 8), |(body, _)| [0.3, 0.4, 1.2][body]),
            modes,
            n_trials: Array2::ones((3, 8)),
        }
    }

    #[test]
    fn compression_is_negative_and_shared_errors_cancel() {
        let map = strain_map(&motion(), 2.0).unwrap();
        // Bodies 1 and 2 stand on one stage: sqrt(0.3^2 + 0.4^2)/2. Body 3 does not: sqrt(0.4^2 + 1.2^2 + 5^2)/2.
        let expected = [(-1.0, 0.25), (0.25, 0.5 * 26.6f64.sqrt())];
        for (gap, (value, sigma)) in expected.into_iter().enumerate() {
            let strain = map.strain[(gap, 0)].unwrap();
            // Rounding of squares near 25.
            assert!((strain.value - value).abs() < 1e-15 && (strain.sigma - sigma).abs() < 1e-13);
        }
        assert_eq!((map.n_gaps(), map.strain[(1, 4)]), (2, None));
        assert!(map.strain[(0, 4)].is_some());
        assert!((map.interval_s() - 1e-3).abs() < 1e-18);
    }

    #[test]
    fn an_exact_motion_has_no_error() {
        let displacement_m = array![[1.0; 8], [2.0; 8]];
        let times_s: Vec<f64> = (0..8).map(f64::from).collect();
        let trajectory = Trajectory { times_s, velocity_m_per_s: displacement_m.clone(), displacement_m };
        let map = strain_map(&exact_motion(&trajectory), 1.0).unwrap();
        assert!(map.strain.iter().all(|strain| *strain == Some(Estimate::new(1.0, 0.0))));
    }
}
