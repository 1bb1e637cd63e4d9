//! Where the camera's stage stood in each view, from bodies that two views saw at rest (least squares over a graph).

use chainwave_measurement::Estimate;
use nalgebra::{DMatrix, DVector};

use crate::error::StitchingError;

/// How far the stage moved from one view to another, by a body that both see at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct StageStep {
    /// Row of the one view.
    pub from: usize,
    /// Row of the other.
    pub to: usize,
    /// Stage position of the other less that of the one, in metres, with the error of this reading alone.
    pub step_m: Estimate,
    /// What one standard deviation of each error that all readings share adds to this one, in metres.
    pub shared_m: Vec<f64>,
}

/// Where the stage stood in each view, by weighted least squares over the graph of views and steps; `None` for a view that
/// nothing ties to another.
///
/// Each view's position is known beforehand as `stated_m`, with the standard uncertainty `stated_sigma_m`. Without one, the
/// first view of each connected group is taken as it is stated and the others count from it. Shared errors (of the scale, say)
/// are unknowns too, each known beforehand as 0 with deviation 1, so that they enter all steps alike. Where the steps
/// contradict each other by more than their own errors explain, these are enlarged to match.
///
/// # Errors
/// [`StitchingError::SingularStages`] when the weights are not finite.
pub fn refine_stages(
    stated_m: &[f64],
    stated_sigma_m: Option<f64>,
    steps: &[StageStep],
) -> Result<Vec<Option<Estimate>>, StitchingError> {
    let groups = groups(stated_m.len(), steps);
    let graph = StageGraph::new(stated_m, stated_sigma_m, steps, &groups);
    let singular = || StitchingError::SingularStages { n_views: stated_m.len(), n_steps: steps.len() };
    let first = graph.solve(1.0).ok_or_else(singular)?;
    let enlargement = graph.contradiction(&first).max(1.0);
    let solution = graph.solve(enlargement).ok_or_else(singular)?;
    let is_tied = |view: usize| groups.iter().filter(|group| **group == groups[view]).count() > 1;
    let refined = |view: usize| match graph.unknowns[view] {
        Some(unknown) => {
            let variance = solution.covariance[(unknown, unknown)];
            Estimate::new(stated_m[view] + solution.values[unknown], variance.sqrt())
        }
        None => Estimate::new(stated_m[view], 0.0),
    };
    Ok((0..stated_m.len()).map(|view| is_tied(view).then(|| refined(view))).collect())
}

/// The first view of the group that each view is tied to.
fn groups(n_views: usize, steps: &[StageStep]) -> Vec<usize> {
    let mut groups: Vec<usize> = (0..n_views).collect();
    for step in steps {
        let (one, other) = (groups[step.from], groups[step.to]);
        let (first, second) = (one.min(other), one.max(other));
        groups.iter_mut().filter(|group| **group == second).for_each(|group| *group = first);
    }
    groups
}

/// Least squares in the corrections of the stated positions, then the shared errors in units of their deviations.
struct StageGraph<'a> {
    steps: &'a [StageStep],
    /// Steps as the stated positions have them, in metres.
    stated_steps_m: Vec<f64>,
    /// Place of each view among the unknowns; `None` where it is held.
    unknowns: Vec<Option<usize>>,
    n_views_free: usize,
    n_shared: usize,
    /// Weight of the stated positions, in m^-2.
    stated_weight: f64,
    /// Steps less the corrections that they alone decide.
    n_spare: usize,
}

struct StageCorrections {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl<'a> StageGraph<'a> {
    fn new(stated_m: &[f64], stated_sigma_m: Option<f64>, steps: &'a [StageStep], groups: &[usize]) -> Self {
        let is_held = |view: usize| stated_sigma_m.is_none() && groups[view] == view;
        let mut n_views_free = 0;
        let unknowns = (0..stated_m.len()).map(|view| {
            (!is_held(view)).then(|| {
                n_views_free += 1;
                n_views_free - 1
            })
        });
        let unknowns = unknowns.collect();
        let n_groups = groups.iter().enumerate().filter(|(view, group)| view == *group).count();
        Self {
            steps,
            stated_steps_m: steps.iter().map(|step| stated_m[step.to] - stated_m[step.from]).collect(),
            unknowns,
            n_views_free,
            n_shared: steps.first().map_or(0, |step| step.shared_m.len()),
            stated_weight: stated_sigma_m.map_or(0.0, |sigma_m| sigma_m.powi(-2)),
            n_spare: steps.len().saturating_sub(stated_m.len() - n_groups),
        }
    }

    /// `None` when the normal equations are singular; variances of the steps count `enlargement` times.
    fn solve(&self, enlargement: f64) -> Option<StageCorrections> {
        let n = self.n_views_free + self.n_shared;
        let prior = |unknown: usize| if unknown < self.n_views_free { self.stated_weight } else { 1.0 };
        let mut normal = DMatrix::from_diagonal(&DVector::from_fn(n, |unknown, _| prior(unknown)));
        let mut right_side = DVector::zeros(n);
        for (index, step) in self.steps.iter().enumerate() {
            let row = self.row(step);
            let weight = (enlargement * step.step_m.sigma.powi(2)).recip();
            normal.ger(weight, &row, &row, 1.0);
            right_side.axpy(weight * (step.step_m.value - self.stated_steps_m[index]), &row, 1.0);
        }
        let covariance = normal.cholesky()?.inverse();
        let values = &covariance * right_side;
        values.iter().all(|value| value.is_finite()).then_some(StageCorrections { values, covariance })
    }

    /// Derivatives of a step by the unknowns.
    fn row(&self, step: &StageStep) -> DVector<f64> {
        let mut row = DVector::zeros(self.n_views_free + self.n_shared);
        for (view, sign) in [(step.from, -1.0), (step.to, 1.0)] {
            if let Some(unknown) = self.unknowns[view] {
                row[unknown] += sign;
            }
        }
        row.rows_mut(self.n_views_free, self.n_shared).copy_from_slice(&step.shared_m);
        row
    }

    /// Mean square of the steps' residuals over what their errors explain; 1 where no residual is left to judge by.
    fn contradiction(&self, solution: &StageCorrections) -> f64 {
        let residual = |(index, step): (usize, &StageStep)| {
            let left_m =
                step.step_m.value - self.stated_steps_m[index] - self.row(step).dot(&solution.values);
            (left_m / step.step_m.sigma).powi(2)
        };
        let squares: f64 = self.steps.iter().enumerate().map(residual).sum();
        if self.n_spare > 0 { squares / self.n_spare as f64 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    use super::*;

    fn step(from: usize, to: usize, value: f64, sigma: f64) -> StageStep {
        StageStep { from, to, step_m: Estimate::new(value, sigma), shared_m: Vec::new() }
    }

    #[test]
    fn without_a_stated_uncertainty_positions_count_from_the_first_view_of_a_group() {
        let steps = [step(1, 2, 0.101, 3e-6), step(2, 1, -0.101, 4e-6), step(4, 3, -0.2, 1e-6)];
        let refined = refine_stages(&[0.0, 0.1, 0.2, 0.3, 0.4], None, &steps).unwrap();
        assert!(refined[0].is_none(), "nothing ties it to another");
        assert_eq!(refined[1], Some(Estimate::new(0.1, 0.0)));
        // Two readings of 3 and 4 um make one of 2.4 um.
        let second = refined[2].unwrap();
        assert!((second.value - 0.201).abs() < 1e-15 && (second.sigma - 2.4e-6).abs() < 1e-15);
        assert!((refined[4].unwrap().value - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_stated_uncertainty_bounds_what_steps_leave_open() {
        let refined = refine_stages(&[0.0, 0.1], Some(2e-5), &[step(0, 1, 0.1 + 3e-5, 1e-9)]).unwrap();
        // The correction is shared between both, and their mean stays uncertain by 20 um over the root of 2.
        for (view, expected_m) in [(0, -1.5e-5), (1, 0.1 + 1.5e-5)] {
            let one = refined[view].unwrap();
            // Weights of 1e18 and 2.5e9 leave rounding of 1e-7 of the correction.
            assert!((one.value - expected_m).abs() < 1e-11, "{one:?}");
            assert!((one.sigma / (2e-5 / 2_f64.sqrt()) - 1.0).abs() < 1e-6, "{one:?}");
        }
    }

    #[test]
    fn contradictions_enlarge_the_uncertainty() {
        let steps = [step(0, 1, 0.1 + 1e-5, 1e-6), step(0, 1, 0.1 - 1e-5, 1e-6)];
        let one = refine_stages(&[0.0, 0.1], None, &steps).unwrap()[1].unwrap();
        // Two readings 20 um apart: their mean is known to half of that.
        assert!((one.sigma - 1e-5).abs() < 1e-12, "{one:?}");
        assert!(refine_stages(&[0.0, 0.1], None, &[step(0, 1, 0.1, 0.0)]).is_err());
    }

    /// Stages, readings of unequal quality and an error of the scale, drawn as they are stated: errors over sigma have
    /// deviation 1.
    #[test]
    fn stated_uncertainties_are_those_of_the_truth() {
        let mut random = Pcg64::seed_from_u64(5);
        let mut deviate = || random.sample::<f64, _>(StandardNormal);
        let stated_m = [0.0, 0.12, 0.24, 0.36];
        let (n_worlds, mut squares) = (500, 0.0);
        for _ in 0..n_worlds {
            let true_m = stated_m.map(|stated_m| stated_m + 2e-5 * deviate());
            let scale_error = deviate();
            let mut read = |from: usize, to: usize, sigma_m: f64| {
                let shared_m = 1e-4 * (true_m[to] - true_m[from]);
                let value = true_m[to] - true_m[from] + shared_m * scale_error + sigma_m * deviate();
                StageStep { shared_m: vec![shared_m], ..step(from, to, value, sigma_m) }
            };
            let steps = [(0, 1, 3e-6), (0, 1, 1e-6), (1, 2, 3e-6), (3, 2, 2e-6)];
            let steps = steps.map(|(from, to, sigma_m)| read(from, to, sigma_m));
            let refined = refine_stages(&stated_m, Some(2e-5), &steps).unwrap();
            for (refined, true_m) in refined.into_iter().zip(true_m) {
                let refined = refined.unwrap();
                squares += ((refined.value - true_m) / refined.sigma).powi(2);
            }
        }
        // Errors of one world are nearly one common error, so that 500 squares count: a standard error of 6 %; enlargement by the one
        // spare reading changes little, as the common error dominates.
        let mean_square = squares / f64::from(4 * n_worlds);
        assert!((mean_square - 1.0).abs() < 0.2, "{mean_square}");
    }
}
