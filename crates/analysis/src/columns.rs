//! Point values of a motion and of its replicas, quantity by quantity, and the scatter that is their uncertainty.

use chainwave_measurement::Estimate;
use ndarray::Array2;

use crate::Missing;

/// Share of the replicas that must yield a value for its scatter to be its uncertainty.
const MIN_SHARE: f64 = 0.75;

/// Standard deviations of its scatter by which an error is told: by chance in 3 of 1000.
const DETECTION_SIGMAS: f64 = 3.0;

/// The measured quantities; each holds one value per gap, per time, or one in all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Column {
    PeakTime,
    PeakStrain,
    PeakTimeBend,
    PeakStrainBend,
    EdgeTime,
    EdgeTimeBend,
    ParticleVelocity,
    ParticleVelocityBend,
    Velocity,
    FirstThird,
    LastThird,
    Variation,
    OffLine,
    MeanParticleVelocity,
    MeanParticleVelocityBend,
    HalfWidth,
    Energy,
    RelativeEnergy,
    EnergyBend,
    RelativeEnergyBend,
    Resonance,
}

const N_COLUMNS: usize = Column::Resonance as usize + 1;

/// All measured values of one motion; `None` where a value is missing.
#[derive(Debug, Clone, Default)]
pub(crate) struct Columns([Vec<Option<f64>>; N_COLUMNS]);

impl Columns {
    pub(crate) fn set(&mut self, column: Column, values: Vec<Option<f64>>) {
        self.0[column as usize] = values;
    }

    fn value(&self, column: Column, row: usize) -> Option<f64> {
        self.0[column as usize].get(row).copied().flatten()
    }
}

/// The values of a motion and of its replicas.
#[derive(Debug, Clone)]
pub(crate) struct Scatter {
    values: Columns,
    replicas: Vec<Columns>,
}

/// Whether errors of gaps, in the standard deviations that noise gives them, are beyond chance in all of them together: by their mean square, or by
/// their mean, as neighbours err alike. Neighbouring gaps share a body, and their noise half its variance with one sign or the other: that makes the
/// mean square scatter by `sqrt(3 / n)` in place of `sqrt(2 / n)`, and a mean of strains by less than `1 / sqrt(n)`.
pub(crate) fn are_told(in_sigmas: &[f64]) -> bool {
    let n = in_sigmas.len() as f64;
    let mean_square = in_sigmas.iter().map(|z| z * z).sum::<f64>() / n;
    let mean = in_sigmas.iter().sum::<f64>() / n;
    mean_square > 1.0 + DETECTION_SIGMAS * (3.0 / n).sqrt() || mean.abs() > DETECTION_SIGMAS / n.sqrt()
}

/// The standard uncertainty of which 1.96 reach as far as 95 % of some deviations; 0 of none.
pub(crate) fn sigma_reaching(mut deviations: Vec<f64>) -> f64 {
    let n_held = (0.95 * deviations.len() as f64).ceil() as usize;
    let Some(last) = n_held.checked_sub(1) else { return 0.0 };
    let by_size = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
    deviations.select_nth_unstable_by(last, by_size).1.abs() / Estimate::COVERAGE_95
}

impl Scatter {
    /// Without replicas the values count as exact.
    pub(crate) fn new(values: Columns, replicas: Vec<Columns>) -> Self {
        Self { values, replicas }
    }

    pub(crate) fn n_replicas(&self) -> usize {
        self.replicas.len()
    }

    /// The motion's value with the standard deviation of the replicas' values.
    pub(crate) fn estimate(&self, column: Column, row: usize) -> Result<Estimate, Missing> {
        let value = self.values.value(column, row).ok_or(Missing::TooFewSamples)?;
        let found: Vec<f64> = self.replicas.iter().filter_map(|replica| replica.value(column, row)).collect();
        if (found.len() as f64) < MIN_SHARE * self.replicas.len() as f64 {
            return Err(Missing::Unstable);
        }
        Ok(Estimate::new(value, covariance(&found, &found).sqrt()))
    }

    /// The same of a quantity whose errors are not normal, as it may jump: 1.96 sigma reach as far from the motion's value as 95 % of the replicas'
    /// values lie, or as their standard deviation puts them where that is farther.
    pub(crate) fn reaching_estimate(&self, column: Column, row: usize) -> Result<Estimate, Missing> {
        let Estimate { value, sigma } = self.estimate(column, row)?;
        let found = self.replicas.iter().filter_map(|replica| replica.value(column, row));
        Ok(Estimate::new(value, sigma.max(sigma_reaching(found.map(|moved| moved - value).collect()))))
    }

    /// The same with an error of which another column tells the size.
    pub(crate) fn estimate_with(
        &self,
        column: Column,
        error: Column,
        row: usize,
    ) -> Result<Estimate, Missing> {
        let Estimate { value, sigma } = self.estimate(column, row)?;
        Ok(Estimate::new(value, sigma.hypot(self.beyond_noise(error, row))))
    }

    /// The size of an error as it shows, less what noise makes of it on average: the root of an unbiased estimate of its square, where that is above 0.
    /// Without replicas values count as exact.
    pub(crate) fn beyond_noise(&self, error: Column, row: usize) -> f64 {
        let excess = |error: Estimate| (error.value.powi(2) - error.sigma.powi(2)).max(0.0).sqrt();
        let shown = self.estimate(error, row).ok().filter(|_| !self.replicas.is_empty());
        shown.map_or(0.0, excess)
    }

    /// Whether an error that a column tells of each row is beyond chance in all of them together ([`are_told`]).
    pub(crate) fn is_told_by_all(&self, error: Column) -> bool {
        if self.replicas.is_empty() {
            return false;
        }
        let rows = 0..self.values.0[error as usize].len();
        let in_sigmas = |row| {
            self.estimate(error, row)
                .ok()
                .filter(|error| error.sigma > 0.0)
                .map(|error| error.value / error.sigma)
        };
        are_told(&rows.filter_map(in_sigmas).collect::<Vec<f64>>())
    }

    /// The same for a quantity that noise shifts on average: what the replicas lie off the motion's value on average is taken off it
    /// (bootstrap estimate of bias, Efron 1979).
    pub(crate) fn unbiased_estimate(&self, column: Column, row: usize) -> Result<Estimate, Missing> {
        let estimate = self.estimate(column, row)?;
        let found = self.replicas.iter().filter_map(|replica| replica.value(column, row));
        let (n, sum) = found.fold((0.0, 0.0), |(n, sum), value| (n + 1.0, sum + value - estimate.value));
        let bias = if n > 0.0 { sum / n } else { 0.0 };
        Ok(Estimate::new(estimate.value - bias, estimate.sigma))
    }

    /// Covariance of a column's values over the replicas that hold them all, shape `[row, row]`, and how many these are.
    pub(crate) fn covariance(&self, column: Column, rows: &[usize]) -> (Array2<f64>, usize) {
        let complete = |replica: &Columns| rows.iter().map(|row| replica.value(column, *row)).collect();
        let draws: Vec<Vec<f64>> = self.replicas.iter().filter_map(complete).collect();
        let of_row = |row: usize| draws.iter().map(|draw| draw[row]).collect::<Vec<f64>>();
        let by_row: Vec<Vec<f64>> = (0..rows.len()).map(of_row).collect();
        let of_pair = |(i, j): (usize, usize)| covariance(&by_row[i], &by_row[j]);
        (Array2::from_shape_fn((rows.len(), rows.len()), of_pair), draws.len())
    }
}

/// Sample covariance; zero for fewer than two draws.
fn covariance(a: &[f64], b: &[f64]) -> f64 {
    if a.len() < 2 {
        return 0.0;
    }
    let mean = |draws: &[f64]| draws.iter().sum::<f64>() / draws.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).sum();
    sum / (a.len() - 1) as f64
}
