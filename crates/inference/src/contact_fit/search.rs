//! The search for the best law: a grid of shapes, whose best points the common solver follows to their minima.

use std::convert::Infallible;

use nalgebra::{DMatrix, DVector};

use super::curve::Curve;
use super::error::ContactFitError;
use super::law::{EXPONENTS, Law, power_term};
use crate::least_squares::{self, Bounds, LeastSquares, NormalEquations, Stop, minimise};

/// Exponents from which the search starts.
pub(super) const STARTS: [f64; 11] = [0.01, 0.1, 0.2, 0.3, 0.5, 0.7, 1.3, 1.5, 2.0, 3.0, 5.0];
/// Offsets delta_0 from which it starts, as fractions of the largest overlap: 10^(-3 + k/2).
const N_OFFSETS: i32 = 11;
/// Least and largest delta_0 over the largest overlap: a pure power of the overlap has none, an exponential one without end.
const SHORTEST_OFFSET: f64 = 1e-6;
const LONGEST_OFFSET: f64 = 1e4;
/// Readings on which the grid is tried: enough to tell good starts from bad ones.
const GRID_READINGS: usize = 64;
/// Starts that are followed to their minimum.
const N_STARTS: usize = 3;
/// A ten-thousandth of a standard error: the profile compares sums of squares. The valley along which delta_0 and p trade is long and bent.
const STOP: Stop = Stop { step: 1e-4, max_rounds: 500, ..Stop::STATED };

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
        self.chosen([(); 5]).count()
    }

    /// Of what belongs to k_0, delta_0, p, the offset and the start, what belongs to those that vary.
    fn chosen<T>(self, of_each: [T; 5]) -> impl Iterator<Item = T> {
        let varies = [true, true, self.p, self.offset, self.start];
        of_each.into_iter().zip(varies).filter(|(_, varies)| *varies).map(|(one, _)| one)
    }

    fn values(self, parameters: &Parameters) -> DVector<f64> {
        let Parameters { law, offset_n, start_m } = *parameters;
        DVector::from_vec(self.chosen([law.ln_k_0, law.ln_delta_0, law.p, offset_n, start_m]).collect())
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

/// The best k_0, and offset where it is unknown, for a given shape (delta_0, p) of the law, all readings counting alike.
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

/// Follows a start to its minimum.
pub(super) fn descend(curve: &Curve, unknowns: Unknowns, start: Parameters) -> Option<Minimum> {
    let problem = Problem::new(curve, unknowns, start);
    let start = least_squares::Unknowns::dense(unknowns.values(&start));
    let found = minimise(&problem, start, &[], &STOP).ok()?;
    let parameters = problem.parameters(&found.at);
    let sum_of_squares = residuals(curve, &parameters).norm_squared();
    sum_of_squares.is_finite().then_some(Minimum { parameters, sum_of_squares })
}

/// Model less measurement, in newtons.
pub(super) fn off_n(curve: &Curve, parameters: &Parameters) -> DVector<f64> {
    let off_n = |i: usize| {
        let force_n = parameters.law.at(curve.overlap_m[i] - parameters.start_m).force_n;
        force_n + parameters.offset_n - curve.force_n[i]
    };
    DVector::from_fn(curve.len(), |i, _| off_n(i))
}

/// The same by the readings' weights.
pub(super) fn residuals(curve: &Curve, parameters: &Parameters) -> DVector<f64> {
    let mut residuals = off_n(curve, parameters);
    residuals.iter_mut().enumerate().for_each(|(i, residual)| *residual *= curve.weight(i));
    residuals
}

/// Derivatives of the residuals by ln k_0, ln delta_0 and then the other unknowns.
pub(super) fn jacobian(curve: &Curve, parameters: &Parameters, unknowns: Unknowns) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(curve.len(), unknowns.count());
    for (i, x) in curve.overlap_m.iter().enumerate() {
        let overlap_m = x - parameters.start_m;
        let force = parameters.law.at(overlap_m);
        let by_start = if overlap_m > 0.0 { -force.stiffness_n_per_m } else { 0.0 };
        let row = unknowns.chosen([force.by_ln_k_0, force.by_ln_delta_0, force.by_p, 1.0, by_start]);
        for (column, derivative) in row.enumerate() {
            jacobian[(i, column)] = derivative * curve.weight(i);
        }
    }
    jacobian
}

/// A curve and what varies, as the common solver sees it: the unknowns in the order of [`Unknowns::values`].
struct Problem<'a> {
    curve: &'a Curve,
    unknowns: Unknowns,
    /// What does not vary has its value from here.
    fixed: Parameters,
    /// Noise of one force, the unit of residuals.
    noise_n: f64,
    bounds: Bounds,
}

impl<'a> Problem<'a> {
    fn new(curve: &'a Curve, unknowns: Unknowns, fixed: Parameters) -> Self {
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        let range_m = curve.ends_m().1;
        let ln_delta_0 = (SHORTEST_OFFSET * range_m, LONGEST_OFFSET * range_m);
        let chosen = unknowns.chosen([free, (ln_delta_0.0.ln(), ln_delta_0.1.ln()), EXPONENTS, free, free]);
        let bounds = Bounds::dense(chosen.collect());
        Self { curve, unknowns, fixed, noise_n: curve.noise_n().max(curve.rounding_n()), bounds }
    }

    fn parameters(&self, at: &least_squares::Unknowns) -> Parameters {
        let mut parameters = self.fixed;
        let Parameters { law, offset_n, start_m } = &mut parameters;
        let targets = [&mut law.ln_k_0, &mut law.ln_delta_0, &mut law.p, offset_n, start_m];
        self.unknowns.chosen(targets).zip(&at.shared).for_each(|(target, value)| *target = *value);
        parameters
    }
}

impl LeastSquares for Problem<'_> {
    type Error = Infallible;

    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    fn equations(&self, at: &least_squares::Unknowns) -> Result<NormalEquations, Infallible> {
        let parameters = self.parameters(at);
        let residuals = residuals(self.curve, &parameters);
        let jacobian = jacobian(self.curve, &parameters, self.unknowns);
        let mut equations = NormalEquations::new(self.unknowns.count());
        for (derivatives, residual) in jacobian.row_iter().zip(&residuals) {
            let row: Vec<f64> =
                derivatives.iter().chain([residual]).map(|value| value / self.noise_n).collect();
            equations.add_row(&row);
        }
        Ok(equations)
    }
}
