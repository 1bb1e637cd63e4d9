//! A quasi-static compression test: the readings of a load cell on a body of known force law.

use rand::RngExt;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::{require, require_not_negative, require_positive};
use crate::seed::{Purpose, stream};

/// A quasi-static compression test of one body between plates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CompressionTest {
    /// Largest overlap, in metres.
    pub max_overlap_m: f64,
    /// Number of readings, equally spaced from overlap 0.
    pub n_points: usize,
    /// Standard deviation of the load cell's normal noise, in newtons.
    pub force_noise_n: f64,
    /// Seed of the noise.
    pub seed: u64,
}

/// The (overlap in metres, force in newtons) readings of a compression test on a body whose law is `force_n`.
///
/// # Errors
/// [`SyntheticError::Setting`] when the test is not a usable one.
pub fn compression_curve(
    force_n: impl Fn(f64) -> f64,
    test: &CompressionTest,
) -> Result<Vec<(f64, f64)>, SyntheticError> {
    require_positive("compression.max_overlap_m", test.max_overlap_m)?;
    require(test.n_points >= 2, "compression.n_points", "at least 2", test.n_points)?;
    require_not_negative("compression.force_noise_n", test.force_noise_n)?;
    let mut random = stream(Purpose::LoadCell, test.seed, 0);
    let last = (test.n_points - 1) as f64;
    let reading = |point: usize| {
        let overlap_m = test.max_overlap_m * point as f64 / last;
        (overlap_m, force_n(overlap_m) + test.force_noise_n * random.sample::<f64, _>(StandardNormal))
    };
    Ok((0..test.n_points).map(reading).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_scatter_around_the_law() {
        let law = |overlap_m: f64| 60.1 * ((overlap_m + 2.27e-3).powf(0.114) - 2.27e-3_f64.powf(0.114));
        let test = CompressionTest { max_overlap_m: 0.01, n_points: 2001, force_noise_n: 0.02, seed: 1 };
        let readings = compression_curve(law, &test).unwrap();
        assert!(readings[0].0.abs() < 1.0e-18 && (readings[2000].0 - 0.01).abs() < 1.0e-18);
        let squares = readings.iter().map(|(overlap_m, force_n)| (force_n - law(*overlap_m)).powi(2));
        let rms_n = (squares.sum::<f64>() / 2001.0).sqrt();
        assert!((rms_n / 0.02 - 1.0).abs() < 4.5 / 63.0, "{rms_n}"); // 4.5 standard errors, 1/sqrt(2 n)
        assert_eq!(readings, compression_curve(law, &test).unwrap());
    }
}
