use std::cell::Cell;

use chainwave_measurement::Estimate;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

use super::prediction::{N_UNKNOWNS, Parameters, Prediction, Times, quadrature};
use super::{Damping, EnergyFit, EnergyModel, FitError};

/// Predicted values, whitened, from a prediction.
type Predict<'a> = Box<dyn Fn(&Prediction) -> DVector<f64> + 'a>;

/// What is compared: whitened measurement and whitened prediction.
pub(super) struct Comparison<'a> {
    pub(super) measured: DVector<f64>,
    pub(super) predict: Predict<'a>,
    pub(super) times: Times<'a>,
}

/// How far the chains on both sides of an unknown are from it, in units of its scale; and on both sides of a factor. What is between
/// them is algebra, as straight there as its rounding (1e-13) lets one see.
const BESIDE: f64 = 1e-3;
const BESIDE_FACTOR: f64 = 1e-4;

/// c_d and c_s stay below critical, here in units of their scales: a contact that is damped more hardly moves, and the search would follow
/// a valley without end.
const CRITICAL: [f64; 2] = [100.0, 10.0];

/// Starting points: factors on the model's c_d and c_s.
const STARTS: [[f64; 2]; 3] = [[1.0, 1.0], [10.0, 0.1], [0.1, 10.0]];

/// Fits the parameters from several starting points, and takes their covariance from the Jacobian at the lowest minimum.
pub(super) fn minimise(model: &EnergyModel, comparison: &Comparison<'_>) -> Result<EnergyFit, FitError> {
    let mut n_simulations = 0;
    let mut best: Option<Problem<'_>> = None;
    let mut failed = None;
    for factors in STARTS {
        match search(model, comparison, factors) {
            Ok(found) => {
                n_simulations += found.residuals.n_simulations.get();
                let sum = |problem: &Problem<'_>| problem.sum_of_squares();
                if best.as_ref().is_none_or(|best| sum(&found) < sum(best)) {
                    best = Some(found);
                }
            }
            Err(failure) => failed = Some(failure),
        }
    }
    match (best, failed) {
        (Some(best), _) => Ok(EnergyFit { n_simulations, ..best.finish()? }),
        (None, Some(failure)) => Err(failure),
        (None, None) => Err(FitError::NotConverged("no starting point".into())),
    }
}

fn search<'a>(
    model: &'a EnergyModel,
    comparison: &'a Comparison<'a>,
    factors: [f64; 2],
) -> Result<Problem<'a>, FitError> {
    let problem = Problem::new(model, comparison, factors)?;
    let (problem, report) = LevenbergMarquardt::new().with_tol(1e-10).minimize(problem);
    if let Some(failure) = problem.failure.take() {
        return Err(failure);
    }
    match report.termination.was_successful() {
        true => Ok(problem),
        false => Err(FitError::NotConverged(format!("{:?}", report.termination))),
    }
}

/// Of the unknowns only c_d and c_s, which stand first, have no prior.
const N_DAMPINGS: usize = 2;

struct Problem<'a> {
    residuals: Residuals<'a>,
    parameters: DVector<f64>,
    failure: Cell<Option<FitError>>,
}

/// Residuals as a function of the scaled parameters.
struct Residuals<'a> {
    model: &'a EnergyModel,
    comparison: &'a Comparison<'a>,
    /// Natural scale of each unknown.
    scales: Vec<f64>,
    n_simulations: Cell<u64>,
}

impl Residuals<'_> {
    fn values(&self, scaled: &DVector<f64>) -> Parameters {
        let value = |i: usize| scaled[i] * self.scales[i];
        Parameters {
            chain_damping_kg_per_s: value(0),
            striker_damping_kg_per_s: value(1),
            striker_velocity_m_per_s: value(2),
            drive_scale: value(3),
            factors: (N_UNKNOWNS..scaled.len()).map(value).collect(),
        }
    }

    /// Whitened residuals, and last the striker's velocity, the drives' scale and the factors against their priors.
    fn at(&self, scaled: &DVector<f64>) -> Result<DVector<f64>, FitError> {
        let parameters = self.values(scaled);
        let (prediction, _) = self.predict(&parameters, &[])?;
        let residuals = (self.comparison.predict)(&prediction) - &self.comparison.measured;
        let prior = self.model.striker_velocity_m_per_s;
        let deviation = (parameters.striker_velocity_m_per_s - prior.value) / prior.sigma;
        let scale_deviation = (parameters.drive_scale - 1.0) / self.model.drive_scale_sigma;
        let known = self.model.known.iter().zip(&parameters.factors);
        let priors = known.map(|(known, factor)| (factor - 1.0) / known.relative_sigma);
        let all = residuals.iter().copied().chain([deviation, scale_deviation]).chain(priors);
        Ok(DVector::from_vec(all.collect()))
    }

    /// Derivatives of [`Residuals::at`]: those of the motion solve the variational equations, those of what is measured in it are
    /// differences along them.
    fn jacobian_at(&self, scaled: &DVector<f64>) -> Result<DMatrix<f64>, FitError> {
        let steps: Vec<f64> = (0..scaled.len())
            .map(|i| if i < N_UNKNOWNS { BESIDE * self.scales[i] } else { BESIDE_FACTOR })
            .collect();
        let (here, slopes) = self.predict(&self.values(scaled), &steps)?;
        let measured = &self.comparison.predict;
        let n_measured = self.comparison.measured.len();
        let mut jacobian = DMatrix::zeros(n_measured + scaled.len() - N_DAMPINGS, scaled.len());
        for (i, (slope, step)) in slopes.iter().zip(&steps).enumerate() {
            let [below, above] = [-step, *step].map(|step| measured(&here.along(slope, step)));
            let column = (above - below) * (self.scales[i] / (2.0 * step));
            jacobian.view_mut((0, i), (n_measured, 1)).copy_from(&column);
        }
        let known = self.model.known.iter().map(|known| known.relative_sigma);
        let sigmas = [self.model.striker_velocity_m_per_s.sigma, self.model.drive_scale_sigma];
        for (prior, sigma) in sigmas.into_iter().chain(known).enumerate() {
            let unknown = N_DAMPINGS + prior;
            jacobian[(n_measured + prior, unknown)] = self.scales[unknown] / sigma;
        }
        Ok(jacobian)
    }

    fn predict(
        &self,
        parameters: &Parameters,
        steps: &[f64],
    ) -> Result<(Prediction, Vec<Prediction>), FitError> {
        let found = Prediction::with_slopes(self.model, parameters, self.comparison.times, steps)?;
        let n_runs = quadrature(&self.model.drive_deviations).len();
        self.n_simulations.set(self.n_simulations.get() + n_runs as u64);
        Ok(found)
    }
}

impl<'a> Problem<'a> {
    fn new(
        model: &'a EnergyModel,
        comparison: &'a Comparison<'a>,
        factors: [f64; 2],
    ) -> Result<Self, FitError> {
        let chainwave_mechanics::Drive::Striker(striker) = &model.chain.drive else {
            return Err(FitError::NoStriker);
        };
        let mean_damping = model.chain.damping_kg_per_s.iter().sum::<f64>() / model.chain.n_bodies() as f64;
        // Natural scales: a damping of 1 % of critical for a body and 10 % for the contact, 1 % of the speed, a frame.
        let critical = 2.0 * (model.chain.contact.k_0_n_per_m() * model.chain.mass_kg[0]).sqrt();
        let velocity_m_per_s = model.striker_velocity_m_per_s.value;
        let mut scales =
            vec![0.01 * critical, 0.1 * critical, 0.01 * velocity_m_per_s, model.drive_scale_sigma];
        scales.extend(model.known.iter().map(|known| known.relative_sigma));
        let (c_d, c_s) = (factors[0] * mean_damping, factors[1] * striker.damping_kg_per_s);
        let mut start = vec![c_d, c_s, striker.velocity_m_per_s];
        start.resize(scales.len(), 1.0);
        Ok(Self {
            parameters: DVector::from_fn(scales.len(), |i, _| start[i] / scales[i]),
            residuals: Residuals { model, comparison, scales, n_simulations: Cell::new(0) },
            failure: Cell::new(None),
        })
    }

    fn sum_of_squares(&self) -> f64 {
        self.residuals.at(&self.parameters).map_or(f64::INFINITY, |residuals| residuals.norm_squared())
    }

    fn finish(self) -> Result<EnergyFit, FitError> {
        let residuals = self.residuals.at(&self.parameters)?;
        let jacobian = self.residuals.jacobian_at(&self.parameters)?;
        let covariance = (jacobian.transpose() * &jacobian)
            .try_inverse()
            .ok_or_else(|| FitError::NotConverged("c_d and c_s cannot be told apart".into()))?;
        let freedom = residuals.len().saturating_sub(self.parameters.len()).max(1);
        let reduced_chi_squared = residuals.norm_squared() / freedom as f64;
        // Residuals larger than stated widen the intervals; smaller ones do not narrow them.
        let inflation = reduced_chi_squared.max(1.0).sqrt();
        let estimate = |i: usize| {
            Estimate::new(self.parameters[i], inflation * covariance[(i, i)].sqrt())
                .scaled(self.residuals.scales[i])
        };
        let known = self.residuals.model.known.iter();
        let above_zero = |i: usize| Estimate::new(estimate(i).value.abs(), estimate(i).sigma);
        Ok(EnergyFit {
            damping: Damping {
                chain_damping_kg_per_s: above_zero(0),
                striker_damping_kg_per_s: above_zero(1),
                correlation: covariance[(0, 1)] / (covariance[(0, 0)] * covariance[(1, 1)]).sqrt(),
            },
            striker_velocity_m_per_s: estimate(2),
            drive_scale: estimate(3).value,
            factors: known.zip(N_UNKNOWNS..).map(|(known, i)| (known.quantity, estimate(i))).collect(),
            reduced_chi_squared,
            n_residuals: residuals.len(),
            n_simulations: self.residuals.n_simulations.get(),
        })
    }

    /// Keeps the first failure for the end of the search, which itself only knows that there was one.
    fn keep<T>(&self, result: Result<T, FitError>) -> Option<T> {
        result.map_err(|failure| self.failure.set(Some(failure))).ok()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.parameters.copy_from(parameters);
        self.parameters.iter_mut().zip(CRITICAL).for_each(|(value, most)| *value = value.clamp(-most, most));
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.keep(self.residuals.at(&self.parameters))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        self.keep(self.residuals.jacobian_at(&self.parameters))
    }
}
