//! Measured peak energies against the chain model's, as a least-squares problem.

use std::sync::atomic::{AtomicU64, Ordering};

use chainwave_measurement::map_in_parallel;
use chainwave_mechanics::Drive;
use nalgebra::{DMatrix, DVector};

use super::model::EnergyModel;
use super::prediction::{Beside, DRIVE_SCALE, N_ALWAYS, Prediction, Times, VELOCITY, priors_of};
use crate::damping::{N_DAMPINGS, critical_kg_per_s, mean_damping_kg_per_s};
use crate::error::FitError;
use crate::least_squares::{Bounds, Failure, LeastSquares, NormalEquations, Unknowns};
use crate::quadrature::quadrature;
use crate::steps::{DAMPING_STEPS, FACTOR_STEP, beside_damping};

/// Predicted values, whitened, from a prediction.
type Predict<'a> = Box<dyn Fn(&Prediction) -> Result<DVector<f64>, FitError> + Sync + 'a>;

/// What is compared: whitened measurement and whitened prediction.
pub(super) struct Comparison<'a> {
    pub(super) measured: DVector<f64>,
    pub(super) predict: Predict<'a>,
    pub(super) times: Times<'a>,
}

/// How far the chains on both sides of the striker's velocity and of the drives' scale are from it, relative to the velocity and to the
/// scale's uncertainty.
const VELOCITY_STEP: f64 = 1e-5;
const DRIVE_SCALE_STEP: f64 = 1e-3;

/// Whitened residuals, and the striker's velocity, the drives' scale and the factors against their priors.
pub(super) struct EnergyResiduals<'a> {
    pub(super) model: &'a EnergyModel,
    comparison: &'a Comparison<'a>,
    steps: Vec<f64>,
    bounds: Bounds,
    n_simulations: AtomicU64,
}

impl<'a> EnergyResiduals<'a> {
    pub(super) fn new(model: &'a EnergyModel, comparison: &'a Comparison<'a>) -> Self {
        let critical = critical_kg_per_s(&model.chain);
        let mut steps = DAMPING_STEPS.map(|step| step * critical).to_vec();
        steps.push(VELOCITY_STEP * model.striker_velocity_m_per_s.value);
        steps.push(DRIVE_SCALE_STEP * model.drive_scale_sigma);
        steps.extend(model.priors.iter().map(|_| FACTOR_STEP));
        // A contact that is damped more than critically hardly moves, and the search would follow a valley without end.
        let mut shared = vec![(0.0, critical); N_DAMPINGS];
        shared.resize(N_ALWAYS, (f64::NEG_INFINITY, f64::INFINITY));
        shared.extend(priors_of(model).bounds());
        Self { model, comparison, steps, bounds: Bounds::dense(shared), n_simulations: AtomicU64::new(0) }
    }

    /// Where a search begins: factors on the model's c_d and c_s.
    pub(super) fn start(&self, factors: [f64; N_DAMPINGS]) -> Result<Unknowns, FitError> {
        let Drive::Striker(striker) = &self.model.chain.drive else { return Err(FitError::NoStriker) };
        let mean_damping = mean_damping_kg_per_s(&self.model.chain);
        let (c_d, c_s) = (factors[0] * mean_damping, factors[1] * striker.damping_kg_per_s);
        let mut start = vec![c_d, c_s, striker.velocity_m_per_s];
        start.resize(self.steps.len(), 1.0);
        Ok(Unknowns::dense(DVector::from_vec(start)))
    }

    /// Chain simulations carried out.
    pub(super) fn n_simulations(&self) -> u64 {
        self.n_simulations.load(Ordering::Relaxed)
    }

    /// Residuals, priors among them.
    pub(super) fn n_residuals(&self) -> usize {
        self.comparison.measured.len() + self.steps.len() - N_DAMPINGS
    }

    /// A search's failure in words.
    pub(super) fn failure(&self, failure: Failure<FitError>) -> FitError {
        FitError::of(failure, "the peak energies", |unknown| match unknown {
            0 => "c_d".into(),
            1 => "c_s".into(),
            VELOCITY => "the striker's velocity".into(),
            DRIVE_SCALE => "the drives' scale".into(),
            factor => priors_of(self.model).name(factor),
        })
    }

    /// Chains beside trial values; a damping goes no farther down than to none.
    fn beside(&self, at: &Unknowns) -> Vec<Beside> {
        let beside = |(i, (step, value)): (usize, (&f64, &f64))| match i < N_DAMPINGS {
            true => beside_damping(*step, *value),
            false => [-step, *step],
        };
        self.steps.iter().zip(&at.shared).enumerate().map(beside).collect()
    }
}

impl LeastSquares for EnergyResiduals<'_> {
    type Error = FitError;

    fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Derivatives of the motion solve the variational equations, those of what is measured in it are differences along them.
    fn equations(&self, at: &Unknowns) -> Result<NormalEquations, FitError> {
        let Comparison { measured, predict, times } = self.comparison;
        let (here, slopes) = Prediction::with_slopes(self.model, &at.shared, *times, &self.beside(at))?;
        let n_runs = quadrature(&self.model.drive_deviations).len();
        self.n_simulations.fetch_add(n_runs as u64, Ordering::Relaxed);
        let last = self.steps.len();
        // What one step along a derivative makes of the energies tells theirs to a part as small as the step.
        let energies = predict(&here)?;
        let column = |i: usize| -> Result<DVector<f64>, FitError> {
            Ok((predict(&here.along(&slopes[i], self.steps[i]))? - &energies) / self.steps[i])
        };
        let mut columns = DMatrix::zeros(measured.len(), last + 1);
        for (i, column) in map_in_parallel(last, self.model.n_threads, column).into_iter().enumerate() {
            columns.set_column(i, &column?);
        }
        columns.set_column(last, &(&energies - measured));
        let mut equations = NormalEquations::new(self.steps.len());
        for row in columns.row_iter() {
            equations.add_row(&row.iter().copied().collect::<Vec<_>>());
        }
        let velocity = self.model.striker_velocity_m_per_s;
        let priors = [(velocity.value, velocity.sigma), (1.0, self.model.drive_scale_sigma)];
        for (unknown, (value, sigma)) in (N_DAMPINGS..).zip(priors) {
            equations.add_prior(unknown, (at.shared[unknown] - value) / sigma, sigma.recip());
        }
        priors_of(self.model).add_priors(&mut equations, &at.shared);
        Ok(equations)
    }
}
