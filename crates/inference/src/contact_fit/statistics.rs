//! Noise, covariance and derived parameters of a fitted law, and Student's factor.

use chainwave_measurement::{Estimate, robust_sigma_about_zero};
use chainwave_mechanics::PowerLaw;
use nalgebra::{DMatrix, DVector};

use super::curve::Curve;
use super::error::ContactFitError;
use super::outcome::{OutlyingReading, PARAMETERS, Residual};
use super::search::{Minimum, Unknowns, jacobian, off_n, residuals};

/// A correlation of white residuals, in its standard errors.
const WHITE: f64 = 3.0;
/// Residuals known to follow each other more closely than this leave no estimate of what they cost.
const CLOSEST: f64 = 0.99;
/// A residual that normal noise has in none of 10^8 readings, in standard deviations.
const OUTLYING: f64 = 6.0;
/// Rounding of forces, relative to the largest: the least noise that a fit can have.
const ROUNDING: f64 = 1e-14;

/// The factor that makes of `deviations` of a normal distribution the interval of equal probability for an error whose size is
/// known from `degrees_of_freedom` degrees of freedom only (Student's t, by its expansion in the inverse of these: Fisher and Cornish 1960).
pub(super) fn student(deviations: f64, degrees_of_freedom: usize) -> f64 {
    let (z, nu) = (deviations, degrees_of_freedom as f64);
    let square = z * z;
    let polynomial = |coefficients: &[f64]| coefficients.iter().rev().fold(0.0, |sum, c| sum * square + c);
    z * (1.0
        + polynomial(&[1.0, 1.0]) / (4.0 * nu)
        + polynomial(&[3.0, 16.0, 5.0]) / (96.0 * nu.powi(2))
        + polynomial(&[-15.0, 17.0, 19.0, 3.0]) / (384.0 * nu.powi(3))
        + polynomial(&[-945.0, -1920.0, 1482.0, 776.0, 79.0]) / (92_160.0 * nu.powi(4)))
}

/// What the residuals say of the noise.
pub(super) fn residual(curve: &Curve, minimum: &Minimum, unknowns: Unknowns) -> Residual {
    let residuals = residuals(curve, &minimum.parameters);
    let n = residuals.len();
    let degrees_of_freedom = n - unknowns.count();
    let floor_n = ROUNDING * curve.force_n.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
    let scatter_n = (residuals.norm_squared() / degrees_of_freedom as f64).sqrt();
    let off_n = off_n(curve, &minimum.parameters);
    let autocorrelation = autocorrelation(&residuals, 1);
    let widening = if scatter_n > floor_n { memory(&residuals).sqrt() } else { 1.0 };
    Residual {
        rms_n: (off_n.norm_squared() / n as f64).sqrt(),
        largest_n: off_n.amax(),
        noise_n: scatter_n.max(floor_n),
        overlap_noise_m: None,
        autocorrelation,
        widening,
        n_readings: n,
        degrees_of_freedom,
        outlier: outlier(curve, &residuals),
    }
}

/// The reading farthest out, and how many there are, where noise takes none so far and its neighbours do not follow it as a misfit's do.
fn outlier(curve: &Curve, residuals: &DVector<f64>) -> Option<OutlyingReading> {
    let sigma_n = robust_sigma_about_zero(residuals.iter().copied())?.max(curve.rounding_n());
    let amount_n = |i: usize| residuals.get(i).map_or(0.0, |residual_n| residual_n.abs());
    let stands_alone = |i: &usize| {
        let beside_n = amount_n(i.wrapping_sub(1)).max(amount_n(i + 1));
        amount_n(*i) > OUTLYING * sigma_n && amount_n(*i) > 2.0 * beside_n
    };
    let alone: Vec<usize> = (0..residuals.len()).filter(stands_alone).collect();
    let farthest = *alone.iter().max_by(|a, b| amount_n(**a).total_cmp(&amount_n(**b)))?;
    Some(OutlyingReading {
        overlap_m: curve.overlap_m[farthest],
        off_n: -residuals[farthest] / curve.weight(farthest),
        deviations: amount_n(farthest) / sigma_n,
        n_like_it: alone.len(),
    })
}

/// Variance of a sum of many residuals over that of as many independent ones; 1 where they may well be independent. Two tests see
/// different structure: neighbours that resemble each other (a process of first order), and a slow misfit that is small against noise
/// (correlations of all lags up to the root of the number, summed up; Newey and West 1987).
pub(super) fn memory(residuals: &DVector<f64>) -> f64 {
    let n = residuals.len();
    let correlation_sigma = (n as f64).sqrt().recip();
    let of_neighbours = autocorrelation(residuals, 1);
    let close = of_neighbours.min(CLOSEST);
    let first_order =
        if of_neighbours > WHITE * correlation_sigma { (1.0 + close) / (1.0 - close) } else { 1.0 };
    let n_lags = n.isqrt();
    let sum: f64 = (1..=n_lags).map(|lag| autocorrelation(residuals, lag)).sum();
    let slow = if sum > WHITE * correlation_sigma * (n_lags as f64).sqrt() { 1.0 + 2.0 * sum } else { 1.0 };
    first_order.max(slow)
}

/// Correlation of residuals that are `lag` apart.
fn autocorrelation(residuals: &DVector<f64>, lag: usize) -> f64 {
    let n = residuals.len();
    let products = residuals.rows(0, n - lag).dot(&residuals.rows(lag, n - lag));
    let squares = residuals.norm_squared();
    if squares > 0.0 { products / squares } else { 0.0 }
}

/// Covariance of the unknowns.
pub(super) fn covariance(
    curve: &Curve,
    minimum: &Minimum,
    unknowns: Unknowns,
    residual: &Residual,
) -> Result<DMatrix<f64>, ContactFitError> {
    let mut jacobian = jacobian(curve, &minimum.parameters, unknowns);
    // Columns of unit length, so that the inverse does not depend on units.
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    for (mut column, length) in jacobian.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let sigma_n = residual.noise_n * residual.widening;
    let inverse = (jacobian.transpose() * &jacobian).try_inverse().filter(|inverse| {
        inverse.iter().all(|x| x.is_finite()) && inverse.diagonal().iter().all(|x| *x > 0.0)
    });
    let inverse = inverse.ok_or_else(|| {
        ContactFitError::NotDetermined("its parameters have no separate effect on the force".into())
    })?;
    Ok(DMatrix::from_fn(lengths.len(), lengths.len(), |i, j| {
        inverse[(i, j)] * sigma_n * sigma_n / (lengths[i] * lengths[j])
    }))
}

/// The law's parameters in the order of [`PARAMETERS`], and their correlation.
pub(super) fn derived(
    law: &PowerLaw,
    covariance: &DMatrix<f64>,
) -> ([Estimate; PARAMETERS.len()], [[f64; PARAMETERS.len()]; PARAMETERS.len()]) {
    let PowerLaw { a, delta_0_m, p } = *law;
    let values = [a, delta_0_m, p, law.f_0_n(), law.k_0_n_per_m()];
    // By ln k_0, ln delta_0 and p: a = k_0 delta_0^(1 - p) / p and f_0 = k_0 delta_0 / p.
    let gradients = [
        [a, a * (1.0 - p), -a * (delta_0_m.ln() + 1.0 / p)],
        [0.0, delta_0_m, 0.0],
        [0.0, 0.0, 1.0],
        [values[3], values[3], -values[3] / p],
        [values[4], 0.0, 0.0],
    ];
    let product = |i: usize, j: usize| -> f64 {
        (0..3)
            .flat_map(|r| (0..3).map(move |s| (r, s)))
            .map(|(r, s)| gradients[i][r] * covariance[(r, s)] * gradients[j][s])
            .sum()
    };
    let sigma = |i: usize| product(i, i).max(0.0).sqrt();
    let estimates = std::array::from_fn(|i| Estimate::new(values[i], sigma(i)));
    let correlation = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            if i == j { 1.0 } else { (product(i, j) / (sigma(i) * sigma(j))).clamp(-1.0, 1.0) }
        })
    });
    (estimates, correlation)
}

/// Slope and curvature of a parabola (with a constant where `with_offset`), each with its standard uncertainty; the slope is
/// that of the straight line.
pub(super) fn straightness(curve: &Curve, with_offset: bool) -> Option<(Estimate, Estimate)> {
    let slope = polynomial(curve, with_offset, 1)?;
    let curvature = polynomial(curve, with_offset, 2)?;
    Some((slope, curvature))
}

/// The coefficient of the highest power, up to `degree`.
fn polynomial(curve: &Curve, with_offset: bool, degree: usize) -> Option<Estimate> {
    let (_, highest_m) = curve.ends_m();
    let lowest_power = usize::from(!with_offset);
    let n_columns = degree + 1 - lowest_power;
    let powers = DMatrix::from_fn(curve.len(), n_columns, |i, column| {
        (curve.overlap_m[i] / highest_m).powi((column + lowest_power) as i32)
    });
    let force_n = DVector::from_column_slice(&curve.force_n);
    let inverse = (powers.transpose() * &powers).try_inverse()?;
    let coefficients = &inverse * (powers.transpose() * &force_n);
    let squares = (&powers * &coefficients - &force_n).norm_squared();
    let noise_n = (squares / (curve.len() - n_columns) as f64).sqrt();
    let last = n_columns - 1;
    let unit = highest_m.powi(-(degree as i32));
    Some(Estimate::new(coefficients[last], noise_n * inverse[(last, last)].sqrt()).scaled(unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_misfit_below_the_noise_is_seen_and_noise_is_not() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let residuals = |seed: u64, misfit: f64| {
            let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
            DVector::from_fn(500, |i, _| {
                let noise: f64 = StandardNormal.sample(&mut random);
                noise + misfit * (i as f64 / 25.0).sin()
            })
        };
        // Two tests at three standard errors, one-sided: 0.27 % of noise, and 4 of 400 with a probability of 3 %.
        let n_false = (0..400).filter(|seed| memory(&residuals(*seed, 0.0)) > 1.0).count();
        assert!(n_false <= 6, "{n_false} of 400");
        // A third of the noise: neighbours are correlated by 0.05, about their standard error; 22 lags by their sum of a half.
        let n_seen = (0..50).filter(|seed| memory(&residuals(*seed, 0.5)) > 1.0).count();
        assert!(n_seen >= 45, "{n_seen} of 50");
    }

    #[test]
    fn the_quantiles_are_the_published_ones() {
        // Tables of Student's t at 97.5 %; the series' next term is about 1e-3 of it at 5 degrees of freedom.
        for (degrees_of_freedom, expected) in [(5, 2.5706), (8, 2.3060), (20, 2.0860), (100, 1.9840)] {
            let found = student(Estimate::COVERAGE_95, degrees_of_freedom);
            assert!((found - expected).abs() < 1.5e-3, "{degrees_of_freedom}: {found}");
        }
    }
}
