use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

use super::ContactFitError;
use super::curve::Curve;
use super::law::{Law, power_term};
use super::profile::EXPONENTS;

/// Exponents from which the search starts.
pub(super) const STARTS: [f64; 12] = [-0.5, 0.01, 0.1, 0.2, 0.3, 0.5, 0.7, 1.3, 1.5, 2.0, 3.0, 5.0];
/// Offsets delta_0 from which it starts, as fractions of the largest overlap: 10^(-3 + k/2).
const N_OFFSETS: i32 = 11;
/// Readings on which the grid is tried: enough to tell good starts from bad ones.
const GRID_READINGS: usize = 64;
/// Starts that are followed to their minimum.
const N_STARTS: usize = 3;

/// Everything that a fit may vary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Parameters {
    pub(super) law: Law,
    /// What the load cell shows without a force.
    pub(super) offset_n: f64,
    /// Overlap as stated at which contact begins.
    pub(super) start_m: f64,
}

/// Which of them it varies beside k_0 and delta_0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unknowns {
    pub(super) p: bool,
    pub(super) offset: bool,
    pub(super) start: bool,
}

/// A minimum.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimum {
    pub(super) parameters: Parameters,
    pub(super) sum_of_squares: f64,
}

impl Unknowns {
    pub(super) fn count(self) -> usize {
        2 + usize::from(self.p) + usize::from(self.offset) + usize::from(self.start)
    }
}

/// The best law, from several starts: on a grid of exponents and offsets k_0 (and the load cell's offset) follow linearly; the
/// best grid points of different exponents are followed to their minima.
pub(super) fn search(
    curve: &Curve,
    unknowns: Unknowns,
    start_m: f64,
    exponents: &[f64],
) -> Result<Minimum, ContactFitError> {
    let thinned = curve.thinned(GRID_READINGS);
    let mut starts: Vec<Minimum> =
        exponents.iter().filter_map(|p| best_on_grid(&thinned, unknowns, start_m, *p)).collect();
    starts.sort_by(|left, right| left.sum_of_squares.total_cmp(&right.sum_of_squares));
    let minima = starts.iter().take(N_STARTS).filter_map(|start| descend(curve, unknowns, start.parameters));
    minima
        .min_by(|left, right| left.sum_of_squares.total_cmp(&right.sum_of_squares))
        .ok_or_else(|| ContactFitError::NotDetermined("the search did not end from any of its starts".into()))
}

fn best_on_grid(curve: &Curve, unknowns: Unknowns, start_m: f64, p: f64) -> Option<Minimum> {
    let range_m = curve.ends_m().1 - start_m;
    let offsets_m = (0..N_OFFSETS).map(|k| range_m * 10.0_f64.powf(-3.0 + 0.5 * f64::from(k)));
    offsets_m
        .filter_map(|delta_0_m| linear_fit(curve, unknowns.offset, start_m, (delta_0_m, p)))
        .min_by(|left, right| left.sum_of_squares.total_cmp(&right.sum_of_squares))
}

/// The best k_0, and offset where it is unknown, for a given shape (delta_0, p) of the law.
fn linear_fit(curve: &Curve, with_offset: bool, start_m: f64, shape: (f64, f64)) -> Option<Minimum> {
    let (delta_0_m, p) = shape;
    let unit_n = |x: &f64| delta_0_m * power_term(p, ((x - start_m).max(0.0) / delta_0_m).ln_1p());
    let units_n: Vec<f64> = curve.overlap_m.iter().map(unit_n).collect();
    let n = curve.len() as f64;
    let mean = |values: &[f64]| if with_offset { values.iter().sum::<f64>() / n } else { 0.0 };
    let (unit_mean_n, force_mean_n) = (mean(&units_n), mean(&curve.force_n));
    let pairs =
        || units_n.iter().map(|u| u - unit_mean_n).zip(curve.force_n.iter().map(|f| f - force_mean_n));
    let k_0 = pairs().map(|(u, f)| u * f).sum::<f64>() / pairs().map(|(u, _)| u * u).sum::<f64>();
    let sum_of_squares: f64 = pairs().map(|(u, f)| (f - k_0 * u).powi(2)).sum();
    let law = Law { ln_k_0: k_0.ln(), ln_delta_0: delta_0_m.ln(), p };
    let parameters = Parameters { law, offset_n: force_mean_n - k_0 * unit_mean_n, start_m };
    (k_0 > 0.0 && sum_of_squares.is_finite()).then_some(Minimum { parameters, sum_of_squares })
}

/// Follows a start to its minimum by the Levenberg-Marquardt method. A search that leaves the range of exponents may go on for
/// ever (an exponential curve is a power law of infinite p); it ends outside, where only the way it went matters.
pub(super) fn descend(curve: &Curve, unknowns: Unknowns, start: Parameters) -> Option<Minimum> {
    let problem = Problem { curve, unknowns, parameters: start };
    let (problem, report) = LevenbergMarquardt::new().with_tol(1e-13).minimize(problem);
    // "No improvement possible" is the usual end at the limit of rounding.
    let ended = report.termination.was_successful()
        || matches!(report.termination, TerminationReason::NoImprovementPossible(_))
        || !(EXPONENTS.0..=EXPONENTS.1).contains(&problem.parameters.law.p);
    let minimum = Minimum {
        parameters: problem.parameters,
        sum_of_squares: residuals(curve, &problem.parameters).norm_squared(),
    };
    (ended && minimum.sum_of_squares.is_finite()).then_some(minimum)
}

/// Model less measurement, in newtons.
pub(super) fn residuals(curve: &Curve, parameters: &Parameters) -> DVector<f64> {
    let residual = |i: usize| {
        let force_n = parameters.law.at(curve.overlap_m[i] - parameters.start_m).force_n;
        force_n + parameters.offset_n - curve.force_n[i]
    };
    DVector::from_fn(curve.len(), |i, _| residual(i))
}

/// Derivatives of the residuals by ln k_0, ln delta_0 and then the other unknowns.
pub(super) fn jacobian(curve: &Curve, parameters: &Parameters, unknowns: Unknowns) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(curve.len(), unknowns.count());
    for (i, x) in curve.overlap_m.iter().enumerate() {
        let overlap_m = x - parameters.start_m;
        let force = parameters.law.at(overlap_m);
        let by_start = if overlap_m > 0.0 { -force.stiffness_n_per_m } else { 0.0 };
        let others = [(unknowns.p, force.by_p), (unknowns.offset, 1.0), (unknowns.start, by_start)];
        let others = others.into_iter().filter(|(unknown, _)| *unknown).map(|(_, derivative)| derivative);
        let row = [force.by_ln_k_0, force.by_ln_delta_0].into_iter().chain(others);
        for (column, derivative) in row.enumerate() {
            jacobian[(i, column)] = derivative;
        }
    }
    jacobian
}

struct Problem<'a> {
    curve: &'a Curve,
    unknowns: Unknowns,
    parameters: Parameters,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, values: &DVector<f64>) {
        let mut values = values.iter().copied();
        let unknowns = self.unknowns;
        let Parameters { law, offset_n, start_m } = &mut self.parameters;
        let targets = [
            (true, &mut law.ln_k_0),
            (true, &mut law.ln_delta_0),
            (unknowns.p, &mut law.p),
            (unknowns.offset, offset_n),
            (unknowns.start, start_m),
        ];
        for (target, value) in targets.into_iter().filter(|(unknown, _)| *unknown).zip(&mut values) {
            *target.1 = value;
        }
    }

    fn params(&self) -> DVector<f64> {
        let Parameters { law, offset_n, start_m } = self.parameters;
        let others =
            [(self.unknowns.p, law.p), (self.unknowns.offset, offset_n), (self.unknowns.start, start_m)];
        let others = others.into_iter().filter(|(unknown, _)| *unknown).map(|(_, value)| value);
        DVector::from_iterator(self.unknowns.count(), [law.ln_k_0, law.ln_delta_0].into_iter().chain(others))
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(residuals(self.curve, &self.parameters))
            .filter(|residuals| residuals.iter().all(|r| r.is_finite()))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(jacobian(self.curve, &self.parameters, self.unknowns))
    }
}
